"""Distances between named sites, geoms and bodies of a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.core.errors import UserError
from aidsr.core.suggestions import closest_name
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.geom_distance import geom_distance_m
from aidsr.tasks.readings import FloatArray

_FAR_M = 10.0
"""Largest distance between surfaces that is measured. Our choice: larger than any built-in environment."""
_POINT_M = 1e-5
"""Radius of the sphere that represents a point."""
_OBJ = mujoco.mjtObj
_PLANE, _HEIGHT_FIELD = int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD)


@dataclass(frozen=True)
class Named:
    """A site, which is a point, or a geom, or the geoms of a body."""

    name: str
    site: int = -1
    geoms: tuple[int, ...] = ()


def find_named(model: mujoco.MjModel, name: str) -> Named:
    """Return the site, geom or body with a name, in this order of preference; "robot/" may be left out.

    Raises:
        UserError: There is no element of this name, or it is a body without geoms.
    """
    for full in (name, ROBOT_PREFIX + name):
        if (site := mujoco.mj_name2id(model, _OBJ.mjOBJ_SITE, full)) >= 0:
            shaped = any(mujoco.mj_name2id(model, kind, full) >= 0 for kind in (_OBJ.mjOBJ_GEOM, _OBJ.mjOBJ_BODY))
            return Named(f"{name} (site)" if shaped else name, site=site)
        if (geom := mujoco.mj_name2id(model, _OBJ.mjOBJ_GEOM, full)) >= 0:
            return Named(name, geoms=(geom,))
        if (body := mujoco.mj_name2id(model, _OBJ.mjOBJ_BODY, full)) >= 0:
            first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
            if not count:
                raise UserError(f'the body "{name}" has no shape of its own; name a site or another body')
            return Named(name, geoms=tuple(range(first, first + count)))
    known = [model.site(i).name for i in range(model.nsite)]
    known += [model.geom(i).name for i in range(model.ngeom)] + [model.body(i).name for i in range(model.nbody)]
    near = closest_name(name, [each.removeprefix(ROBOT_PREFIX) for each in known if each])
    sites = ", ".join(model.site(i).name for i in range(min(model.nsite, 20)) if model.site(i).name)
    raise UserError(f'no site, geom or body "{name}"; {f"did you mean {near}?" if near else f"sites: {sites}"}')


def find_pairs(model: mujoco.MjModel, pairs: Sequence[tuple[str, str]]) -> list[tuple[Named, Named]]:
    """Return the elements of pairs of names.

    Raises:
        UserError: A name is unknown, or belongs to a body without geoms, or both are planes or height fields.
    """
    found = [(find_named(model, first), find_named(model, second)) for first, second in pairs]
    for pair in found:
        if all(each.geoms and set(model.geom_type[list(each.geoms)]) <= {_PLANE, _HEIGHT_FIELD} for each in pair):
            named = " and ".join(f'"{each.name}"' for each in pair)
            raise UserError(f"no distance is measured between {named}: both are planes or height fields; name a body")
    return found


def distance_m(model: mujoco.MjModel, data: mujoco.MjData, first: Named, second: Named) -> float:
    """Return the distance between two points, a point and a surface, or two surfaces (negative inside) [m].

    A distance beyond `_FAR_M` is returned as `_FAR_M`. Source: `geom_distance_m`.

    Args:
        model: Compiled model.
        data: State after `mj_forward`.
        first: One of the two.
        second: The other.
    """
    if first.site >= 0 and second.site >= 0:
        return float(np.linalg.norm(data.site_xpos[first.site] - data.site_xpos[second.site]))
    if first.site >= 0 or second.site >= 0:
        point, shape = (first, second) if first.site >= 0 else (second, first)
        return _from_point_m(model, data, data.site_xpos[point.site], shape)
    return min(_between_m(model, data, one, other) for one in first.geoms for other in second.geoms)


def _between_m(model: mujoco.MjModel, data: mujoco.MjData, one: int, other: int) -> float:
    """Return the distance between the surfaces of two geoms, negative inside [m].

    For a geom that overlaps a height field `mj_geomDistance` of MuJoCo 3.17 returns a positive number that has nothing
    to do with the depth, so the deepest contact counts.
    """
    if _HEIGHT_FIELD in model.geom_type[[one, other]]:
        both = {one, other}
        depths = [float(each.dist) for each in data.contact[: data.ncon] if set(map(int, each.geom)) == both]
        if depths:
            return min(depths)
    return geom_distance_m(model, data, one, other, _FAR_M)


def _from_point_m(model: mujoco.MjModel, data: mujoco.MjData, point: FloatArray, shape: Named) -> float:
    """Return the distance of a point from the surface of geoms, negative inside [m].

    MuJoCo measures distances only between geoms, so another geom is temporarily turned into a small sphere at the
    point. Model and data are restored afterwards. Inside a height field the depth is measured along its z axis.

    Raises:
        UserError: The model has no other geom.
    """
    fields = (geom for geom in shape.geoms if model.geom_type[geom] == _HEIGHT_FIELD)
    if (depth_m := max((_depth_m(model, data, point, field) for field in fields), default=-1.0)) >= 0:
        return -depth_m
    lent = next((geom for geom in range(model.ngeom) if geom not in shape.geoms), None)
    if lent is None:
        raise UserError(f'cannot measure from a site to "{shape.name}": nothing else in the model has a shape')
    kept = int(model.geom_type[lent]), model.geom_size[lent].copy(), data.geom_xpos[lent].copy()
    try:
        model.geom_type[lent] = mujoco.mjtGeom.mjGEOM_SPHERE
        model.geom_size[lent], data.geom_xpos[lent] = _POINT_M, point
        return _POINT_M + min(
            float(mujoco.mj_geomDistance(model, data, lent, geom, _FAR_M, None)) for geom in shape.geoms
        )
    finally:
        model.geom_type[lent], model.geom_size[lent], data.geom_xpos[lent] = kept


def _depth_m(model: mujoco.MjModel, data: mujoco.MjData, point: FloatArray, field: int) -> float:
    """Return how far a point is below the surface of a height field, along the field's z axis; -1 above it [m]."""
    up = np.ascontiguousarray(data.geom_xmat[field].reshape(3, 3)[:, 2])
    return float(mujoco.mj_rayHfield(model, data, field, point, up, None))
