"""What every kind of goal has: its keys, and what it can say of itself.

A kind of goal is one record: its keys, what it checks in the environment, what it measures, how far it is done, when it
is met, and the sentences that say so. `aidsr.tasks.goals.goal_task` makes a task of one, and
`aidsr.tasks.goals.reading` knows all of them.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from aidsr.core.artifacts import Artifact, Base
from aidsr.core.errors import UserError
from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goals.alone import Sweep
from aidsr.tasks.goals.limits import AnyLimit
from aidsr.tasks.goals.mount import MountDrive
from aidsr.tasks.goals.numbers import Positive, three_numbers
from aidsr.tasks.goals.seen import Seen
from aidsr.tasks.goals.surroundings import Surroundings
from aidsr.tasks.readings import BoolArray, FloatArray
from aidsr.tasks.task import Feature, TaskState

GOAL_VERSION = 4
"""Of what goals measure. It changes where a policy trained before would be judged by something else than it learned."""

NEAR_M, MARGIN_M = 0.03, 0.2
"""When a functional part is at a body, and how far away it is still worth coming nearer. Our choice: as in the tasks of
the benchmark, whose bodies are of this size."""
COMING, DOING = 0.3, 0.7
"""Shares of the progress for coming to a body and for doing something to it. Our choice."""


@dataclass(frozen=True)
class Wording:
    """What a kind of goal is in general, for those who read a task rather than a goal."""

    task: str
    """Name of the task, "goal/…"."""
    objective: str
    progress: str
    stages: tuple[tuple[float, str], ...]


class Goal(Artifact):
    """Fields of every kind of goal, and what each kind answers."""

    wording: ClassVar[Wording]
    target: str = ""
    """Site or body of the environment."""

    hold_s: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.5
    """How long success must last before it counts [s]; of a stage, before the next begins."""
    time_limit_s: Positive = 10.0
    """How long an episode lasts at most [s]."""
    by_s: Positive | None = None
    """Of a stage: when it must be over at the latest, from the start of the episode [s]."""
    base: Base = "any"
    """What holds the robot's root: "fixed", "free", "moving" with its mount, or "any"."""
    mount: MountDrive = MountDrive()
    """What drives the mount, where the base is "moving"."""
    vary_m: tuple[Annotated[float, Field(ge=0, allow_inf_nan=False)], ...] = (0.0, 0.0, 0.0)
    """How far the target's place differs between episodes, to either side along x, y and z [m]."""
    limits: tuple[AnyLimit, ...] = ()
    """What must not be done meanwhile."""

    @field_validator("vary_m")
    @classmethod
    def _three(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        return three_numbers(value)

    @model_validator(mode="after")
    def _in_itself(self) -> Self:
        if self.hold_s >= self.time_limit_s:
            raise ValueError(f"hold_s ({self.hold_s:g} s) must be shorter than time_limit_s ({self.time_limit_s:g} s)")
        if self.mount.drives and self.base != "moving":
            raise ValueError(f'mount is driven only where the base is "moving"; the base is "{self.base}"')
        if self.base == "moving" and not self.mount.drives:
            raise ValueError(
                'base "moving" requires [mount]: `policy`, actuators that the policy drives, or `timetable`, their '
                "controls over time"
            )
        return self

    # --- in an environment ---

    @abstractmethod
    def resolved(self, around: Surroundings) -> Self:
        """Return the goal with what its names stand for.

        Raises:
            UserError: A name is not that of anything, or the goal cannot be met in this environment.
        """

    @property
    def needs_contact(self) -> bool:
        """Whether it can only be met by touching something."""
        return True

    @property
    def places(self) -> tuple[str, ...]:
        """Sites and bodies that `vary_m` puts elsewhere."""
        return (self.target,) if self.target else ()

    @property
    def points(self) -> tuple[str, ...]:
        """Sites and bodies of which a point is to be reached."""
        return ()

    @property
    def reached(self) -> tuple[tuple[str, float], ...]:
        """The same with how near to each is near enough [m]."""
        return ()

    @property
    def corners_m(self) -> tuple[tuple[tuple[float, ...], float], ...]:
        """Points in world coordinates to be reached by the functional part, with how near is near enough [m]."""
        return ()

    @property
    def bodies(self) -> tuple[str, ...]:
        """Bodies that are to be touched or moved."""
        return self.places

    @property
    def moves_bodies(self) -> bool:
        """Whether they are to be moved."""
        return False

    @property
    def may_target_site(self) -> bool:
        """Whether a place may be that of a site."""
        return False

    @property
    def near_m(self) -> float:
        """How near to a point is near enough [m]."""
        return 0.0

    @property
    def wanted_n(self) -> float | None:
        """Force that a touch must have [N]; None where force is only a means."""
        return None

    @property
    def robot_travels(self) -> bool:
        """Whether the robot itself is to get somewhere: one that stands on nothing has to, whatever the goal."""
        return self.base == "free"

    @property
    def ways(self) -> tuple[tuple[str, float], ...]:
        """What is to go how far [m]: "functional_part", "robot" or a body; none where no length is wanted."""
        return ()

    def sweeps(self, around: Surroundings) -> tuple[Sweep, ...]:
        """Return what single joints of the environment are to do; none where it takes several, or a free body."""
        del around
        return ()

    # --- in an episode ---

    @abstractmethod
    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        """Return what measures the robot for it; names begin with the tag, or mean the same for every goal."""

    @property
    @abstractmethod
    def features(self) -> tuple[Feature, ...]:
        """What `observe` returns, in its order."""

    def start(self, seen: Seen) -> TaskState:
        """Return what is remembered of the beginning."""
        del seen
        return {}

    def update(self, seen: Seen, state: TaskState) -> TaskState:
        """Return what is remembered after one more control step."""
        del seen
        return state

    @abstractmethod
    def observe(self, seen: Seen, state: TaskState) -> FloatArray:
        """Return what a policy observes, (n, k)."""

    @abstractmethod
    def progress(self, seen: Seen, state: TaskState) -> FloatArray:
        """Return how far it is done, 0 to 1, (n,)."""

    @abstractmethod
    def is_met(self, seen: Seen, state: TaskState) -> BoolArray:
        """Return where it is met at this moment, (n,)."""

    def bounds(self, tag: str) -> tuple[tuple[str, AnyLimit], ...]:
        """Return the limits that lose the episode as soon as they are passed, each with the tag of what measures it.

        Of `limits` some time is tolerated; of these none.
        """
        del tag
        return ()

    # --- in words ---

    @property
    @abstractmethod
    def success_text(self) -> str:
        """What success is, in a sentence."""

    @property
    def violation_text(self) -> str:
        """What counts against it, in a sentence; empty where nothing does."""
        return ""

    @property
    def failure_text(self) -> str:
        """What loses an episode at once; empty where nothing does."""
        return ""

    def losses(self, seen: Seen, state: TaskState) -> dict[str, BoolArray]:
        """Return where the episode is lost for good, (n,) each, by sentences that make up `failure_text`."""
        del seen, state
        return {}


def check_speed(goal: Goal) -> None:
    """Refuse a length that a speed limit forbids in the time there is.

    Raises:
        UserError: It does.
    """
    for limit in goal.limits:
        for what, far_m in goal.ways:
            if limit.kind == "speed" and limit.of == what and far_m > limit.at_most_m_s * goal.time_limit_s:
                raise UserError(
                    f"{far_m:g} m at no more than {limit.at_most_m_s:g} m/s take {far_m / limit.at_most_m_s:.3g} s, "
                    f"and time_limit_s is {goal.time_limit_s:g} s; allow more time or more speed"
                )


def unit(direction: tuple[float, ...]) -> FloatArray:
    """Return a direction with the length 1, (3,)."""
    return np.asarray(np.array(direction) / np.linalg.norm(direction))


def offset_sensor(tag: str, target: str, *, of_body: bool) -> TaskSensor:
    """Return the sensor "offset": the functional part in the frame of a target."""
    return TaskSensor(name=f"{tag}_offset", quantity="position", target=target, of_body=of_body)


def length_m(vectors: FloatArray) -> FloatArray:
    """Return the lengths of vectors, (..., 3) -> (...)."""
    return np.asarray(np.linalg.norm(vectors, axis=-1))
