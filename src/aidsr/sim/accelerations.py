"""Accelerations that a motion needs although no speed changes: those towards the centre of what turns."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def turning_accelerations(model: mujoco.MjModel, qpos: Array, qvel: Array) -> Array:
    """Return the acceleration of each body's centre of mass if every joint kept its speed, (n, nbody) [m/s2].

    Args:
        model: The model.
        qpos: Positions, (n, nq).
        qvel: Velocities, (n, nv).

    Source: the acceleration of a point is J a + dJ/dt v; with the joints' accelerations a = 0 the second term is left.
    MuJoCo documentation, `mj_rnePostConstraint`: `cacc` is about the centre of mass of the whole tree and holds
    gravity as an acceleration upwards.
    """
    data, found = mujoco.MjData(model), np.zeros((len(qpos), model.nbody))
    acceleration = np.zeros(6)
    for k, (position, velocity) in enumerate(zip(qpos, qvel, strict=True)):
        data.qpos[:], data.qvel[:] = position, velocity
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        data.qacc[:] = 0
        mujoco.mj_rnePostConstraint(model, data)
        for body in range(1, model.nbody):
            mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_BODY, body, acceleration, 0)
            found[k, body] = np.linalg.norm(acceleration[3:] + model.opt.gravity)
    return found
