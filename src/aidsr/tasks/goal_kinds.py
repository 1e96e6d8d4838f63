"""The tasks that goals make of an environment; observed, rewarded and scored like any other."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goal import AnyGoal, Lift, Reach, Touch, Travel
from aidsr.tasks.goal_words import differs, unwanted, wanted
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess, share
from aidsr.tasks.task import Memory, Task
from aidsr.tasks.variation import Change, Variation

__all__ = ["GoalTask", "MoveTask", "ReachTask", "TouchTask", "TravelTask"]

_NEAR_M, _MARGIN_M = 0.03, 0.2
"""When a functional part is at a body, and how far away it is still worth coming nearer. Our choice: as in the tasks of
the benchmark, whose bodies are of this size."""
_COMING, _DOING = 0.3, 0.7
"""Shares of the progress for coming to a body and for doing something to it. Our choice."""


@dataclass(frozen=True, kw_only=True)
class GoalTask(Task, ABC):
    """What the tasks of all goals share; made by `aidsr.tasks.goal_task`."""

    goal: AnyGoal
    mjcf: str
    """The environment, or a scene in it."""
    place: Change | None
    """Where the target is put, before it is varied; None where it is not."""

    needs_contact: ClassVar = False

    def __post_init__(self) -> None:
        # of a benchmark task these belong to the class; each goal has its own
        said = {"base": self.goal.base, "time_limit_s": self.goal.time_limit_s, "hold_s": self.goal.hold_s}
        looked_at = {"required_names": (self.goal.target,) * bool(self.goal.target), "sensors": self.measured()}
        for name, value in {**said, **looked_at}.items():
            object.__setattr__(self, name, value)

    @abstractmethod
    def measured(self) -> tuple[TaskSensor, ...]:
        """Return what is measured for this goal."""

    @property
    def objective(self) -> str:
        """See `Task`; a design for a goal has its objective in its user's words."""
        return (self.__doc__ or "").partition("\n")[0]

    def terms(self) -> tuple[str, str, str]:
        """See `Task`; with the goal's own numbers."""
        return differs(self.goal), wanted(self.goal), unwanted(self.goal)

    @property
    def environment(self) -> str:
        """See `Task`."""
        return self.mjcf

    def draw(self, rng: np.random.Generator) -> Variation:
        """The target's place, as far to either side as the goal says."""
        if self.place is None:
            return Variation()
        shifted = np.array(self.place.value) + rng.uniform(-1.0, 1.0, 3) * self.goal.vary_m
        return Variation((replace(self.place, value=tuple(shifted)),))

    def violation(self, readings: Readings) -> FloatArray:
        """None."""
        return np.zeros(readings.n)


