"""Distance between two geoms, with a workaround for geoms that touch with flush faces."""

from __future__ import annotations

import mujoco
import numpy as np

_SHIFT_M = 1e-6 * np.array([0.31, 0.53, 0.79])
"""Shift that separates flush faces. Our choice: less than any relevant gap, and parallel to no axis."""


def geom_distance_m(model: mujoco.MjModel, data: mujoco.MjData, one: int, other: int, farthest_m: float) -> float:
    """Return the smallest distance between the surfaces of two geoms [m], negative if they overlap.

    For some boxes that lie flush on each other, mostly cubes, `mj_geomDistance` of MuJoCo 3.17 returns their width as
    the distance. It is correct if one of them is shifted by a micrometre, so the smaller of the two results is used.

    Args:
        model: Compiled model.
        data: State with current geom poses; unchanged after the call.
        one: Id of the first geom.
        other: Id of the second geom.
        farthest_m: Largest distance that is measured [m]; a larger one is returned as this value.
    """
    found = float(mujoco.mj_geomDistance(model, data, one, other, farthest_m, None))
    if not 0 < found < farthest_m:
        return found
    place_m = data.geom_xpos[other].copy()
    data.geom_xpos[other] += _SHIFT_M
    beside = float(mujoco.mj_geomDistance(model, data, one, other, farthest_m, None))
    data.geom_xpos[other] = place_m
    return min(found, beside)
