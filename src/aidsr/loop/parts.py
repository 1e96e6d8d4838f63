"""The parts that the loop calls. The loop has no switches: an ablation is another part, not a branch."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol

from aidsr.core.artifacts import Decision, Placement, Robot, Scene, TaskReport, ValidationReport
from aidsr.core.roles import Team
from aidsr.loop.early_stop import never_stop
from aidsr.loop.routing import Change
from aidsr.runs import EventLog, IterationFolder

if TYPE_CHECKING:
    from aidsr.fixes import FixResult


Mount = Literal["auto", "fixed", "free"]
"""How a robot alone is held while it is validated."""

TeamFor = Callable[[Path], Team]
"""Returns the team for one folder, in which its calls are recorded."""

Picture = Callable[[str], bytes]
"""Draws MJCF as a PNG; may raise MjcfError or IsolationError."""

Stalled = Callable[[Sequence[Change]], bool]
"""Whether to stop early, by what each iteration of the round found wrong."""

Halt = Callable[[], bool]
"""Whether work should stop as soon as possible."""


TryOnTask = Callable[[Robot, Scene], TaskReport]
"""Tries a stable scene on its task, and reports how far it got."""


class Repair(Protocol):
    """Fixes unambiguous mistakes in the MJCF of a robot."""

    def __call__(self, mjcf: str, *, kept_names: Collection[str] = ()) -> FixResult:
        """Return the fixed text and what was fixed; `kept_names` are referred to from outside the text."""
        ...


class Validate(Protocol):
    """Finds all faults of a robot or a scene."""

    def __call__(
        self, mjcf: str, *, mount: Mount = "auto", needs_contact: bool = False, environment: str = ""
    ) -> ValidationReport:
        """Return the report; a robot alone is tested with the options of `environment`, MJCF."""
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
    """Decides about a scene that the Judge passed."""

    def __call__(self, iteration: IterationFolder, log: EventLog, halt: Halt) -> Decision:
        """Return the decision, however long that takes."""
        ...


@dataclass(frozen=True)
class Parts:
    """Everything the loop calls that is not a file."""

    team_for: TeamFor
    repair: Repair
    """Between the Coder and the validator."""
    validate: Validate
    assemble: Assemble
    picture: Picture
    """Draws a model in its initial state."""
    filmstrip: Picture
    """Draws a few moments of a model while its actuators move."""
    person: Person
    stalled: Stalled = never_stop
    try_on_task: TryOnTask | None = None
    measure_again: TryOnTask | None = None
    """Tries a scene by seeds and variations of its own: decides which of those that fell short is kept."""
    task_rounds: int = 0
    """How often a design may be sent back after a trial on its task."""
    interrupt: Callable[[], None] = lambda: None
    """Makes calls that wait, for a person's reply or for each other, give up; called when work is asked to stop, and
    when it is over."""
