"""The frame and the inertia of each body, which a viewer draws on request."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.apps.web.view3d.parts import Parts
from aidsr.sim.structure import name_of

Array = NDArray[np.float64]


def body_facts(model: mujoco.MjModel, parts: Parts) -> list[dict[str, Any]]:
    """Return mass, frame and inertia box of each body with a moving geom.

    All poses, as position (3) [m] and rotation matrix (9, by rows), are relative to a geom of the body, because a
    viewer knows the pose of that geom in every frame. The box has the body's mass and inertia, as MuJoCo's viewer draws
    it: with half sides a, b, c, its moment about the first axis is m / 3 (b^2 + c^2).
    """
    first: dict[int, int] = {}
    for part, geom in enumerate(parts.geoms):
        first.setdefault(int(model.geom_bodyid[geom]), part)
    return [_facts(model, body, part, int(parts.geoms[part])) for body, part in sorted(first.items())]


def _facts(model: mujoco.MjModel, body: int, part: int, geom: int) -> dict[str, Any]:
    turned = _matrix(model.geom_quat[geom]).T  # from the body's frame into the geom's
    where = -turned @ model.geom_pos[geom]
    mass, moments = float(model.body_mass[body]), model.body_inertia[body]
    squares = 1.5 / mass * (moments.sum() - 2 * moments) if mass > 0 else np.zeros(3)
    inertia = {
        "pose": _pose(where + turned @ model.body_ipos[body], turned @ _matrix(model.body_iquat[body])),
        "size": [round(float(number), 6) for number in np.sqrt(np.maximum(squares, 0.0))],
    }
    return {
        "name": name_of(model, mujoco.mjtObj.mjOBJ_BODY, body),
        "part": part,
        "mass_kg": round(mass, 7),
        "pose": _pose(where, turned),
        "inertia": inertia,
    }


def _matrix(quat: Sequence[float] | Array) -> Array:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.asarray(quat, float))
    return matrix.reshape(3, 3)


def _pose(where: Array, turned: Array) -> list[float]:
    return [round(float(number), 6) for number in np.concatenate([where, turned.ravel()])]
