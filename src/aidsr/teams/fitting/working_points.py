"""The place at which a goal is worked at: of several equal sides of a target, the side that a robot reaches first."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Brief, GeomSummary, Vec3
from aidsr.sim.mechanism import JointFacts, read_mechanism
from aidsr.tasks.goals import Goal
from aidsr.tasks.goals.follow import Follow
from aidsr.tasks.goals.stages import Stages
from aidsr.tasks.goals.turn import Turn
from aidsr.teams.fitting.trial import is_in_the_way

Matrix = NDArray[np.float64]

_POINT_M = 0.01
"""Half size of a point to be reached [m]. Our choice: a fingertip."""
_LONG_ARM = 0.9
"""Share of the longest lever arm about a hinge from which an arm counts as equally good. Our choice."""
_INWARD = 0.2
"""Distance of the pushed point from an end towards the axis, as a share of the lever arm: a push there has a long arm
and does not slip off. Our choice."""
_ALIKE = 0.02
"""Relative difference up to which lengths of a shape count as equal, so that it is round about the third axis. Our
choice."""
_MOST_ASKED = 12
"""Maximum number of points for which obstacles are searched, the nearest first. Our choice."""


def worked_on(brief: Brief, goal: Goal) -> set[str]:
    """Return the names of the bodies that a goal is about, and of all bodies that they carry."""
    found = {name for name in goal.bodies if any(body.name == name for body in brief.summary.bodies)}
    for body in brief.summary.bodies:  # parents come first
        found |= {body.name} if body.parent in found and body.name else set()
    return found


def working_geom(brief: Brief, goal: Goal) -> GeomSummary:
    """Return the shape to work at, or a point as a small sphere.

    To turn something, it is a point near an end far from the hinge, else a shape of the target. Of several possible
    ones it is the one nearest to a mount without an obstacle in between.

    Args:
        brief: The job.
        goal: Goal resolved in its environment; a single one, not stages.
    """
    assert not isinstance(goal, Stages), "each stage has a place of its own"
    if isinstance(goal, Follow) and not goal.target:
        return _point(np.array(goal.path_m[0]))
    if goal.points:
        site = next((site for site in brief.summary.sites if site.name == goal.points[0]), None)
        body = next((body for body in brief.summary.bodies if body.name == goal.points[0]), None)
        return _point(np.array(site.position_m if site else body.position_m if body else (0.0, 0.0, 0.0)))
    names = worked_on(brief, goal)
    if goal.moves_bodies and not isinstance(goal, Turn) and len(goal.bodies) > 1:
        names = {goal.bodies[0]}
    geoms = [geom for body in brief.summary.bodies if body.name in names for geom in body.geoms if geom.solid]
    if isinstance(goal, Turn):
        joint = next(joint for joint in _joints(brief.environment) if joint.name == goal.joint)
        found = _far_ends(geoms, joint)
    else:
        found = [(geom, np.array(geom.position_m)) for geom in geoms]
    geom, point = found[_first(brief, [point for _, point in found], tuple(sorted(names)))]
    return _point(point, min(geom.size_m)) if isinstance(goal, Turn) else geom


def _far_ends(geoms: list[GeomSummary], joint: JointFacts) -> list[tuple[GeomSummary, Matrix]]:
    """Return the points at which shapes are pushed to turn a hinge: ends with a long arm, moved towards the axis."""
    anchor, axis = np.array(joint.anchor_m), np.array(joint.axis)
    ends = [(geom, end) for geom in geoms for end in _ends(geom, axis)]
    feet = [anchor + ((end - anchor) @ axis) * axis for _, end in ends]
    arms = [float(np.linalg.norm(end - foot)) for (_, end), foot in zip(ends, feet, strict=True)]
    return [
        (geom, end + _INWARD * (foot - end))
        for (geom, end), foot, arm in zip(ends, feet, arms, strict=True)
        if arm >= _LONG_ARM * max(arms)
    ]


def _first(brief: Brief, points: list[Matrix], names: tuple[str, ...]) -> int:
    """Return the index of the point nearest to a mount without an obstacle between; the nearest if all are hidden."""
    mounts = [np.array(mount.position_m) for mount in brief.summary.mounts] or [np.zeros(3)]
    nearest = [min(mounts, key=lambda mount: float(np.linalg.norm(point - mount))) for point in points]
    # rounded, so that equally far points stay in their order
    away = [round(float(np.linalg.norm(point - mount)), 6) for point, mount in zip(points, nearest, strict=True)]
    order = sorted(range(len(points)), key=lambda index: away[index])
    if len(points) == 1 or not brief.summary.mounts:
        return order[0]
    for index in order[:_MOST_ASKED]:
        if not _is_hidden(brief.environment, _vec3(nearest[index]), _vec3(points[index]), names):
            return index
    return order[0]


@lru_cache(maxsize=16)
def _joints(environment: str) -> tuple[JointFacts, ...]:
    return read_mechanism(environment).joints


@lru_cache(maxsize=256)
def _is_hidden(environment: str, start_m: Vec3, end_m: Vec3, names: tuple[str, ...]) -> bool:
    return is_in_the_way(environment, start_m, end_m, names)


def _ends(geom: GeomSummary, axis: Matrix) -> Iterator[Matrix]:
    """Yield the two ends of a shape along its longest axis; for a round shape eight points on its circumference.

    The circumference of a ball, or of a shape with three equal lengths, is taken about `axis`.
    """
    z, x = np.array(geom.z_axis), np.array(geom.x_axis)
    axes = np.stack([x, np.cross(z, x), z])
    size = list(geom.size_m)
    half = np.array([size[0]] * 3 if len(size) == 1 else [size[0], size[0], size[1]] if len(size) == 2 else size)
    longest = axes[half >= (1.0 - _ALIKE) * half.max()]
    if len(longest) == 1:
        ways = [-longest[0], longest[0]]
    else:
        if len(longest) == 3:
            longest = np.linalg.svd(axis[None])[2][1:]
        angles = np.arange(8) * np.pi / 4
        ways = list(np.stack([np.cos(angles), np.sin(angles)], axis=1) @ longest)
    for way in ways:
        yield np.array(geom.position_m) + half.max() * way


def _point(position: Matrix, half_m: float = _POINT_M) -> GeomSummary:
    return GeomSummary(name="", shape="sphere", size_m=(half_m,), position_m=_vec3(position))


def _vec3(values: Matrix) -> Vec3:
    x, y, z = (float(value) for value in values)
    return x, y, z
