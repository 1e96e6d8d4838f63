"""Where a simulation stops being one, and which tests can still be trusted."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.rollout import Recording
from aidsr.validation.case import Case

__all__ = ["divergence", "sound", "sound_tests"]

_FREE, _SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)


def sound_tests(case: Case) -> tuple[int, ...]:
    """Return the rows of the battery without a sign of divergence: what a diverging test shows is its divergence."""
    battery = case.driven.battery
    return () if battery is None else tuple(np.flatnonzero(sound(case, battery)).tolist())


def sound(case: Case, recording: Recording) -> NDArray[np.bool_]:
    """Return which simulations have no sign of divergence, (n_sims,)."""
    dofs, bodies, (_, allowed) = _dofs(case), list(case.structure.bodies), _allowed(case)
    too_fast = (recording.fastest[:, :, dofs] > allowed).any(axis=(1, 2))
    too_far = (recording.speed_m_s[:, :, bodies] > case.limits.body_speed_m_s).any(axis=(1, 2))
    return ~(too_fast | too_far | np.array([bool(failure) for failure in recording.failures]))


def _dofs(case: Case) -> NDArray[np.int64]:
    return np.flatnonzero(np.isin(case.model.dof_jntid, case.structure.joints))


def _allowed(case: Case) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Which of the robot's degrees of freedom turn, and how fast each may be."""
    dofs = _dofs(case)
    joints = case.model.dof_jntid[dofs]
    kinds = case.model.jnt_type[joints]
    turning = np.where(kinds == _FREE, dofs - case.model.jnt_dofadr[joints] >= 3, kinds != _SLIDE)
    return turning, np.where(turning, case.limits.joint_speed_rad_s, case.limits.body_speed_m_s)


def divergence(
    case: Case, recording: Recording, row: int
) -> tuple[float | None, float | None, str, tuple[str, ...], float] | None:
    """Return (measured, limit, unit, names, time) of the first sign of divergence in a simulation, None without one."""
    limits, frame_s = case.limits, recording.frame_s
    dofs, bodies, (turning, allowed) = _dofs(case), list(case.structure.bodies), _allowed(case)
    too_fast = recording.fastest[row][:, dofs] / allowed if dofs.size else np.zeros((1, 1))
    too_far = recording.speed_m_s[row][:, bodies] / limits.body_speed_m_s
    by_joint, by_body = (np.argmax((ratio > 1).any(axis=1)) for ratio in (too_fast, too_far))
    if (too_fast > 1).any() and (not (too_far > 1).any() or by_joint <= by_body):
        dof = int(np.argmax(too_fast[by_joint]))
        measured, unit = float(recording.fastest[row, by_joint, dofs[dof]]), "rad/s" if turning[dof] else "m/s"
        joint = case.joint(int(case.model.dof_jntid[dofs[dof]]))
        return measured, float(allowed[dof]), unit, (joint,), float(by_joint + 1) * frame_s
    if (too_far > 1).any():
        body = int(np.argmax(too_far[by_body]))
        measured = float(recording.speed_m_s[row, by_body, bodies[body]])
        return measured, limits.body_speed_m_s, "m/s", (case.body(bodies[body]),), float(by_body + 1) * frame_s
    if recording.failed(row):
        return None, None, "", (), float(recording.good_frames[row] + 1) * frame_s
    return None
