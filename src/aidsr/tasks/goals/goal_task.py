"""Tasks made from a goal and an environment; they are observed, rewarded and scored like any other task.

`goal_task` makes such a task and resolves all names of the goal.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aidsr.core.artifacts import BodySummary, EnvironmentSummary, ExceededLimit
from aidsr.core.errors import MjcfError, UserError
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.environment_summary import summarize_environment
from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goals.buried import refuse_buried, refuse_buried_corners
from aidsr.tasks.goals.contradictions import refuse_contradictions
from aidsr.tasks.goals.environment_index import EnvironmentIndex
from aidsr.tasks.goals.goal import Goal, check_speed
from aidsr.tasks.goals.goal_readings import GoalReadings
from aidsr.tasks.goals.limits import ROUNDING_S, TOLERATED_S, AnyLimit
from aidsr.tasks.goals.reading import AnyGoal
from aidsr.tasks.goals.stages import Stages
from aidsr.tasks.goals.unattended import UnattendedRun, refuse, run_unattended
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.task import Criteria, Task, TaskState
from aidsr.tasks.variation import Change, Variation

_GOAL, _LIMIT = "goal", "limit"
"""Prefixes of sensor names."""
_STEPS_S = (0.002, 0.001, 0.0005, 0.0002, 0.0001)
"""Time steps that are proposed [s]. Our choice: that of all tasks, and shorter ones that divide the control step."""
_STEP_ROUNDING = 1e-5
"""Relative tolerance of a time step: MJCF is written with six digits."""
_VARIED = 4
"""Number of variations in which the environment is simulated without a robot. Our choice: most have four corners."""
_BEYOND = "beyond_s"
"""State key: total time for which any of the limits was exceeded, (n,) [s]."""
_WORST, _PASSED = "worst", "passed_s"
"""State keys: largest measured value of each watched limit, and total time for which it was exceeded [s], (n, k)."""


@dataclass(frozen=True, kw_only=True)
class GoalTask(Task):
    """Task of a goal, made by `aidsr.tasks.goal_task`."""

    goal: AnyGoal
    mjcf: str
    """MJCF of the environment, or of a scene that contains it."""
    places: tuple[Change, ...] = ()
    """Positions of the targets before they are varied; empty if they are not varied."""
    unattended: tuple[UnattendedRun, ...] = ()
    """Behaviour of the environment without a robot: as written, then in variations. Empty for a scene with a robot."""

    def __post_init__(self) -> None:
        # in benchmark tasks these are class constants; here they depend on the goal
        goal = self.goal
        fields = {
            "name": goal.wording.task,
            "base": goal.base,
            "time_limit_s": goal.time_limit_s,
            "hold_s": goal.hold_s,
            "needs_contact": goal.needs_contact,
            "needs_outline": any(limit.needs_outline for limit in goal.limits),
            "covers_outline": True,
            "required_names": goal.places,
            "sensors": self._sensors(),
            "features": goal.features,
            "stages": goal.stage_words if isinstance(goal, Stages) else goal.wording.stages,
            "policy_actuators": goal.mount.policy,
        }
        for name, value in fields.items():
            object.__setattr__(self, name, value)

    def _sensors(self) -> tuple[TaskSensor, ...]:
        of_limits = (
            sensor for i, limit in enumerate(self.goal.limits, start=1) for sensor in limit.sensors(f"{_LIMIT}{i}")
        )
        return (*self.goal.sensors(_GOAL), *of_limits)

    @property
    def objective(self) -> str:
        """General objective, see `Task`; a design for a goal uses the user's own words instead."""
        return self.goal.wording.objective

    @property
    def criteria(self) -> Criteria:
        goal = self.goal
        against = " ".join(filter(None, [goal.violation_text, *(limit.sentence for limit in goal.limits)]))
        success = goal.success_text
        if goal.limits:
            success += f" The penalized conditions have lasted for no more than {TOLERATED_S:g} s altogether."
        return Criteria(
            variation=self._variation_text(),
            progress=goal.wording.progress,
            success=success,
            violation=against or "Nothing.",
            failure=goal.failure_text,
        )

    def _variation_text(self) -> str:
        goal = self.goal
        ways = [f"{way:g} m along {axis}" for way, axis in zip(goal.vary_m, "xyz", strict=True) if way]
        if not ways:
            return "Nothing: each begins as described here."
        *first, last = goal.places
        what = f"{', '.join(first)} and {last}" if first else last
        verb, each = ("are", "each ") if first else ("is", "")
        where = "where they are" if first else "where it is"
        return f"Where {what} {verb}: {each}up to {', '.join(ways)}, to either side of {where} described here."

    def judging(self) -> dict[str, str]:
        """See `Task`."""
        facts = super().judging()
        if self.goal.mount.drives:
            facts["Who moves the mount"] = self.goal.mount.sentence
        return facts

    @property
    def environment(self) -> str:
        return self.mjcf

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        shifts = rng.uniform(-1.0, 1.0, (len(self.places), 3)) * self.goal.vary_m
        changes = tuple(
            replace(place, value=tuple(np.array(place.value) + shift))
            for place, shift in zip(self.places, shifts, strict=True)
        )
        return Variation(changes, words="; ".join(map(self._moved, self.places, shifts)))

    def _moved(self, place: Change, shift_m: FloatArray) -> str:
        """Return in words how far a place is shifted from its position in the environment."""
        along = zip(shift_m, self.goal.vary_m, "xyz", strict=True)
        return f"{place.name} {', '.join(f'{1000 * m:+.1f} mm along {axis}' for m, most, axis in along if most)}"

    # --- an episode ---

    def _seen(self, readings: Readings) -> GoalReadings:
        return GoalReadings(readings, _GOAL, self.control_dt_s)

    def reset_state(self, readings: Readings) -> TaskState:
        state = dict(self.goal.start(self._seen(readings)))
        if watched := len(self._watched):
            state |= {_WORST: np.zeros((readings.n, watched)), _PASSED: np.zeros((readings.n, watched))}
        if self.goal.limits:
            state[_BEYOND] = np.zeros(readings.n)
        return state

    def script(self, readings: Readings) -> Mapping[str, FloatArray]:
        return self.goal.mount.controls(readings.time_s)

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        after = dict(self.goal.update(self._seen(readings), state))
        if found := self._measured(readings):
            measured = np.stack([each for _, each in found], axis=1)
            passed = measured > np.array([limit.allowed for limit, _ in found])
            after[_WORST] = np.maximum(state[_WORST], measured)
            after[_PASSED] = state[_PASSED] + self.control_dt_s * passed
            if limits := len(self.goal.limits):
                after[_BEYOND] = state[_BEYOND] + self.control_dt_s * passed[:, -limits:].any(axis=1)
        return after

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        return self.goal.observe(self._seen(readings), state)

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        return self.goal.progress(self._seen(readings), state)

    def violation(self, readings: Readings) -> FloatArray:
        found = [limit.severity(measured) for limit, measured in self._measured(readings)]
        return np.max(found, axis=0) if found else np.zeros(readings.n)

    @property
    def _watched(self) -> tuple[tuple[str, AnyLimit], ...]:
        """All limits of the goal, each with the tag of its sensors: first its `bounds`, then its `limits`."""
        limits = ((f"{_LIMIT}{i}", limit) for i, limit in enumerate(self.goal.limits, start=1))
        return (*self.goal.bounds(_GOAL), *limits)

    def _measured(self, readings: Readings) -> list[tuple[AnyLimit, FloatArray]]:
        """Return the watched limits, each with its measured value, (n,)."""
        return [(limit, limit.measured(GoalReadings(readings, tag, self.control_dt_s))) for tag, limit in self._watched]

    def exceeded_limits(self, state: TaskState) -> tuple[ExceededLimit, ...]:
        """See `Task`."""
        return tuple(
            ExceededLimit(
                limit=limit.subject,
                worst=float(state[_WORST][index]),
                allowed=limit.allowed,
                unit=limit.unit,
                time_s=round(float(state[_PASSED][index]), 6),
                tolerated_s=TOLERATED_S if tag.startswith(_LIMIT) else 0.0,
            )
            for index, (tag, limit) in enumerate(self._watched)
            if state[_PASSED][index] > 0.0
        )

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        met = self.goal.is_met(self._seen(readings), state)
        return met & (state[_BEYOND] <= TOLERATED_S + ROUNDING_S) if self.goal.limits else met


