"""The parts that the loop calls. The loop has no switches: an ablation replaces a part instead of adding a branch."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from aidsr.core.artifacts import Decision, Keep, Placement, Robot, Scene, TaskReport, ValidationReport
from aidsr.core.roles import Team
from aidsr.loop.early_stop import never_stop
from aidsr.loop.routing import Change
from aidsr.runs import EventLog, IterationFolder

if TYPE_CHECKING:
    from aidsr.fixes import FixResult
    from aidsr.validation.validator import Mount


TeamFor = Callable[[Path], Team]
"""Returns the team for one folder, in which the team's calls are recorded."""

Picture = Callable[[str], bytes]
"""Renders MJCF as a PNG; may raise MjcfError or IsolationError."""

Stalled = Callable[[Sequence[Change]], int | None]
"""Returns how many changes ago the latest one was requested before, to stop early, or None to continue; given the
changes that each iteration of the round requested."""

Halt = Callable[[], bool]
"""Returns whether work should stop as soon as possible."""


TryOnTask = Callable[[Robot, Scene], TaskReport]
"""Tries a stable scene on its task and reports how far it got."""


class Repair(Protocol):
    """Fixes unambiguous mistakes in the MJCF of a robot."""

    def __call__(self, mjcf: str, *, kept_names: Collection[str] = (), keep: Sequence[Keep] = ()) -> FixResult:
        """Return the fixed text and the list of fixes.

        Names in `kept_names` are used outside the text and are kept; parts in `keep` are left alone.
        """
        ...


class Validate(Protocol):
    """Finds all faults of a robot or a scene."""

    def __call__(
        self, mjcf: str, *, mount: Mount = "auto", needs_contact: bool = False, environment: str = ""
    ) -> ValidationReport:
        """Return the report; a robot alone is tested with the simulation options of `environment`, MJCF."""
        ...


class Assemble(Protocol):
    """Places a robot in an environment."""

    def __call__(self, robot: Robot, environment: str, placement: Placement) -> Scene:
        """Return the scene.

        Raises:
            MjcfError: The two cannot become one model.
        """
        ...


class Person(Protocol):
    """Decides on a scene that the Judge passed."""

    def __call__(self, iteration: IterationFolder, log: EventLog, halt: Halt) -> Decision:
        """Return the decision; this may take arbitrarily long."""
        ...


@dataclass(frozen=True)
class Parts:
    """Everything that the loop calls, except files."""

    team_for: TeamFor
    repair: Repair
    """Applied to the Coder's robot before validation."""
    validate: Validate
    assemble: Assemble
    picture: Picture
    """Renders a model in its initial state."""
    filmstrip: Picture
    """Renders a few moments of a model while its actuators move."""
    person: Person
    stalled: Stalled = never_stop
    try_on_task: TryOnTask | None = None
    measure_again: TryOnTask | None = None
    """Tries a scene with separate seeds and variations, to decide which of the scenes that fell short is kept."""
    task_rounds: int = 0
    """Maximum number of times that a design is sent back after a trial on its task."""
    interrupt: Callable[[], None] = lambda: None
    """Makes calls fail that wait for a person's reply or were not made yet; called when work is requested to stop, and
    when it is finished."""
