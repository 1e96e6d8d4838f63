"""Where a simulation stops being one, and which can still be trusted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.rollout import Recording

if TYPE_CHECKING:
    from aidsr.validation.robot_under_test import RobotUnderTest

__all__ = ["divergence", "sound"]

_FREE, _SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)


def sound(robot: RobotUnderTest, recording: Recording) -> NDArray[np.bool_]:
    """Return which simulations have no sign of divergence, (n_sims,)."""
    (dofs, _, allowed), bodies = _allowed(robot), list(robot.structure.bodies)
    too_fast = (recording.fastest[:, :, dofs] > allowed).any(axis=(1, 2))
    too_far = (recording.speed_m_s[:, :, bodies] > robot.limits.body_speed_m_s).any(axis=(1, 2))
    return ~(too_fast | too_far | np.array([bool(failure) for failure in recording.failures]))


def _allowed(robot: RobotUnderTest) -> tuple[NDArray[np.int64], NDArray[np.bool_], NDArray[np.float64]]:
    """The robot's degrees of freedom, which of them turn, and how fast each may be."""
    dofs = np.flatnonzero(np.isin(robot.model.dof_jntid, robot.structure.joints))
    joints = robot.model.dof_jntid[dofs]
    kinds = robot.model.jnt_type[joints]
    turning = np.where(kinds == _FREE, dofs - robot.model.jnt_dofadr[joints] >= 3, kinds != _SLIDE)
    return dofs, turning, np.where(turning, robot.limits.joint_speed_rad_s, robot.limits.body_speed_m_s)


def divergence(
    robot: RobotUnderTest, recording: Recording, row: int
) -> tuple[float | None, float | None, str, tuple[str, ...], float] | None:
    """Return (measured, limit, unit, names, time) of the first sign of divergence in a simulation, None without one."""
    limits, frame_s = robot.limits, recording.frame_s
    (dofs, turning, allowed), bodies = _allowed(robot), list(robot.structure.bodies)
    too_fast = recording.fastest[row][:, dofs] / allowed if dofs.size else np.zeros((1, 1))
    too_far = recording.speed_m_s[row][:, bodies] / limits.body_speed_m_s
    by_joint, by_body = (np.argmax((ratio > 1).any(axis=1)) for ratio in (too_fast, too_far))
    if (too_fast > 1).any() and (not (too_far > 1).any() or by_joint <= by_body):
        dof = int(np.argmax(too_fast[by_joint]))
        measured, unit = float(recording.fastest[row, by_joint, dofs[dof]]), "rad/s" if turning[dof] else "m/s"
        joint = robot.joint(int(robot.model.dof_jntid[dofs[dof]]))
        return measured, float(allowed[dof]), unit, (joint,), float(by_joint + 1) * frame_s
    if (too_far > 1).any():
        body = int(np.argmax(too_far[by_body]))
        measured = float(recording.speed_m_s[row, by_body, bodies[body]])
        return measured, limits.body_speed_m_s, "m/s", (robot.body(bodies[body]),), float(by_body + 1) * frame_s
    if recording.failed(row):
        return None, None, "", (), float(recording.good_frames[row] + 1) * frame_s
    return None
