"""Checks for limits of a goal that forbid what the goal requires."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from aidsr.core.errors import UserError
from aidsr.tasks.goals.bring import Bring
from aidsr.tasks.goals.environment_index import EnvironmentIndex
from aidsr.tasks.goals.follow import Follow
from aidsr.tasks.goals.goal import Goal
from aidsr.tasks.goals.limits import PART, ROBOT, ROUNDING_S, TOLERATED_S, AnyLimit, ForceLimit, KeepOut
from aidsr.tasks.goals.stages import Stages
from aidsr.tasks.goals.touch import Touch
from aidsr.tasks.readings import FloatArray
from aidsr.tasks.task import Task


def refuse_contradictions(goal: Goal, environment: EnvironmentIndex) -> None:
    """Refuse a goal whose limits make it impossible to meet.

    Args:
        goal: The goal with its names resolved.
        environment: The environment.

    Raises:
        UserError: A touch needs more force than a limit on the same body, or another stage, allows; a point to reach
            lies, with its whole tolerance and in every variation, in a region that the functional part must keep out
            of; a path leads through a region that its follower must keep out of, for longer than is tolerated even at
            the largest speed; bodies have to be brought into a region that lies in one that they must keep out of; or
            all mounts of a robot with a fixed base lie in a region that the robot must keep out of.
    """
    *others, last = goal.stages if isinstance(goal, Stages) else (goal,)
    # a part that is held no longer than the tolerated time may be met while a limit is exceeded
    held = [part for part in others if part.hold_s > TOLERATED_S] + [last] * (goal.hold_s > TOLERATED_S)
    _refuse_stages([part for part in (*others, last) if isinstance(part, Touch)])
    _refuse_bringing(held, goal.limits)
    for limit in goal.limits:
        if isinstance(limit, ForceLimit):
            _refuse_touch(held, limit)
        elif isinstance(limit, KeepOut) and limit.center_m is not None:
            moved_m = float(np.linalg.norm(goal.vary_m))
            _refuse_points([point for part in held for point in part.reached], moved_m, limit, environment)
            _refuse_paths([(part, part in held) for part in (*others, last) if isinstance(part, Follow)], limit)
            _refuse_mounts(goal, limit, environment)


def _refuse_stages(touches: Sequence[Touch]) -> None:
    """Refuse a touch with more force than another stage allows at any moment, also before and after that stage."""
    for hard, soft in itertools.permutations(touches, 2):
        counted = hard.target == soft.target and soft.part in ("robot", hard.part)
        if counted and soft.at_most_n is not None and hard.force_n > soft.at_most_n:
            raise UserError(
                f"{hard.target} has to be touched with {hard.force_n:g} N, and another stage loses the episode beyond "
                f"{soft.at_most_n:g} N on it at any moment; ask for less, or raise or leave out that at_most_n"
            )


def _refuse_touch(parts: Sequence[Goal], limit: ForceLimit) -> None:
    for part in parts:
        if isinstance(part, Touch) and part.target == limit.on and part.force_n > limit.at_most_n:
            raise UserError(
                f"{part.target} has to be touched with {part.force_n:g} N, and the limit on it is {limit.at_most_n:g} "
                "N; ask for less, or allow more"
            )


def _depth_m(limit: KeepOut, point_m: tuple[float, ...]) -> float:
    """Return the depth of a point in a region [m], negative outside."""
    return float(_depths_m(limit, np.array([point_m]))[0])


def _depths_m(limit: KeepOut, points_m: FloatArray) -> FloatArray:
    """Return the depths of points in a region, negative outside, (n, 3) -> (n,) [m]."""
    return np.asarray(-limit.depth_m(points_m[None], np.array([limit.center_m]))[0])


def _refuse_points(
    points: Sequence[tuple[str, float]], moved_m: float, limit: KeepOut, environment: EnvironmentIndex
) -> None:
    for name, within_m in points if limit.what in (ROBOT, PART) else ():
        carriers = {site.name: site.body for site in environment.summary.sites}
        if environment.mechanism.carrying(carriers.get(name, name)):
            continue  # it can be moved out of the region
        point_m = environment.sites.get(name) or environment.body(name, "reach").position_m
        if _depth_m(limit, point_m) > within_m + moved_m:
            raise UserError(
                f"{name} cannot be reached: it and all within {within_m:g} m of it lie in {limit.words}, which the "
                "robot has to keep out of; make the region smaller, or name another target"
            )


def _refuse_paths(paths: Sequence[tuple[Follow, bool]], limit: KeepOut) -> None:
    """Refuse a path that leads through a region for too long.

    Args:
        paths: Paths, each with whether its end must be held for longer than the tolerated time.
        limit: Region to keep out of, with a fixed centre.
    """
    for path, is_held in paths:
        if limit.what not in ((path.target,) if path.target else (ROBOT, PART)):
            continue
        inside = _depths_m(limit, path.line_m) > path.within_m
        least_s = path.fewest_steps_near(inside) * Task.control_dt_s
        fault = ""
        if least_s > TOLERATED_S + ROUNDING_S:
            fault = "followed: too long a part of it, with all"
        elif is_held and inside[-1]:
            fault = "held at its end: that point and all"
        if fault:
            who = {ROBOT: "the robot", PART: "the functional part"}.get(limit.what, limit.what)
            raise UserError(
                f"the path cannot be {fault} within {path.within_m:g} m, lies in {limit.words}, which {who} has to "
                "keep out of; make the region smaller, or lead the path around it"
            )


def _refuse_bringing(parts: Sequence[Goal], limits: Sequence[AnyLimit]) -> None:
    """Refuse to bring bodies into a region that lies in one that too many of them must keep out of."""
    keep_outs = [limit for limit in limits if isinstance(limit, KeepOut)]
    for part in parts:
        if not isinstance(part, Bring) or part.count == "each":  # a moment in the region is tolerated
            continue
        shut = {one.what: one for one in keep_outs if one.what in part.targets and part.region.lies_in(one)}
        if len(part.targets) - len(shut) < part.needed:
            name, limit = next(iter(shut.items()))
            raise UserError(
                f"{name} cannot be brought into {part.region.words}: it lies in {limit.words}, which {name} has to "
                "keep out of; make that region smaller, or name another body or region"
            )


def _refuse_mounts(goal: Goal, limit: KeepOut, environment: EnvironmentIndex) -> None:
    mounts = environment.summary.mounts
    is_held = limit.what == ROBOT and goal.base == "fixed" and bool(mounts)
    if is_held and all(_depth_m(limit, mount.position_m) > 0.0 for mount in mounts):
        raise UserError(
            f'the robot cannot keep out of {limit.words}: every mount lies in it, and base is "fixed"; make the region '
            "smaller, or let the functional part alone keep out of it"
        )
