"""The tasks that goals make of an environment; observed, rewarded and scored like any other.

`goal_task` makes one of a goal and an environment, with everything that the goal names resolved.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from aidsr.core.artifacts import BodySummary, EnvironmentSummary
from aidsr.core.errors import MjcfError, UserError
from aidsr.core.suggestions import closest_name
from aidsr.sim.environment_summary import summarize_environment
from aidsr.sim.ownership import ROBOT_PREFIX
from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goal import AnyGoal, Lift, Reach, Touch, Travel
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess, share
from aidsr.tasks.task import Criteria, Feature, Task, TaskState
from aidsr.tasks.variation import Change, Variation

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
    _objective: ClassVar[str]
    _progress: ClassVar[str]

    def __post_init__(self) -> None:
        # of a benchmark task these belong to the class; each goal has its own
        fields = {
            "base": self.goal.base,
            "time_limit_s": self.goal.time_limit_s,
            "hold_s": self.goal.hold_s,
            "required_names": (self.goal.target,) * bool(self.goal.target),
            "sensors": self.task_sensors(),
        }
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    @abstractmethod
    def task_sensors(self) -> tuple[TaskSensor, ...]:
        """Return what measures the robot for this goal."""

    @property
    def objective(self) -> str:
        """See `Task`; a design for a goal has its objective in its user's words."""
        return self._objective

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=self._variation_text(),
            progress=self._progress,
            success=self._success_text(),
            violation=self._violation_text(),
        )

    def _variation_text(self) -> str:
        goal = self.goal
        ways = [f"{way:g} m along {axis}" for way, axis in zip(goal.vary_m, "xyz", strict=True) if way]
        if not ways:
            return "Nothing: each begins as described here."
        return f"Where {goal.target} is: up to {', '.join(ways)}, to either side of where it is described here."

    @abstractmethod
    def _success_text(self) -> str:
        """Return what success is, in a sentence."""

    def _violation_text(self) -> str:
        return "Nothing."

    @property
    def environment(self) -> str:
        return self.mjcf

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        if self.place is None:
            return Variation()
        shifted = np.array(self.place.value) + rng.uniform(-1.0, 1.0, 3) * self.goal.vary_m
        return Variation((replace(self.place, value=tuple(shifted)),))

    def violation(self, readings: Readings) -> FloatArray:
        return np.zeros(readings.n)


@dataclass(frozen=True, kw_only=True)
class ReachTask(GoalTask):
    """The functional part comes to the target."""

    name: ClassVar = "goal/reach"
    stages: ClassVar = ((0.3, "near the target"), (1.0, "there"))
    features: ClassVar = (Feature("functional part in the target's frame", "m", (-2, 2), "goal_offset", size=3),)
    _objective: ClassVar = "The functional part comes to the target."
    _progress: ClassVar = "Nearness."
    goal: Reach

    def _success_text(self) -> str:
        goal = self.goal
        return f"The point with which the functional part works is at most {goal.within_m:g} m from {goal.target}."

    def task_sensors(self) -> tuple[TaskSensor, ...]:
        return (_offset(self.goal.target, of_body=False),)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        return readings["goal_offset"]

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        return closeness(_distance_m(readings), within=self.goal.within_m, margin=_MARGIN_M)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        del state
        return _distance_m(readings) <= self.goal.within_m


@dataclass(frozen=True, kw_only=True)
class MoveTask(GoalTask):
    """A body is raised, or gets somewhere."""

    name: ClassVar = "goal/move"
    needs_contact: ClassVar = True
    stages: ClassVar = ((0.25, "at the body"), (0.6, "half of the way"), (1.0, "all of the way"))
    features: ClassVar = (
        Feature("functional part in the body's frame", "m", (-2, 2), "goal_offset", size=3),
        Feature("its centre of mass, from the start on", "m", (-2, 2), "goal_position", size=3),
    )
    _objective: ClassVar = "A body is raised, or gets somewhere."
    _progress: ClassVar = "Three tenths for coming to the body, the rest for its way."
    goal: Lift | Travel

    def _success_text(self) -> str:
        goal = self.goal
        if isinstance(goal, Travel):
            return _travel_text(f"The centre of mass of {goal.target}", goal)
        return f"The centre of mass of {goal.target} is at least {goal.by_m:g} m higher than it was at the start."

    def task_sensors(self) -> tuple[TaskSensor, ...]:
        body = self.goal.target
        return (
            _offset(body, of_body=True),
            TaskSensor(name="goal_position", quantity="target_center_of_mass", target=body),
        )

    def reset_state(self, readings: Readings) -> TaskState:
        return {"start": readings["goal_position"]}

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        return np.concatenate([readings["goal_offset"], readings["goal_position"] - state["start"]], axis=1)

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        moved = share(self._way_m(readings, state), self._goal_m)
        near = closeness(_distance_m(readings), within=_NEAR_M, margin=_MARGIN_M)
        # a body that moves has been reached, whichever part of the robot moves it
        return _COMING * np.maximum(near, moved) + _DOING * moved

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        return self._way_m(readings, state) >= self._goal_m

    @property
    def _goal_m(self) -> float:
        return self.goal.by_m if isinstance(self.goal, Lift) else self.goal.distance_m

    def _way_m(self, readings: Readings, state: TaskState) -> FloatArray:
        direction = (0.0, 0.0, 1.0) if isinstance(self.goal, Lift) else self.goal.direction
        return np.asarray((readings["goal_position"] - state["start"]) @ _unit(direction))


