"""Detection of diverged simulations, shared by the validator, the probe, training and the viewer.

A simulation has diverged when MuJoCo issued a warning, when its state is not finite, or when a body or joint exceeds a
speed limit. Which warnings count and which speeds are limited are parameters, because the callers differ on purpose:

    validator                  fatal warnings; speeds of the robot's bodies and joints
    episodes (probe, training) any warning, since a policy could learn to exploit it; speeds of all bodies
    viewer                     fatal warnings; no speed limit, since the user sees the motion
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from aidsr.sim.structure import Structure

if TYPE_CHECKING:
    from aidsr.sim.rollout import Recording

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

MAX_BODY_SPEED_M_S = 50.0
"""Speed of a body above which the simulation has diverged. Source: our choice, an order of magnitude above the speed of
anything that the tendons of these robots can throw."""

FULL_WARNINGS = [int(mujoco.mjtWarning.mjWARN_CONTACTFULL), int(mujoco.mjtWarning.mjWARN_CNSTRFULL)]
"""Warnings that MuJoCo's memory was too small for all contacts or constraints, so that it left some of them out."""
FATAL_WARNINGS = [
    *FULL_WARNINGS,
    int(mujoco.mjtWarning.mjWARN_INERTIA),
    int(mujoco.mjtWarning.mjWARN_BADQPOS),
    int(mujoco.mjtWarning.mjWARN_BADQVEL),
    int(mujoco.mjtWarning.mjWARN_BADQACC),
    int(mujoco.mjtWarning.mjWARN_BADCTRL),
]
"""Warnings after which the simulation results are meaningless.

Source: MuJoCo documentation, Simulation, "Diverging".
"""

_FREE, _SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)


@dataclass(frozen=True)
class DivergenceSign:
    """The first sign of divergence in a recorded simulation.

    Attributes:
        time_s: End of the frame in which it occurred [s].
        measured: Measured speed, None if the simulation failed although no speed was above its limit.
        limit: Largest allowed speed.
        unit: Unit of `measured` and `limit`, "m/s" or "rad/s".
        joint: Id of the joint with that speed, None if it is the speed of a body.
        body: Id of the body with that speed, None if it is the speed of a joint.
    """

    time_s: float
    measured: float | None = None
    limit: float | None = None
    unit: str = ""
    joint: int | None = None
    body: int | None = None


# --- the rule --------------------------------------------------------------------------------------------------------


def numbers_failed(warned: BoolArray, *fields: FloatArray) -> BoolArray:
    """Return which simulations have a relevant warning or a number that is not finite, (n,).

    Args:
        warned: Whether a relevant warning was issued, (n,).
        fields: Simulation fields such as positions and velocities, (n, ...).
    """
    finite = [np.isfinite(field).all(axis=tuple(range(1, field.ndim))) for field in fields]
    return np.asarray(warned | ~np.logical_and.reduce(finite))


def batch_diverged(batch: Batch, *, max_body_speed_m_s: float = MAX_BODY_SPEED_M_S) -> BoolArray:
    """Return which simulations of a batch have diverged so far, (n,); every warning counts."""
    failed = numbers_failed(batch.warning[:, :, 1].sum(axis=1) > 0, batch.bind("qpos"), batch.bind("qvel"))
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(failed | ~(max_body_speeds(batch) <= max_body_speed_m_s))


def recording_diverged(
    recording: Recording,
    model: mujoco.MjModel,
    robot: Structure,
    *,
    max_joint_speed_rad_s: float,
    max_body_speed_m_s: float,
) -> BoolArray:
    """Return which recorded simulations failed or have a body or joint of the robot that is too fast, (n_sims,)."""
    dofs, _, allowed = _dof_limits(model, robot, max_joint_speed_rad_s, max_body_speed_m_s)
    joints = (recording.fastest[:, :, dofs] > allowed).any(axis=(1, 2))
    bodies = (recording.speed_m_s[:, :, list(robot.bodies)] > max_body_speed_m_s).any(axis=(1, 2))
    return np.asarray(joints | bodies | np.array([bool(failure) for failure in recording.failures]))


