"""The distance between two geoms, also where they just touch."""

from __future__ import annotations

import mujoco
import numpy as np

_SHIFT_M = 1e-6 * np.array([0.31, 0.53, 0.79])
"""Moves a geom off what it lies flush on. Our choice: less than any gap that matters, along no axis."""


def geom_distance_m(model: mujoco.MjModel, data: mujoco.MjData, one: int, other: int, farthest_m: float) -> float:
    """Return the least distance between the surfaces of two geoms, negative where they overlap [m].

    `mj_geomDistance` of MuJoCo 3.17 takes some boxes that lie flush on each other, cubes most of all, for as far apart
    as they are wide. A micrometre beside that place it is right, so of both answers the smaller one counts.

    Args:
        model: The model.
        data: Its state, whose geoms are where they should be; as before afterwards.
        one: Number of a geom.
        other: Number of another one.
        farthest_m: What is farther apart counts as so far apart [m].
    """
    found = float(mujoco.mj_geomDistance(model, data, one, other, farthest_m, None))
    if not 0 < found < farthest_m:
        return found
    place_m = data.geom_xpos[other].copy()
    data.geom_xpos[other] += _SHIFT_M
    beside = float(mujoco.mj_geomDistance(model, data, one, other, farthest_m, None))
    data.geom_xpos[other] = place_m
    return min(found, beside)
