"""Depths and volumes of MuJoCo's geometric primitives. Meshes and height fields are not supported."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SPHERE, _CAPSULE = int(mujoco.mjtGeom.mjGEOM_SPHERE), int(mujoco.mjtGeom.mjGEOM_CAPSULE)
_ELLIPSOID, _CYLINDER = int(mujoco.mjtGeom.mjGEOM_ELLIPSOID), int(mujoco.mjtGeom.mjGEOM_CYLINDER)
_BOX = int(mujoco.mjtGeom.mjGEOM_BOX)


def depth_m(model: mujoco.MjModel, data: mujoco.MjData, geom: int, points: Array) -> Array:
    """Return the depth of world points (n, 3) inside a geom, (n,) [m]; negative outside.

    The depth is exact inside spheres, capsules, cylinders and boxes, a lower bound inside ellipsoids, and -infinity for
    all other geoms.
    """
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    local = (points - data.geom_xpos[geom]) @ data.geom_xmat[geom].reshape(3, 3)
    if kind == _SPHERE:
        return np.asarray(size[0] - np.linalg.norm(local, axis=1))
    if kind == _CAPSULE:
        beyond = local - np.clip(local, [0, 0, -size[1]], [0, 0, size[1]])
        return np.asarray(size[0] - np.linalg.norm(beyond, axis=1))
    if kind == _CYLINDER:
        return np.asarray(np.minimum(size[0] - np.linalg.norm(local[:, :2], axis=1), size[1] - np.abs(local[:, 2])))
    if kind == _BOX:
        return np.asarray((size - np.abs(local)).min(axis=1))
    if kind == _ELLIPSOID:
        return np.asarray((1 - np.linalg.norm(local / size, axis=1)) * size.min())
    return np.full(len(points), -math.inf)


def volume_m3(model: mujoco.MjModel, geom: int) -> float | None:
    """Return the volume of a geom [m3], or None if it is not a primitive solid."""
    kind, (a, b, c) = int(model.geom_type[geom]), (float(size) for size in model.geom_size[geom])
    formulas = {
        _SPHERE: 4 / 3 * math.pi * a**3,
        _CAPSULE: math.pi * a**2 * 2 * b + 4 / 3 * math.pi * a**3,
        _CYLINDER: math.pi * a**2 * 2 * b,
        _ELLIPSOID: 4 / 3 * math.pi * a * b * c,
        _BOX: 8 * a * b * c,
    }
    return formulas.get(kind)
