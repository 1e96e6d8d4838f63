"""Where a simulation stops being one, and which tests can still be trusted."""

from __future__ import annotations

import mujoco
import numpy as np

from aidsr.sim.rollout import Recording
from aidsr.validation.case import Case

__all__ = ["divergence", "sound_tests"]

_FREE, _SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)


def sound_tests(case: Case) -> tuple[int, ...]:
    """Return the rows of the battery without a sign of divergence: what a diverging test shows is its divergence."""
    battery = case.driven.battery
    if battery is None:
        return ()
    return tuple(row for row in range(len(case.driven.tests)) if divergence(case, battery, row) is None)


def divergence(
    case: Case, recording: Recording, row: int
) -> tuple[float | None, float | None, str, tuple[str, ...], float] | None:
    """Return (measured, limit, unit, names, time) of the first sign of divergence in a simulation, None without one."""
    limits, frame_s = case.limits, recording.frame_s
    dofs = [dof for dof in range(case.model.nv) if int(case.model.dof_jntid[dof]) in case.structure.joints]
    bodies = list(case.structure.bodies)
    turning = np.array([_is_turning(case, dof) for dof in dofs], dtype=bool)
    allowed = np.where(turning, limits.joint_speed_rad_s, limits.body_speed_m_s)
    too_fast = recording.fastest[row][:, dofs] / allowed if dofs else np.zeros((1, 1))
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


def _is_turning(case: Case, dof: int) -> bool:
    joint = int(case.model.dof_jntid[dof])
    kind = int(case.model.jnt_type[joint])
    if kind == _FREE:
        return dof - int(case.model.jnt_dofadr[joint]) >= 3
    return kind != _SLIDE
