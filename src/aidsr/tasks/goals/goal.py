"""Base class of all kinds of goal: common keys and methods.

A kind of goal is one record: its keys, its checks of the environment, its sensors, its progress and success, and the
sentences that describe them. `aidsr.tasks.goals.goal_task` makes a task from a goal, and `aidsr.tasks.goals.reading`
lists all kinds.
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
from aidsr.tasks.goals.environment_index import EnvironmentIndex
from aidsr.tasks.goals.goal_readings import GoalReadings
from aidsr.tasks.goals.limits import AnyLimit
from aidsr.tasks.goals.mount import MountDrive
from aidsr.tasks.goals.numbers import Positive, three_numbers
from aidsr.tasks.goals.unattended import Sweep
from aidsr.tasks.readings import BoolArray, FloatArray
from aidsr.tasks.task import Feature, TaskState

GOAL_VERSION = 6
"""Version of what goals measure. It increases when earlier policies would be judged by something they did not learn."""

NEAR_M, MARGIN_M = 0.03, 0.2
"""Distance at which a functional part is at a body, and scale on which coming nearer from farther away is rewarded [m].
Our choice: as in the tasks of the benchmark, whose bodies are of this size."""
COMING, DOING = 0.3, 0.7
"""Shares of the progress for approaching a body and for acting on it. Our choice."""


@dataclass(frozen=True)
class Wording:
    """General description of a kind of goal, for code that reads a task and not its goal."""

    task: str
    """Name of the task, "goal/…"."""
    objective: str
    progress: str
    stages: tuple[tuple[float, str], ...]


class Goal(Artifact):
    """Fields and methods of every kind of goal."""

    wording: ClassVar[Wording]
    target: str = ""
    """Site or body of the environment."""

    hold_s: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.5
    """How long success must last before it counts [s]; in a stage, before the next stage begins."""
    time_limit_s: Positive = 10.0
    """Longest duration of an episode [s]."""
    by_s: Positive | None = None
    """Only in a stage: latest time at which it must be completed, from the start of the episode [s]."""
    base: Base = "any"
    """How the robot's root is held: "fixed", "free", "moving" with its mount, or "any"."""
    mount: MountDrive = MountDrive()
    """Drive of the mount if the base is "moving"."""
    vary_m: tuple[Annotated[float, Field(ge=0, allow_inf_nan=False)], ...] = (0.0, 0.0, 0.0)
    """Largest shift of the target between episodes, to either side along x, y and z [m]."""
    limits: tuple[AnyLimit, ...] = ()
    """Limits that must not be exceeded during the episode."""

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
    def resolved(self, environment: EnvironmentIndex) -> Self:
        """Return the goal with its names resolved in an environment.

        Raises:
            UserError: A name does not exist, or the goal cannot be met in this environment.
        """

    def check_start(self, environment: EnvironmentIndex) -> None:
        """Refuse a resolved goal that is met before anything moves, as far as that is known without a simulation.

        Raises:
            UserError: The goal is met at the start.
        """
        del environment

    @property
    def needs_contact(self) -> bool:
        """Whether the goal can only be met by touching something."""
        return True

    @property
    def places(self) -> tuple[str, ...]:
        """Sites and bodies that `vary_m` shifts."""
        return (self.target,) if self.target else ()

    @property
    def points(self) -> tuple[str, ...]:
        """Sites and bodies whose origin the functional part must reach."""
        return ()

    @property
    def reached(self) -> tuple[tuple[str, float], ...]:
        """Sites and bodies to be reached, each with its tolerance [m]."""
        return ()

    @property
    def corners_m(self) -> tuple[tuple[tuple[float, ...], float], ...]:
        """Points in world coordinates that the functional part must reach, each with its tolerance [m]."""
        return ()

    @property
    def bodies(self) -> tuple[str, ...]:
        """Bodies that must be touched or moved."""
        return self.places

    @property
    def moves_bodies(self) -> bool:
        """Whether `bodies` must be moved."""
        return False

    @property
    def may_target_site(self) -> bool:
        """Whether a name in `places` may be that of a site."""
        return False

    @property
    def near_m(self) -> float:
        """Distance from a point at which it counts as reached [m]."""
        return 0.0

    @property
    def wanted_n(self) -> float | None:
        """Force that a touch must reach [N]; None if the goal requires no force."""
        return None

    @property
    def robot_travels(self) -> bool:
        """Whether the robot as a whole must travel; a robot with a free base always must."""
        return self.base == "free"

    @property
    def ways(self) -> tuple[tuple[str, float], ...]:
        """What must move, "functional_part", "robot" or a body, and how far [m]; empty if no distance is required."""
        return ()

    def sweeps(self, environment: EnvironmentIndex) -> tuple[Sweep, ...]:
        """Return the required motions of single joints; none if several joints, or a free body, must move."""
        del environment
        return ()

    # --- in an episode ---

    @abstractmethod
    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        """Return the sensors of this goal. Names begin with the tag, except those that mean the same for every goal."""

    @property
    @abstractmethod
    def features(self) -> tuple[Feature, ...]:
        """Features that `observe` returns, in this order."""

    def start(self, seen: GoalReadings) -> TaskState:
        """Return the goal's state at the start of the episode."""
        del seen
        return {}

    def update(self, seen: GoalReadings, state: TaskState) -> TaskState:
        """Return the goal's state after one more control step."""
        del seen
        return state

    @abstractmethod
    def observe(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        """Return what a policy observes, (n, k)."""

    @abstractmethod
    def progress(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        """Return the progress of the goal, 0 to 1, (n,)."""

    @abstractmethod
    def is_met(self, seen: GoalReadings, state: TaskState) -> BoolArray:
        """Return whether the goal is met at this moment, (n,)."""

    def bounds(self, tag: str) -> tuple[tuple[str, AnyLimit], ...]:
        """Return the limits that lose the episode as soon as they are exceeded, each with the tag of its sensors.

        `limits` may be exceeded for some time; these may not.
        """
        del tag
        return ()

    # --- in words ---

    @property
    @abstractmethod
    def success_text(self) -> str:
        """Sentence that describes success."""

    @property
    def violation_text(self) -> str:
        """Sentence that describes violations; empty if there are none."""
        return ""

    @property
    def failure_text(self) -> str:
        """Sentences on what loses an episode at once; empty if nothing does."""
        return ""

    def losses(self, seen: GoalReadings, state: TaskState) -> dict[str, BoolArray]:
        """Return whether the episode is irrecoverably lost, (n,) each, by the sentences of `failure_text`."""
        del seen, state
        return {}


def check_speed(goal: Goal) -> None:
    """Refuse a goal whose speed limits make a required distance impossible within the time limit.

    Raises:
        UserError: A speed limit is too low.
    """
    for limit in goal.limits:
        for what, far_m in goal.ways:
            if limit.kind == "speed" and limit.of == what and far_m > limit.at_most_m_s * goal.time_limit_s:
                raise UserError(
                    f"{far_m:g} m at no more than {limit.at_most_m_s:g} m/s take {far_m / limit.at_most_m_s:.3g} s, "
                    f"and time_limit_s is {goal.time_limit_s:g} s; allow more time or more speed"
                )


def unit(direction: tuple[float, ...]) -> FloatArray:
    """Return a direction normalized to length 1, (3,)."""
    return np.asarray(np.array(direction) / np.linalg.norm(direction))


def offset_sensor(tag: str, target: str, *, of_body: bool) -> TaskSensor:
    """Return the sensor "offset": the position of the functional part in the frame of a target."""
    return TaskSensor(name=f"{tag}_offset", quantity="position", target=target, of_body=of_body)


def length_m(vectors: FloatArray) -> FloatArray:
    """Return the lengths of vectors, (..., 3) -> (...)."""
    return np.asarray(np.linalg.norm(vectors, axis=-1))