class EndingGoalTask(GoalTask):
    """Task of a goal that can be lost before the time limit."""

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        return self.goal.losses(self._seen(readings), state)


def goal_task(goal: AnyGoal, mjcf: str) -> GoalTask:
    """Return the task of a goal in an environment, or in a scene that contains one.

    Raises:
        UserError: The environment cannot be loaded, lacks what the goal names, or makes the goal impossible.
    """
    try:
        summary = summarize_environment(mjcf, may_hold_robot=True)
    except MjcfError as error:
        raise UserError(f"cannot load the environment of the goal: {error}") from None
    environment = EnvironmentIndex(mjcf, summary)
    _check_step(summary.timestep_s)
    found: AnyGoal = goal.resolved(environment)
    found.check_start(environment)
    check_speed(found)
    found.mount.check(environment)
    for number, limit in enumerate(found.limits, start=1):
        try:
            limit.check(environment)
        except UserError as error:
            raise UserError(f"limits {number}: {error}") from None
    refuse_contradictions(found, environment)
    places = _places(found, summary) if any(found.vary_m) else ()
    task = (EndingGoalTask if found.failure_text else GoalTask)(goal=found, mjcf=mjcf, places=places)
    _check_sensors(task, summary)
    if _holds_robot(summary):
        return task
    varied = (task.variation("development", index).changes for index in range(_VARIED if places else 0))
    bodies = [name for name in found.bodies if name in environment.bodies]
    runs = run_unattended(mjcf, bodies, found.sweeps(environment), ((), *varied))
    refuse(runs[0])
    refuse_buried(mjcf, found.reached)
    refuse_buried_corners(mjcf, found.corners_m)
    return replace(task, unattended=runs)


