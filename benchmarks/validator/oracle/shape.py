"""Extents of the geoms of a robot."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from benchmarks.validator.oracle.trace import Array


def corners(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Array:
    """Return the corners of the box around a geom, in the world, (8, 3) [m]."""
    box = model.geom_aabb[geom]
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return np.asarray(data.geom_xpos[geom] + (box[:3] + signs * box[3:]) @ data.geom_xmat[geom].reshape(3, 3).T)


def lowest_m(model: mujoco.MjModel) -> float:
    """Return the height of the lowest point of all geoms outside of the world body, in the drawn pose [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    lowest = math.inf
    for geom in range(model.ngeom):
        if model.geom_bodyid[geom]:
            points = corners(model, data, geom)
            kind, size = int(model.geom_type[geom]), model.geom_size[geom]
            if kind in (int(mujoco.mjtGeom.mjGEOM_SPHERE), int(mujoco.mjtGeom.mjGEOM_CAPSULE)):
                half = size[1] * abs(data.geom_xmat[geom][8]) if kind == int(mujoco.mjtGeom.mjGEOM_CAPSULE) else 0.0
                points = data.geom_xpos[geom][None] - np.array([0, 0, half + size[0]])
            lowest = min(lowest, float(points[:, 2].min()))
    return lowest