def first_sign(
    recording: Recording,
    row: int,
    model: mujoco.MjModel,
    robot: Structure,
    *,
    max_joint_speed_rad_s: float,
    max_body_speed_m_s: float,
) -> DivergenceSign | None:
    """Return the first sign of divergence in a recorded simulation, None where `recording_diverged` finds none."""
    frame_s, bodies = recording.frame_s, list(robot.bodies)
    dofs, turning, allowed = _dof_limits(model, robot, max_joint_speed_rad_s, max_body_speed_m_s)
    of_joints = recording.fastest[row][:, dofs] / allowed if dofs.size else np.zeros((1, 1))
    of_bodies = recording.speed_m_s[row][:, bodies] / max_body_speed_m_s
    by_joint, by_body = (int(np.argmax((ratio > 1).any(axis=1))) for ratio in (of_joints, of_bodies))
    if (of_joints > 1).any() and (not (of_bodies > 1).any() or by_joint <= by_body):
        at = int(np.argmax(of_joints[by_joint]))
        return DivergenceSign(
            time_s=float(by_joint + 1) * frame_s,
            measured=float(recording.fastest[row, by_joint, dofs[at]]),
            limit=float(allowed[at]),
            unit="rad/s" if turning[at] else "m/s",
            joint=int(model.dof_jntid[dofs[at]]),
        )
    if (of_bodies > 1).any():
        body = bodies[int(np.argmax(of_bodies[by_body]))]
        measured = float(recording.speed_m_s[row, by_body, body])
        return DivergenceSign(float(by_body + 1) * frame_s, measured, max_body_speed_m_s, "m/s", body=body)
    if recording.failed(row):
        return DivergenceSign(float(recording.good_frames[row] + 1) * frame_s)
    return None


def _dof_limits(
    model: mujoco.MjModel, robot: Structure, max_joint_speed_rad_s: float, max_body_speed_m_s: float
) -> tuple[NDArray[np.int64], BoolArray, FloatArray]:
    """Return the robot's degrees of freedom, which of them are rotational, and the speed limit of each."""
    dofs = np.flatnonzero(np.isin(model.dof_jntid, robot.joints))
    joints = model.dof_jntid[dofs]
    kinds = model.jnt_type[joints]
    turning = np.where(kinds == _FREE, dofs - model.jnt_dofadr[joints] >= 3, kinds != _SLIDE)
    return dofs, turning, np.where(turning, max_joint_speed_rad_s, max_body_speed_m_s)


# --- speeds ----------------------------------------------------------------------------------------------------------


def max_body_speeds(batch: Batch) -> FloatArray:
    """Return the largest speed of any body's centre of mass in each simulation, (n,) [m/s]."""
    moving = (batch.bind(field) for field in ("cvel", "xipos", "subtree_com"))
    return np.asarray(body_speeds(batch.model.body_rootid, *moving).max(axis=1))


def body_speeds(roots: NDArray[np.integer], cvel: FloatArray, xipos: FloatArray, subtree_com: FloatArray) -> FloatArray:
    """Return the speeds of the bodies' centres of mass, (..., bodies) [m/s].

    Source: MuJoCo documentation, mjData.cvel: angular velocity, then the velocity of the body-fixed point that
    coincides with the centre of mass of the body's kinematic tree.

    Args:
        roots: `body_rootid` of the model, (bodies,).
        cvel: `cvel` of one or several simulations, (..., bodies, 6) [rad/s, m/s].
        xipos: `xipos` of the same simulations, (..., bodies, 3) [m].
        subtree_com: `subtree_com` of the same simulations, (..., bodies, 3) [m].
    """
    velocity = cvel[..., 3:] + np.cross(cvel[..., :3], xipos - subtree_com[..., roots, :])
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", velocity, velocity)))


@contextlib.contextmanager
def warnings_ignored() -> Iterator[None]:
    """Keep MuJoCo from writing warnings to MUJOCO_LOG.TXT in the working directory; it still counts them."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(_ignore)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _ignore(_message: str) -> None:
    """Ignore a warning: MuJoCo has already counted it."""