def _check_step(step_s: float) -> None:
    """Refuse a time step that does not divide the control step: hold times and time limits would be wrong.

    The time step of the robot does not matter: assembly divides that of the environment by a whole number.

    Raises:
        UserError: The time step does not divide the control step.
    """
    steps = Task.control_dt_s / step_s if step_s > 0.0 else 0.0
    if round(steps) >= 1 and abs(steps - round(steps)) <= _STEP_ROUNDING * steps:
        return
    cure_s = next((step for step in _STEPS_S if step <= step_s), _STEPS_S[0])
    raise UserError(
        f"the time step {step_s:g} s does not divide the control step of {Task.control_dt_s:g} s; use {cure_s:g}, in "
        f'<option timestep="{cure_s:g}"/>'
    )


def _holds_robot(summary: EnvironmentSummary) -> bool:
    return any(body.name.startswith(ROBOT_PREFIX) for body in summary.bodies)


def _check_sensors(task: GoalTask, summary: EnvironmentSummary) -> None:
    """Check that the environment has no sensor with a name that the goal needs.

    Raises:
        UserError: It has such a sensor, and no robot that the sensor could measure.
    """
    taken = [sensor.name for sensor in task.sensors if sensor.name in summary.sensors]
    if taken and not _holds_robot(summary):
        raise UserError(
            f'the environment already has a sensor "{taken[0]}", which measures the goal; rename it in the environment'
        )


def _places(goal: Goal, summary: EnvironmentSummary) -> tuple[Change, ...]:
    """Return the unvaried positions of the targets: each of the outermost body that carries the target.

    Raises:
        UserError: There is no target on a named body.
    """
    if not goal.places:
        raise UserError("vary_m requires a target on a named body")
    found = [_place(name, goal, summary) for name in goal.places]
    return tuple({(each.field, each.name): each for each in found}.values())


def _place(target: str, goal: Goal, summary: EnvironmentSummary) -> Change:
    carriers = _carriers(target, goal, summary)
    if carriers and not carriers[-1].name:
        raise UserError("vary_m requires a target on a named body")
    if not carriers:
        (site,) = (site for site in summary.sites if site.name == target)
        return Change("site_pos", target, site.position_m)
    outermost = carriers[-1]
    if outermost.name in _under_mounts(summary) and goal.base != "free":
        raise UserError(
            f'vary_m: "{outermost.name}" carries the mount too, so nothing would vary; put "{target}" on a body of its '
            "own"
        )
    if outermost.free:
        return Change("qpos", outermost.name, outermost.position_m, of_body=True)
    return Change("body_pos", outermost.name, outermost.position_m)


def _under_mounts(summary: EnvironmentSummary) -> set[str]:
    """Return the bodies that carry a mount."""
    parents = {body.name: body.parent for body in summary.bodies}
    mounts, found = {mount.name for mount in summary.mounts}, set[str]()
    for site in summary.sites:
        name = site.body if site.name in mounts else "world"
        while name and name != "world":
            found.add(name)
            name = parents.get(name, "world")
    return found


def _carriers(target: str, goal: Goal, summary: EnvironmentSummary) -> Sequence[BodySummary]:
    """Return the body of a target and the bodies that carry it, outermost last; empty for a site of the world."""
    bodies = {body.name: body for body in summary.bodies}
    sites = {site.name: site.body for site in summary.sites} if goal.may_target_site else {}
    name = sites.get(target, target)
    found = []
    while name in bodies and name != "world":
        found.append(bodies[name])
        # bodies without a name cannot be distinguished, so the bodies that carry them are left out
        name = bodies[name].parent if name else "world"
    return found
