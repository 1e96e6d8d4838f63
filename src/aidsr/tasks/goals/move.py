"""Goals of moving a body, or the robot itself, by a distance."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import field_validator

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goals.environment_index import EnvironmentIndex
from aidsr.tasks.goals.goal import COMING, DOING, MARGIN_M, Goal, Wording, offset_sensor, unit
from aidsr.tasks.goals.goal_readings import GoalReadings
from aidsr.tasks.goals.numbers import Positive, a_direction
from aidsr.tasks.goals.unattended import Sweep
from aidsr.tasks.readings import BoolArray, FloatArray
from aidsr.tasks.shaping import closeness, share
from aidsr.tasks.task import Feature, TaskState

_UP = (0.0, 0.0, 1.0)


class _MoveBody(Goal):
    """Base class of goals that move the centre of mass of a body by a distance along a straight line."""

    wording: ClassVar = Wording(
        "goal/move",
        "A body is raised, or gets somewhere.",
        "Three tenths for coming to the body, the rest for its way.",
        ((0.25, "at the body"), (0.6, "half of the way"), (1.0, "all of the way")),
    )

    @property
    @abstractmethod
    def way(self) -> tuple[float, tuple[float, ...]]:
        """Required distance [m] and its direction in world axes."""

    @property
    def moves_bodies(self) -> bool:
        return True

    @property
    def ways(self) -> tuple[tuple[str, float], ...]:
        return ((self.target, self.way[0]),)

    def sweeps(self, environment: EnvironmentIndex) -> tuple[Sweep, ...]:
        joint = environment.only_joint(self.target)
        return (Sweep(joint.body, body=self.target, direction=self.way[1], way_m=self.way[0]),) if joint else ()

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        return (
            offset_sensor(tag, self.target, of_body=True),
            TaskSensor(name=f"{tag}_gap", quantity="distance", target=self.target),
            TaskSensor(name=f"{tag}_position", quantity="target_center_of_mass", target=self.target),
        )

    @property
    def features(self) -> tuple[Feature, ...]:
        return (
            Feature("functional part in the body's frame", "m", (-2, 2), "goal_offset", size=3),
            Feature("gap between the two", "m", (0, 1), "goal_gap"),
            Feature("its centre of mass, from the start on", "m", (-2, 2), "goal_position", size=3),
        )

    def start(self, seen: GoalReadings) -> TaskState:
        return {"start": seen["position"]}

    def observe(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        return np.concatenate([seen["offset"], seen["gap"], seen["position"] - state["start"]], axis=1)

    def progress(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        moved = share(self._way_m(seen, state), self.way[0])
        near = closeness(seen.scalar("gap"), margin=MARGIN_M)  # between surfaces: a body's origin may be deep inside
        # a body that moves has been reached, whichever part of the robot moves it
        return COMING * np.maximum(near, moved) + DOING * moved

    def is_met(self, seen: GoalReadings, state: TaskState) -> BoolArray:
        return np.asarray(self._way_m(seen, state) >= self.way[0])

    def _way_m(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        return np.asarray((seen["position"] - state["start"]) @ unit(self.way[1]))


class Lift(_MoveBody):
    """A body's centre of mass is raised."""

    kind: Literal["lift"]
    target: str
    """Body of the environment that can move."""
    by_m: Positive = 0.05
    """Required height above its position at the start [m]."""

    @property
    def way(self) -> tuple[float, tuple[float, ...]]:
        return self.by_m, _UP

    def resolved(self, environment: EnvironmentIndex) -> Self:
        environment.require_movable(self.target, "lift")
        environment.require_way(self.target, _UP, self.by_m)
        return self

    @property
    def success_text(self) -> str:
        return f"The centre of mass of {self.target} is at least {self.by_m:g} m higher than it was at the start."


class Travel(_MoveBody):
    """The centre of mass of a body, or of the robot if no body is named, moves by a distance along a straight line."""

    kind: Literal["travel"]
    target: str = ""
    """Body of the environment that must be moved; if empty, the robot's own centre of mass must move."""
    distance_m: Positive
    """Required distance [m]."""
    direction: tuple[float, ...] = (1.0, 0.0, 0.0)
    """Direction in world axes, of any length."""

    @field_validator("direction")
    @classmethod
    def _somewhere(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        return a_direction(value)

    @property
    def way(self) -> tuple[float, tuple[float, ...]]:
        return self.distance_m, self.direction

    def resolved(self, environment: EnvironmentIndex) -> Self:
        if not self.target:
            return RobotTravel.model_validate(self.model_dump())  # type: ignore[return-value]
        environment.require_movable(self.target, "travel")
        environment.require_way(self.target, self.direction, self.distance_m)
        return self

    @property
    def success_text(self) -> str:
        return self._text(f"The centre of mass of {self.target}")

    def _text(self, what: str) -> str:
        way = " ".join(f"{number:g}" for number in self.direction)
        return f"{what} is at least {self.distance_m:g} m along {way} (world axes) from where it was at the start."


class RobotTravel(Travel):
    """The robot's own centre of mass moves by a distance: the goal `travel` without a target."""

    wording: ClassVar = Wording(
        "goal/travel",
        "The robot's centre of mass gets somewhere.",
        "Distance travelled.",
        ((0.1, "on its way"), (0.5, "half way"), (1.0, "all of the way")),
    )

    def resolved(self, environment: EnvironmentIndex) -> Self:
        del environment
        return self

    def sweeps(self, environment: EnvironmentIndex) -> tuple[Sweep, ...]:
        del environment
        return ()

    @property
    def needs_contact(self) -> bool:
        return False

    @property
    def moves_bodies(self) -> bool:
        return False

    @property
    def robot_travels(self) -> bool:
        return True

    @property
    def ways(self) -> tuple[tuple[str, float], ...]:
        return (("robot", self.distance_m),)

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        del tag
        return (
            TaskSensor(name="com_position", quantity="center_of_mass"),
            TaskSensor(name="com_velocity", quantity="center_of_mass_velocity"),
        )

    @property
    def features(self) -> tuple[Feature, ...]:
        return (
            Feature("centre of mass, from where it was at the start", "m", (-5, 5), "com_position", size=3),
            Feature("its velocity", "m/s", (-2, 2), "com_velocity", size=3),
            Feature("direction", "", (-1, 1), "(goal)", size=3),
        )

    def start(self, seen: GoalReadings) -> TaskState:
        return {"start": seen["com_position"]}

    def observe(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        direction = np.tile(unit(self.direction), (seen.n, 1))
        return np.concatenate([seen["com_position"] - state["start"], seen["com_velocity"], direction], axis=1)

    def progress(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        return share(self._way_m(seen, state), self.distance_m)

    def _way_m(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        return np.asarray((seen["com_position"] - state["start"]) @ unit(self.direction))

    @property
    def success_text(self) -> str:
        return self._text("The robot's centre of mass")
