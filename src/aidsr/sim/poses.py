"""Poses other than the drawn one, in which hidden faults show."""

from __future__ import annotations

import mujoco
import numpy as np

from aidsr.sim.structure import Structure

_TURNING = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL))


def bent_pose(model: mujoco.MjModel, structure: Structure, bend_rad: float) -> mujoco.MjData:
    """Return data with every hinge and ball of the robot turned a little from the reference pose."""
    data = mujoco.MjData(model)
    turn = np.zeros(model.nv)
    inner = [joint for joint in structure.joints if int(model.jnt_type[joint]) in _TURNING]
    turn[[int(model.jnt_dofadr[joint]) for joint in inner]] = bend_rad
    mujoco.mj_integratePos(model, data.qpos, turn, 1.0)
    mujoco.mj_forward(model, data)
    return data