@dataclass(frozen=True, kw_only=True)
class TravelTask(GoalTask):
    """The robot's centre of mass gets somewhere."""

    name: ClassVar = "goal/travel"
    stages: ClassVar = ((0.1, "on its way"), (0.5, "half way"), (1.0, "all of the way"))
    features: ClassVar = (
        Feature("centre of mass, from where it was at the start", "m", (-5, 5), "com_position", size=3),
        Feature("its velocity", "m/s", (-2, 2), "com_velocity", size=3),
        Feature("direction", "", (-1, 1), "(goal)", size=3),
    )
    _objective: ClassVar = "The robot's centre of mass gets somewhere."
    _progress: ClassVar = "Distance travelled."
    goal: Travel

    def _success_text(self) -> str:
        return _travel_text("The robot's centre of mass", self.goal)

    def task_sensors(self) -> tuple[TaskSensor, ...]:
        return (
            TaskSensor(name="com_position", quantity="center_of_mass"),
            TaskSensor(name="com_velocity", quantity="center_of_mass_velocity"),
        )

    def reset_state(self, readings: Readings) -> TaskState:
        return {"start": readings["com_position"]}

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        way, direction = (
            readings["com_position"] - state["start"],
            np.tile(_unit(self.goal.direction), (readings.n, 1)),
        )
        return np.concatenate([way, readings["com_velocity"], direction], axis=1)

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        return share(self._way_m(readings, state), self.goal.distance_m)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        return self._way_m(readings, state) >= self.goal.distance_m

    def _way_m(self, readings: Readings, state: TaskState) -> FloatArray:
        return np.asarray((readings["com_position"] - state["start"]) @ _unit(self.goal.direction))


@dataclass(frozen=True, kw_only=True)
class TouchTask(GoalTask):
    """A body is touched."""

    name: ClassVar = "goal/touch"
    needs_contact: ClassVar = True
    stages: ClassVar = ((0.25, "at the body"), (0.6, "touching it lightly"), (1.0, "pressing as wanted"))
    features: ClassVar = (
        Feature("functional part in the body's frame", "m", (-2, 2), "goal_offset", size=3),
        Feature("gap between the two", "m", (0, 1), "goal_gap"),
        Feature("force, 1 = as much as wanted", "", (0, 10), "goal_force"),
    )
    _objective: ClassVar = "A body is touched."
    _progress: ClassVar = "Three tenths for coming to the body, the rest for force."
    goal: Touch

    def _success_text(self) -> str:
        goal = self.goal
        part = "the functional part" if goal.part == "functional_part" else "any part of the robot"
        most = "" if goal.at_most_n is None else f" and at most {goal.at_most_n:g} N"
        return f"The net force on {goal.target} by {part} is at least {goal.force_n:g} N{most}."

    def _violation_text(self) -> str:
        limit = self.goal.at_most_n
        return (
            super()._violation_text()
            if limit is None
            else f"More than {limit:g} N on {self.goal.target} at any moment."
        )

    def task_sensors(self) -> tuple[TaskSensor, ...]:
        body = self.goal.target
        return (
            _offset(body, of_body=True),
            TaskSensor(name="goal_gap", quantity="distance", target=body),
            TaskSensor(name="goal_force", quantity="contact_force", target=body, part=self.goal.part),
        )

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        force = readings.mean_force_n("goal_force") / self.goal.force_n
        return np.column_stack([readings["goal_offset"], readings["goal_gap"], np.clip(force, 0.0, 10.0)])

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        near = closeness(readings.scalar("goal_gap"), margin=_MARGIN_M)
        return _COMING * near + _DOING * share(readings.mean_force_n("goal_force"), self.goal.force_n)

    def violation(self, readings: Readings) -> FloatArray:
        limit = self.goal.at_most_n
        return super().violation(readings) if limit is None else excess(readings.peak_force_n("goal_force"), limit)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        del state
        enough = readings.mean_force_n("goal_force") >= self.goal.force_n
        return enough & (readings.peak_force_n("goal_force") <= (self.goal.at_most_n or np.inf))


