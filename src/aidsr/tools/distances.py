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
        UserError: A name is unknown, or belongs to a body without geoms.
    """
    return [(find_named(model, first), find_named(model, second)) for first, second in pairs]


def distance_m(model: mujoco.MjModel, data: mujoco.MjData, first: Named, second: Named) -> float:
    """Return the distance between two points, a point and a surface, or two surfaces (negative inside) [m].

    Source: `geom_distance_m`.
    """
    if first.site >= 0 and second.site >= 0:
        return float(np.linalg.norm(data.site_xpos[first.site] - data.site_xpos[second.site]))
    if first.site >= 0 or second.site >= 0:
        point, shape = (first, second) if first.site >= 0 else (second, first)
        return _from_point_m(model, data, data.site_xpos[point.site], shape)
    least: float = min(
        geom_distance_m(model, data, one, other, _FAR_M) for one in first.geoms for other in second.geoms
    )
    return least


def _from_point_m(model: mujoco.MjModel, data: mujoco.MjData, point: FloatArray, shape: Named) -> float:
    """Return the distance of a point from the surface of geoms, negative inside [m].

    MuJoCo measures distances only between geoms, so another geom is temporarily turned into a small sphere at the
    point. Model and data are restored afterwards.

    Raises:
        UserError: The model has no other geom.
    """
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
