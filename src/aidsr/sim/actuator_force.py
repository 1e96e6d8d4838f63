"""Force of an actuator: its force outputs, its gear, and its force as a function of command and length.

An actuator has one or more controls and one or more force outputs. Therefore, the arrays of MuJoCo have one row for
each actuator (gain, bias, `actuator_forcerange`), for each control (`ctrl`, `actuator_ctrlrange`), or for each force
output (`actuator_gear`, `actuator_length`, `actuator_force`).

Source: MuJoCo documentation, Computation, "Actuation model": force = gain * input + bias, affine in the length.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

_FIXED, _AFFINE = int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtGain.mjGAIN_AFFINE)
_NO_BIAS, _AFFINE_BIAS = int(mujoco.mjtBias.mjBIAS_NONE), int(mujoco.mjtBias.mjBIAS_AFFINE)
_INTEGRATOR = int(mujoco.mjtDyn.mjDYN_INTEGRATOR)


def output_of(model: mujoco.MjModel, actuator: int) -> int:
    """Return the index of an actuator's force output, the first one if it has several."""
    return int(model.actuator_outadr[actuator])


def control_of(model: mujoco.MjModel, actuator: int) -> int:
    """Return the index of an actuator's control in `ctrl`, the first one if it has several."""
    return int(model.actuator_ctrladr[actuator])


def gear_of(model: mujoco.MjModel, actuator: int) -> Vector:
    """Return the gear of an actuator, (6,); only the first number acts on a scalar joint or a tendon."""
    return np.asarray(model.actuator_gear[output_of(model, actuator)])


def affine_force(model: mujoco.MjModel, actuator: int, length: float) -> tuple[float, float] | None:
    """Return slope and offset of an actuator's force at rest: force before the gear = slope * command + offset.

    None if the force is not affine in the length, or if an integrator is between command and force.

    Args:
        model: Compiled model.
        actuator: Actuator id.
        length: Length of the actuator, as in `actuator_length`.
    """
    gain_type, bias_type = int(model.actuator_gaintype[actuator]), int(model.actuator_biastype[actuator])
    if gain_type not in (_FIXED, _AFFINE) or bias_type not in (_NO_BIAS, _AFFINE_BIAS):
        return None
    if int(model.actuator_dyntype[actuator]) == _INTEGRATOR:
        return None
    gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
    slope = gain[0] + (gain[1] * length if gain_type == _AFFINE else 0.0)
    offset = bias[0] + bias[1] * length if bias_type == _AFFINE_BIAS else 0.0
    return float(slope), float(offset)


def end_forces(model: mujoco.MjModel, actuator: int, length: float, low: float, high: float) -> list[float] | None:
    """Return the force of an actuator at rest at two commands, times its gear and within its force range.

    None for actuators without an affine force, see `affine_force`.

    Args:
        model: Compiled model.
        actuator: Actuator id.
        length: Length of the actuator, as in `actuator_length`.
        low: One command.
        high: The other command.
    """
    law = affine_force(model, actuator, length)
    if law is None:
        return None
    slope, offset = law
    forces = np.array([slope * low + offset, slope * high + offset])
    if model.actuator_forcelimited[actuator]:
        forces = np.clip(forces, *model.actuator_forcerange[actuator])
    return list(map(float, forces * gear_of(model, actuator)[0]))


def servo_target(model: mujoco.MjModel, actuator: int, command: float) -> float | None:
    """Return the length of a tendon or the position of a joint at which a servo exerts no force; None if no servo.

    Args:
        model: Compiled model.
        actuator: Actuator id.
        command: The command.

    Returns:
        The length [m], or the position of a joint [rad; m for a slide].
    """
    bias = model.actuator_biasprm[actuator]
    stiffness = -float(bias[1]) * float(gear_of(model, actuator)[0])
    servo = int(model.actuator_biastype[actuator]) == _AFFINE_BIAS
    if not servo or int(model.actuator_dyntype[actuator]) == _INTEGRATOR or stiffness == 0:
        return None
    return (float(model.actuator_gainprm[actuator, 0]) * command + float(bias[0])) / stiffness
