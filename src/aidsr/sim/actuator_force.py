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
_INTEGRATOR, _MUSCLE = int(mujoco.mjtDyn.mjDYN_INTEGRATOR), int(mujoco.mjtDyn.mjDYN_MUSCLE)


def output_of(model: mujoco.MjModel, actuator: int) -> int:
    """Return the index of an actuator's force output, the first one if it has several."""
    return int(model.actuator_outadr[actuator])


def control_of(model: mujoco.MjModel, actuator: int) -> int:
    """Return the index of an actuator's control in `ctrl`, the first one if it has several."""
    return int(model.actuator_ctrladr[actuator])


def gear_of(model: mujoco.MjModel, actuator: int) -> Vector:
    """Return the gear of an actuator, (6,); only the first number acts on a scalar joint or a tendon."""
    return np.asarray(model.actuator_gear[output_of(model, actuator)])


def is_integrator(model: mujoco.MjModel, actuator: int) -> bool:
    """Return whether the command of an actuator is the rate at which its activation changes."""
    return int(model.actuator_dyntype[actuator]) == _INTEGRATOR


def held_activation(model: mujoco.MjModel, actuator: int, command: float) -> float:
    """Return the activation at which an actuator ends whose command is held for long, from an activation of 0.

    A filter ends at its command, a muscle within 0 to 1, and an integrator at that end of its activation range towards
    which the command drives it; an integrator without this range never ends, and its command is returned. For an
    actuator without activation it is the command itself.

    Source: MuJoCo documentation, Computation, "Actuation model", and XML reference, actuator/general/actlimited.

    Args:
        model: Compiled model.
        actuator: Actuator id.
        command: The command.
    """
    dynamics = int(model.actuator_dyntype[actuator])
    if dynamics == _MUSCLE:
        command = float(np.clip(command, 0.0, 1.0))
    if not model.actuator_actnum[actuator] or not model.actuator_actlimited[actuator]:
        return command
    low, high = map(float, model.actuator_actrange[actuator])
    if dynamics == _INTEGRATOR and command:
        return high if command > 0 else low
    return float(np.clip(command, low, high))


def affine_force(model: mujoco.MjModel, actuator: int, length: float) -> tuple[float, float] | None:
    """Return slope and offset of an actuator's force at rest: force before the gear = slope * command + offset.

    None if the force is not affine in the length, or if an integrator is between command and force.

    Args:
        model: Compiled model.
        actuator: Actuator id.
        length: Length of the actuator, as in `actuator_length`.
    """
    return None if is_integrator(model, actuator) else _affine(model, actuator, length)


def _affine(model: mujoco.MjModel, actuator: int, length: float) -> tuple[float, float] | None:
    """Return slope and offset of an actuator's force over its input, which is its activation if it has one."""
    gain_type, bias_type = int(model.actuator_gaintype[actuator]), int(model.actuator_biastype[actuator])
    if gain_type not in (_FIXED, _AFFINE) or bias_type not in (_NO_BIAS, _AFFINE_BIAS):
        return None
    gain, bias = model.actuator_gainprm[actuator], model.actuator_biasprm[actuator]
    slope = gain[0] + (gain[1] * length if gain_type == _AFFINE else 0.0)
    offset = bias[0] + bias[1] * length if bias_type == _AFFINE_BIAS else 0.0
    return float(slope), float(offset)


def end_forces(model: mujoco.MjModel, actuator: int, length: float, low: float, high: float) -> list[float] | None:
    """Return the force of an actuator at rest with two commands held, times its gear and within its force range.

    None for actuators whose force is not affine in their length and their input.

    Args:
        model: Compiled model.
        actuator: Actuator id.
        length: Length of the actuator, as in `actuator_length`.
        low: One command.
        high: The other command.
    """
    law = _affine(model, actuator, length)
    if law is None:
        return None
    slope, offset = law
    forces = np.array([slope * held_activation(model, actuator, command) + offset for command in (low, high)])
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
    if not servo or is_integrator(model, actuator) or stiffness == 0:
        return None
    return (float(model.actuator_gainprm[actuator, 0]) * command + float(bias[0])) / stiffness
