"""From a goal and an environment to a task, with everything the goal names looked up."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from aidsr.artifacts import BodySummary, EnvironmentSummary
from aidsr.errors import MjcfError, UserError
from aidsr.sim.ownership import ROBOT_PREFIX
from aidsr.sim.summary import summarize_environment
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
        summary = summarize_environment(mjcf)
    except MjcfError as error:
        raise UserError(f"the environment of the goal cannot be loaded: {error}") from None
    if goal.target:
        _check_target(goal, summary)
    place = _place(goal.target, summary) if any(goal.vary_m) else None
    match goal:
        case Reach():
            return ReachTask(goal=goal, mjcf=mjcf, place=place)
        case Touch():
            return TouchTask(goal=goal, mjcf=mjcf, place=place)
        case Travel(target=""):
            return TravelTask(goal=goal, mjcf=mjcf, place=place)
        case _:
            return MoveTask(goal=goal, mjcf=mjcf, place=place)


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
    carriers = _carriers(goal.target, summary) if goal.kind in ("lift", "travel") else ()
    # of a body without a name it is not known which one it is, so it may be one that moves
    if carriers and not any(body.joints or not body.name for body in carriers):
        raise UserError(f'the body "{goal.target}" cannot move, as no joint carries it; name one that can')


def _is_environment(name: str) -> bool:
    return bool(name) and name != "world" and not name.startswith(ROBOT_PREFIX)


def _place(target: str, summary: EnvironmentSummary) -> Change:
    """Return what puts the target where it is: the outermost of the bodies that carry it.

    Raises:
        UserError: There is nothing to put elsewhere.
    """
    carriers = _carriers(target, summary)
    if not target or (carriers and not carriers[-1].name):
        raise UserError("vary_m puts the target elsewhere and needs one, on a body that has a name; leave it out")
    if not carriers:
        (site,) = (site for site in summary.sites if site.name == target)
        return Change("site_pos", target, site.position_m)
    outermost = carriers[-1]
    if outermost.free:
        return Change("qpos", outermost.name, outermost.position_m, of_body=True)
    return Change("body_pos", outermost.name, outermost.position_m)


def _carriers(target: str, summary: EnvironmentSummary) -> Sequence[BodySummary]:
    """Return the body of a target and those that carry it, outermost last; none for a site of the world."""
    bodies = {body.name: body for body in summary.bodies}
    name = next((site.body for site in summary.sites if site.name == target), target)
    found = []
    while name in bodies and name != "world":
        found.append(bodies[name])
        # several bodies without a name cannot be told apart: what carries them is not looked for
        name = bodies[name].parent if name else "world"
    return found
