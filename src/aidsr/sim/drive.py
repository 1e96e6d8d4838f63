"""Characteristic commands of each actuator of the robot: range, neutral command, pulling and releasing."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.actuator_force import affine_force, control_of, held_activation, output_of
from aidsr.sim.structure import Structure

_FILTERS = (int(mujoco.mjtDyn.mjDYN_FILTER), int(mujoco.mjtDyn.mjDYN_FILTEREXACT))

UNLIMITED_END = 1.0
"""Largest command, in both directions, assumed for an actuator without a control range; the missing range is reported
as a separate fault. Our choice: the range that Gymnasium users expect."""


@dataclass(frozen=True)
class Drive:
    """Characteristic commands of one actuator.

    Attributes:
        actuator: Actuator id.
        ctrl: Index of its command in `ctrl`.
        on_tendon: Whether it acts on a tendon.
        low, high: Ends of its control range.
        ranged: Whether the model defines that range; otherwise its ends are assumed.
        neutral: Command with the smallest force in the given state of the robot.
        pull: End of the range that pulls a tendon hardest; the high end for an actuator that does not act on a tendon.
        release: The other end of the range.
        goes_slack: Whether its force is zero when released, however the robot moves.
        side: 1, or -1 for an actuator on a fixed tendon (a weighted sum of joint positions) that acts harder towards
            larger sums. A fixed tendon has no path to pull along, so its harder direction counts as pulling.
        force_low_n, force_high_n: `side` * force on the tendon or joint at the two ends of the range in the given state
            of the robot; positive pushes [N; N m on a rotational joint].
    """

    actuator: int
    ctrl: int
    on_tendon: bool
    low: float
    high: float
    ranged: bool
    neutral: float
    pull: float
    release: float
    goes_slack: bool
    side: int
    force_low_n: float
    force_high_n: float


def read_drives(model: mujoco.MjModel, data: mujoco.MjData, structure: Structure) -> tuple[Drive, ...]:
    """Return the characteristic commands of the robot's actuators in the pose of `data`, which is not changed."""
    low, high = _ends(model)
    probe = mujoco.MjData(model)
    probe.qpos[:] = data.qpos
    forces = [held_forces(model, probe, ctrl) for ctrl in (low, high)]
    neutral = neutral_ctrl(model, data)
    sums = {tendon.id for tendon in structure.tendons if not tendon.spatial}
    drives = []
    for actuator in structure.actuators:
        at = control_of(model, actuator)
        on_tendon = actuator in structure.tendon_actuators
        ends = float(forces[0][actuator]), float(forces[1][actuator])
        on_sum = on_tendon and int(model.actuator_trnid[actuator, 0]) in sums
        side = -1 if on_sum and max(ends) > -min(ends) else 1
        force_low, force_high = side * ends[0], side * ends[1]
        pulls_low = on_tendon and force_low < force_high
        drives.append(
            Drive(
                actuator=actuator,
                ctrl=at,
                on_tendon=on_tendon,
                low=float(low[at]),
                high=float(high[at]),
                ranged=bool(model.actuator_ctrllimited[at]),
                neutral=float(neutral[at]),
                pull=float(low[at] if pulls_low else high[at]),
                release=float(high[at] if pulls_low else low[at]),
                goes_slack=max(force_low, force_high) == 0 and not model.actuator_biasprm[actuator].any(),
                side=side,
                force_low_n=force_low,
                force_high_n=force_high,
            )
        )
    return tuple(drives)


def neutral_ctrl(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.float64]:
    """Return for every actuator the command within its range whose force is closest to zero in `data`, (nu,).

    The neutral command of a position servo holds its current position; the command 0 would pull a servo on a tendon
    towards zero length. Actuators with an integrator, and those of other kinds, get the command closest to 0.
    """
    low, high = _ends(model)
    neutral = np.clip(np.zeros(model.nu), low, high)
    for actuator in range(model.nactuator):
        law = affine_force(model, actuator, float(data.actuator_length[output_of(model, actuator)]))
        if law is not None and law[0] != 0:
            slope, offset = law
            at = control_of(model, actuator)
            neutral[at] = np.clip(-offset / slope, low[at], high[at])
    return neutral


def set_act(model: mujoco.MjModel, data: mujoco.MjData, ctrl: NDArray[np.float64]) -> None:
    """Set the activation of actuators with a filter to their command, so that they do not start from zero."""
    for actuator in range(model.nactuator):
        if int(model.actuator_dyntype[actuator]) in _FILTERS:
            data.act[int(model.actuator_actadr[actuator])] = ctrl[control_of(model, actuator)]


def _ends(model: mujoco.MjModel) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest and the highest command of each actuator, (nu,) each."""
    limited = np.asarray(model.actuator_ctrllimited, dtype=bool)
    ends = np.asarray(model.actuator_ctrlrange)
    low = np.where(limited, ends[:, 0], -UNLIMITED_END)
    high = np.where(limited, ends[:, 1], UNLIMITED_END)
    return low, high


def held_forces(model: mujoco.MjModel, probe: mujoco.MjData, ctrl: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return force times gear of every actuator once its command has been held for long, (nactuator,).

    Args:
        model: Compiled model.
        probe: Data whose pose is used; its command and activation are changed.
        ctrl: Command of every actuator, (nu,).
    """
    probe.ctrl[:] = ctrl
    for actuator in range(model.nactuator):
        first, count = int(model.actuator_actadr[actuator]), int(model.actuator_actnum[actuator])
        if count:
            command = float(ctrl[control_of(model, actuator)])
            probe.act[first : first + count] = held_activation(model, actuator, command)
    mujoco.mj_forward(model, probe)
    outputs = np.asarray(model.actuator_outadr)
    return np.asarray(probe.actuator_force[outputs] * model.actuator_gear[outputs, 0])
