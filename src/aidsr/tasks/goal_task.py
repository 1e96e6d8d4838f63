"""From a goal and an environment to a task, with everything the goal names looked up."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from aidsr.core.artifacts import BodySummary, EnvironmentSummary
from aidsr.core.errors import MjcfError, UserError
from aidsr.sim.environment_summary import summarize_environment
from aidsr.sim.ownership import ROBOT_PREFIX
from aidsr.tasks.goal import AnyGoal, Reach, Touch, Travel
from aidsr.tasks.goal_kinds import GoalTask, MoveTask, ReachTask, TouchTask, TravelTask
from aidsr.tasks.variation import Change

__all__ = ["goal_task"]


def goal_task(goal: AnyGoal, mjcf: str) -> GoalTask:
    """Return the task that a goal makes of an environment, or of a scene in it.

    Raises:
        UserError: The environment cannot be loaded, or what the goal names is not there.
    """
    try:
        summary = summarize_environment(mjcf, may_hold_robot=True)
    except MjcfError as error:
        raise UserError(f"the environment of the goal cannot be loaded: {error}") from None
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
    """Refuse an environment that has a sensor of a name the goal needs: without a robot it cannot be the goal's.

    Raises:
        UserError: It has.
    """
    taken = [sensor.name for sensor in task.sensors if sensor.name in summary.sensors]
    if taken and not any(body.name.startswith(ROBOT_PREFIX) for body in summary.bodies):
        raise UserError(
            f'a sensor "{taken[0]}" is added to measure the goal, and the environment has one of this name already; '
            "rename it there"
        )


def _check_target(goal: AnyGoal, summary: EnvironmentSummary) -> None:
    """Refuse a target that is not there, or that nothing can be done to.

    Raises:
        UserError: As said.
    """
    bodies = [body.name for body in summary.bodies if _is_environment(body.name)]
    sites = [site.name for site in summary.sites if _is_environment(site.name)]
    known = [*sites, *bodies] if goal.kind == "reach" else bodies
    if goal.target not in known:
        what = "a site or a body" if goal.kind == "reach" else "a body"
        near = difflib.get_close_matches(goal.target, known, n=1)
        hint = f'; did you mean "{near[0]}"?' if near else f"; it has {', '.join(known) or 'none'}"
        raise UserError(
            f'the target of a {goal.kind} goal is {what} of the environment, which has no "{goal.target}"{hint}'
        )
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
        raise UserError("vary_m puts the target elsewhere and needs one, on a body that has a name; leave it out")
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
        # several bodies without a name cannot be told apart: what carries them is not looked for
        name = bodies[name].parent if name else "world"
    return found
