"""Checks for points that must be reached but lie inside a solid shape, where no functional part can go."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import mujoco
import numpy as np

from aidsr.core.artifacts import Artifact
from aidsr.core.errors import UserError
from aidsr.mjcf.compile import load_mjcf
from aidsr.sandbox.isolated import isolated
from aidsr.tasks.goals.unattended import name_of_shape

_RADIUS_M = 1e-4
"""Radius of the sphere that stands for a point [m]."""
_SLACK_M = 0.001
"""Depth beyond the tolerance that is ignored [m]. Our choice: contacts yield by this much."""
_GRASPED_M = 0.04
"""Further depth that is ignored in a movable shape [m]: a hand that closes around it has its working point in the
middle. Our choice: objects up to 80 mm thick are grasped."""


class Buried(Artifact):
    """A point inside a solid shape, to which it is rigidly connected."""

    point: str
    geom: str
    """Name of the shape, or of its body if the shape has none."""
    depth_m: float
    """Distance from the surface of the shape [m]."""
    movable: bool
    """Whether the shape can move, and the point with it."""


def refuse_buried(mjcf: str, points: Sequence[tuple[str, float]]) -> None:
    """Refuse points that lie so deep in a solid shape that its surface is not within their tolerance.

    Only shapes that are rigidly connected to the point count: others may be moved out of the way.

    Args:
        mjcf: MJCF of the environment.
        points: Names of sites, or else of bodies (their origin), each with its tolerance [m].

    Raises:
        UserError: A point lies too deep.
        MjcfError: The environment cannot be loaded.
        IsolationError: The measurement exceeded the limits of its child process.
    """
    if not points:
        return
    buried = {found.point: found for found in _find_buried(mjcf, tuple(name for name, _ in points))}
    for name, near_m in points:
        if name not in buried:
            continue
        depth_m = buried[name].depth_m
        if depth_m > near_m + _SLACK_M + _GRASPED_M * buried[name].movable:
            raise UserError(
                f'"{name}" cannot be reached: it lies {1000 * depth_m:.3g} mm inside of {buried[name].geom}, which is '
                f"solid, and within_m is {near_m:g}; put it at the surface, ask for `touch`, or for within_m of more "
                f"than {depth_m:.2g}"
            )


def refuse_buried_corners(mjcf: str, corners_m: Sequence[tuple[tuple[float, ...], float]]) -> None:
    """Refuse corners of a path that lie deeper in a shape fixed to the world than their tolerance.

    Args:
        mjcf: MJCF of the environment.
        corners_m: Points in world coordinates, each with its tolerance [m].

    Raises:
        UserError: A corner lies too deep.
        MjcfError: The environment cannot be loaded.
        IsolationError: The measurement exceeded the limits of its child process.
    """
    if not corners_m:
        return
    buried = {found.point: found for found in _find_buried_corners(mjcf, tuple(point for point, _ in corners_m))}
    for point, near_m in corners_m:
        found = buried.get(_words(point))
        if found is not None and found.depth_m > near_m + _SLACK_M:
            raise UserError(
                f"the path cannot be followed: its point {found.point} m lies {1000 * found.depth_m:.3g} mm inside of "
                f"{found.geom}, which is solid, and within_m is {near_m:g}; put it at the surface, or ask for within_m "
                f"of more than {found.depth_m:.2g}"
            )


def _words(point_m: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{each:g}" for each in point_m) + ")"


@lru_cache(maxsize=16)
def _find_buried_corners(mjcf: str, corners_m: tuple[tuple[float, ...], ...]) -> tuple[Buried, ...]:
    return _measure_corners(mjcf, corners_m)


@lru_cache(maxsize=16)
def _find_buried(mjcf: str, points: tuple[str, ...]) -> tuple[Buried, ...]:
    return _measure(mjcf, points)


@isolated
def _measure(mjcf: str, points: tuple[str, ...]) -> tuple[Buried, ...]:
    """Return the solid shape in which each point lies deepest; points that lie in none are left out."""
    model, data, probe = _with_probe(mjcf)
    found = []
    for name in points:
        site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
        body = int(model.site_bodyid[site]) if site >= 0 else model.body(name).id
        data.geom_xpos[probe] = data.site_xpos[site] if site >= 0 else data.xpos[body]
        found.append(_deepest(model, data, probe, name, int(model.body_weldid[body])))
    return tuple(each for each in found if each is not None)


@isolated
def _measure_corners(mjcf: str, corners_m: tuple[tuple[float, ...], ...]) -> tuple[Buried, ...]:
    """Return the solid, fixed shape in which each world point lies deepest; points that lie in none are left out."""
    model, data, probe = _with_probe(mjcf)
    found = []
    for point_m in corners_m:
        data.geom_xpos[probe] = point_m
        found.append(_deepest(model, data, probe, _words(point_m), 0))
    return tuple(each for each in found if each is not None)


def _with_probe(mjcf: str) -> tuple[mujoco.MjModel, mujoco.MjData, int]:
    """Return an environment with a small sphere that collides with nothing, and the sphere's geom id."""
    spec = load_mjcf(mjcf).spec
    sphere = mujoco.mjtGeom.mjGEOM_SPHERE
    probe = spec.worldbody.add_geom(type=sphere, size=[_RADIUS_M] * 3, contype=0, conaffinity=0)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data, probe.id


def _deepest(model: mujoco.MjModel, data: mujoco.MjData, probe: int, point: str, weld: int) -> Buried | None:
    """Return the depth of the sphere in the shapes welded to a body (0 is the world); None if it lies in none."""
    depths_m = {
        geom: -_RADIUS_M - mujoco.mj_geomDistance(model, data, probe, geom, 0.0, None)
        for geom in _solid(model)
        if model.body_weldid[model.geom_bodyid[geom]] == weld
    }
    deepest = max(depths_m, key=lambda geom: depths_m[geom], default=None)
    if deepest is None or depths_m[deepest] <= 0.0:
        return None
    label = name_of_shape(model, deepest)
    return Buried(point=point, geom=label, depth_m=float(depths_m[deepest]), movable=bool(weld))


def _solid(model: mujoco.MjModel) -> list[int]:
    """Return the geoms that a robot can touch, except height fields, which have no inside that could be measured."""
    solid = (model.geom_contype | model.geom_conaffinity) != 0
    return np.flatnonzero(solid & (model.geom_type != mujoco.mjtGeom.mjGEOM_HFIELD)).tolist()