def goal_task(goal: AnyGoal, mjcf: str) -> GoalTask:
    """Return the task that a goal makes of an environment, or of a scene in it.

    Raises:
        UserError: The environment cannot be loaded, or what the goal names is not there.
    """
    try:
        summary = summarize_environment(mjcf, may_hold_robot=True)
    except MjcfError as error:
        raise UserError(f"cannot load the environment of the goal: {error}") from None
    if goal.target:
        _check_target(goal, summary)
    task = _kind(goal)(goal=goal, mjcf=mjcf, place=_place(goal, summary) if any(goal.vary_m) else None)
    _check_sensors(task, summary)
    return task


def _kind(goal: AnyGoal) -> type[GoalTask]:
    match goal:
        case Reach():
            return ReachTask
        case Touch():
            return TouchTask
        case Travel(target=""):
            return TravelTask
        case _:
            return MoveTask


def _check_sensors(task: GoalTask, summary: EnvironmentSummary) -> None:
    """Check that the environment has no sensor of a name that the goal needs.

    Raises:
        UserError: It has one, and no robot that the sensor could be for.
    """
    taken = [sensor.name for sensor in task.sensors if sensor.name in summary.sensors]
    if taken and not any(body.name.startswith(ROBOT_PREFIX) for body in summary.bodies):
        raise UserError(
            f'the environment already has a sensor "{taken[0]}", which measures the goal; rename it in the environment'
        )


def _check_target(goal: AnyGoal, summary: EnvironmentSummary) -> None:
    """Check that the target exists and can move where it has to.

    Raises:
        UserError: It does not.
    """
    bodies = [body.name for body in summary.bodies if _is_environment(body.name)]
    sites = [site.name for site in summary.sites if _is_environment(site.name)]
    known = [*sites, *bodies] if goal.kind == "reach" else bodies
    if goal.target not in known:
        what = "a site or a body" if goal.kind == "reach" else "a body"
        near = closest_name(goal.target, known)
        hint = f'; did you mean "{near}"?' if near else f"; it has {', '.join(known) or 'none'}"
        raise UserError(f'unknown target "{goal.target}": a {goal.kind} goal needs {what} of the environment{hint}')
    if goal.kind in ("lift", "travel") and not any(body.movable for body in summary.bodies if body.name == goal.target):
        raise UserError(
            f'the body "{goal.target}" cannot move: no joint carries it, or it turns about its own centre of mass, the '
            "point whose way is measured; name a body that can, such as a part of it beside the axis"
        )


def _is_environment(name: str) -> bool:
    return bool(name) and name != "world" and not name.startswith(ROBOT_PREFIX)


def _place(goal: AnyGoal, summary: EnvironmentSummary) -> Change:
    """Return what puts the target where it is: the outermost of the bodies that carry it.

    Raises:
        UserError: There is nothing to put elsewhere.
    """
    target, carriers = goal.target, _carriers(goal, summary)
    if not target or (carriers and not carriers[-1].name):
        raise UserError("vary_m requires a target on a named body")
    if not carriers:
        (site,) = (site for site in summary.sites if site.name == target)
        return Change("site_pos", target, site.position_m)
    outermost = carriers[-1]
    if outermost.free:
        return Change("qpos", outermost.name, outermost.position_m, of_body=True)
    return Change("body_pos", outermost.name, outermost.position_m)


def _carriers(goal: AnyGoal, summary: EnvironmentSummary) -> Sequence[BodySummary]:
    """Return the body of a goal's target and those that carry it, outermost last; none for a site of the world."""
    bodies = {body.name: body for body in summary.bodies}
    sites = {site.name: site.body for site in summary.sites} if goal.kind == "reach" else {}
    name = sites.get(goal.target, goal.target)
    found = []
    while name in bodies and name != "world":
        found.append(bodies[name])
        # several bodies without a name cannot be distinguished: what carries them is left out
        name = bodies[name].parent if name else "world"
    return found


def _travel_text(what: str, goal: Travel) -> str:
    way = " ".join(f"{number:g}" for number in goal.direction)
    return f"{what} is at least {goal.distance_m:g} m along {way} (world axes) from where it was at the start."


def _offset(target: str, *, of_body: bool) -> TaskSensor:
    return TaskSensor(name="goal_offset", quantity="position", target=target, of_body=of_body)


def _distance_m(readings: Readings) -> FloatArray:
    return np.asarray(np.linalg.norm(readings["goal_offset"], axis=1))


def _unit(direction: Sequence[float]) -> FloatArray:
    return np.asarray(np.array(direction) / np.linalg.norm(direction))
