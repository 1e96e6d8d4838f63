"""Poses other than the reference pose, which reveal hidden faults. They satisfy the joint couplings of the model."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.couplings import follow, read_couplings
from aidsr.sim.structure import Structure

_HINGE, _BALL = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL)
_DOFS = {_HINGE: 1, _BALL: 3}
_OF_RANGE = 0.5
"""Largest share of a joint's range that random poses use. Our choice: keeps a distance from the limits."""


def bent_pose(model: mujoco.MjModel, structure: Structure, bend_rad: float) -> mujoco.MjData:
    """Return data with every hinge and ball of the robot rotated by `bend_rad` from the reference pose."""
    turn = np.zeros(model.nv)
    turn[[int(model.jnt_dofadr[joint]) for joint in _turning(model, structure)]] = bend_rad
    return _turned(model, turn)


def random_poses(model: mujoco.MjModel, structure: Structure, count: int, bend_rad: float) -> Iterator[mujoco.MjData]:
    """Yield data with every hinge and ball rotated at random from the reference pose; every call gives the same poses.

    Args:
        model: Compiled model.
        structure: The robot in the model.
        count: Number of poses.
        bend_rad: Largest rotation of a joint [rad]; smaller for a joint with a narrow range.
    """
    rng = np.random.default_rng(0)
    joints = _turning(model, structure)
    for _ in range(count):
        turn = np.zeros(model.nv)
        for joint in joints:
            first, size = int(model.jnt_dofadr[joint]), _DOFS[int(model.jnt_type[joint])]
            largest = min(bend_rad, _OF_RANGE * _room_rad(model, joint))
            turn[first : first + size] = rng.uniform(-largest, largest, size)
        yield _turned(model, turn)


def _turning(model: mujoco.MjModel, structure: Structure) -> list[int]:
    return [joint for joint in structure.joints if int(model.jnt_type[joint]) in _DOFS]


def _room_rad(model: mujoco.MjModel, joint: int) -> float:
    """Return how far a joint may rotate from the reference pose to the nearer of its limits [rad]."""
    if not model.jnt_limited[joint]:
        return float("inf")
    low, high = (float(end) for end in model.jnt_range[joint])
    if int(model.jnt_type[joint]) == _BALL:
        return high
    start = float(model.qpos0[model.jnt_qposadr[joint]])
    return max(0.0, min(start - low, high - start))


def _turned(model: mujoco.MjModel, turn: NDArray[np.float64]) -> mujoco.MjData:
    data = mujoco.MjData(model)
    mujoco.mj_integratePos(model, data.qpos, turn, 1.0)
    follow(model, read_couplings(model), data.qpos)
    mujoco.mj_forward(model, data)
    return data