@dataclass(frozen=True, kw_only=True)
class ReachTask(GoalTask):
    """The functional part comes to the target.

    | index | feature                               | unit | range   | sensor      |
    |-------|---------------------------------------|------|---------|-------------|
    | 0-2   | functional part in the target's frame | m    | -2 to 2 | goal_offset |
    """

    name: ClassVar = "goal/reach"
    stages: ClassVar = ((0.3, "near the target"), (1.0, "there"))
    goal: Reach

    def measured(self) -> tuple[TaskSensor, ...]:
        """See `GoalTask`."""
        return (_offset(self.goal.target, of_body=False),)

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        del memory
        return readings["goal_offset"]

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Nearness."""
        del memory
        return closeness(_distance_m(readings), within=self.goal.within_m, margin=_MARGIN_M)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """Near enough."""
        del memory
        return _distance_m(readings) <= self.goal.within_m


@dataclass(frozen=True, kw_only=True)
class MoveTask(GoalTask):
    """A body is raised, or gets somewhere.

    | index | feature                               | unit | range   | sensor        |
    |-------|---------------------------------------|------|---------|---------------|
    | 0-2   | functional part in the body's frame   | m    | -2 to 2 | goal_offset   |
    | 3-5   | its centre of mass, from the start on | m    | -2 to 2 | goal_position |
    """

    name: ClassVar = "goal/move"
    needs_contact: ClassVar = True
    stages: ClassVar = ((0.25, "at the body"), (0.6, "half of the way"), (1.0, "all of the way"))
    goal: Lift | Travel

    def measured(self) -> tuple[TaskSensor, ...]:
        """See `GoalTask`."""
        body = self.goal.target
        return (
            _offset(body, of_body=True),
            TaskSensor(name="goal_position", quantity="target_center_of_mass", target=body),
        )

    def begin(self, readings: Readings) -> Memory:
        """Where the body's centre of mass was."""
        return {"start": readings["goal_position"]}

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        return np.concatenate([readings["goal_offset"], readings["goal_position"] - memory["start"]], axis=1)

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Three tenths for coming to the body, the rest for its way."""
        moved = share(self._way_m(readings, memory), self._goal_m)
        near = closeness(_distance_m(readings), within=_NEAR_M, margin=_MARGIN_M)
        # a body that moves has been come to, whichever part of the robot moves it
        return _COMING * np.maximum(near, moved) + _DOING * moved

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """The whole way."""
        return self._way_m(readings, memory) >= self._goal_m

    @property
    def _goal_m(self) -> float:
        return self.goal.by_m if isinstance(self.goal, Lift) else self.goal.distance_m

    def _way_m(self, readings: Readings, memory: Memory) -> FloatArray:
        direction = (0.0, 0.0, 1.0) if isinstance(self.goal, Lift) else self.goal.direction
        return np.asarray((readings["goal_position"] - memory["start"]) @ _unit(direction))


@dataclass(frozen=True, kw_only=True)
class TravelTask(GoalTask):
    """The robot's centre of mass gets somewhere.

    | index | feature                                        | unit | range   | sensor       |
    |-------|------------------------------------------------|------|---------|--------------|
    | 0-2   | centre of mass, from where it was at the start | m    | -5 to 5 | com_position |
    | 3-5   | its velocity                                   | m/s  | -2 to 2 | com_velocity |
    | 6-8   | direction                                      |      | -1 to 1 | (goal)       |
    """

    name: ClassVar = "goal/travel"
    stages: ClassVar = ((0.1, "on its way"), (0.5, "half way"), (1.0, "all of the way"))
    goal: Travel

    def measured(self) -> tuple[TaskSensor, ...]:
        """See `GoalTask`."""
        return (
            TaskSensor(name="com_position", quantity="center_of_mass"),
            TaskSensor(name="com_velocity", quantity="center_of_mass_velocity"),
        )

    def begin(self, readings: Readings) -> Memory:
        """Where the centre of mass was."""
        return {"start": readings["com_position"]}

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        way, direction = (
            readings["com_position"] - memory["start"],
            np.tile(_unit(self.goal.direction), (readings.n, 1)),
        )
        return np.concatenate([way, readings["com_velocity"], direction], axis=1)

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Distance travelled."""
        return share(self._way_m(readings, memory), self.goal.distance_m)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """The whole distance."""
        return self._way_m(readings, memory) >= self.goal.distance_m

    def _way_m(self, readings: Readings, memory: Memory) -> FloatArray:
        return np.asarray((readings["com_position"] - memory["start"]) @ _unit(self.goal.direction))


@dataclass(frozen=True, kw_only=True)
class TouchTask(GoalTask):
    """A body is touched.

    | index | feature                             | unit | range   | sensor      |
    |-------|-------------------------------------|------|---------|-------------|
    | 0-2   | functional part in the body's frame | m    | -2 to 2 | goal_offset |
    | 3     | gap between the two                 | m    | 0 to 1  | goal_gap    |
    | 4     | force, 1 = as much as wanted        |      | 0 to 10 | goal_force  |
    """

    name: ClassVar = "goal/touch"
    needs_contact: ClassVar = True
    stages: ClassVar = ((0.25, "at the body"), (0.6, "touching it lightly"), (1.0, "pressing as wanted"))
    goal: Touch

    def measured(self) -> tuple[TaskSensor, ...]:
        """See `GoalTask`."""
        body = self.goal.target
        return (
            _offset(body, of_body=True),
            TaskSensor(name="goal_gap", quantity="distance", target=body),
            TaskSensor(name="goal_force", quantity="contact_force", target=body, part=self.goal.part),
        )

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        del memory
        force = readings.mean_force_n("goal_force") / self.goal.force_n
        return np.column_stack([readings["goal_offset"], readings["goal_gap"], np.clip(force, 0.0, 10.0)])

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Three tenths for coming to the body, the rest for force."""
        del memory
        near = closeness(readings.scalar("goal_gap"), margin=_MARGIN_M)
        return _COMING * near + _DOING * share(readings.mean_force_n("goal_force"), self.goal.force_n)

    def violation(self, readings: Readings) -> FloatArray:
        """More force than wanted, where there is a limit."""
        limit = self.goal.at_most_n
        return super().violation(readings) if limit is None else excess(readings.peak_force_n("goal_force"), limit)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """Force enough, and at no time since the last control step more than wanted."""
        del memory
        enough = readings.mean_force_n("goal_force") >= self.goal.force_n
        return enough & (readings.peak_force_n("goal_force") <= (self.goal.at_most_n or np.inf))


def _offset(target: str, *, of_body: bool) -> TaskSensor:
    return TaskSensor(name="goal_offset", quantity="position", target=target, of_body=of_body)


def _distance_m(readings: Readings) -> FloatArray:
    return np.asarray(np.linalg.norm(readings["goal_offset"], axis=1))


def _unit(direction: Sequence[float]) -> FloatArray:
    return np.asarray(np.array(direction) / np.linalg.norm(direction))
