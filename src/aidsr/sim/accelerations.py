"""Accelerations of bodies at constant joint speeds, such as the centripetal acceleration of a rotating body."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def turning_accelerations(model: mujoco.MjModel, qpos: Array, qvel: Array) -> Array:
    """Return the magnitude of each body's centre-of-mass acceleration at constant joint speeds, (n, nbody) [m/s2].

    Args:
        model: Compiled model.
        qpos: Joint positions, (n, nq).
        qvel: Joint velocities, (n, nv).

    Source: the acceleration of a point is J a + dJ/dt v; with joint accelerations a = 0 only the second term remains.
    MuJoCo documentation, `mj_rnePostConstraint`: `cacc` refers to the centre of mass of the whole kinematic tree and
    contains gravity as an upward acceleration.
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
