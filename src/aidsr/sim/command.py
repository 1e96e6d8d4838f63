"""Physical meaning of an actuator's command: position, speed or force, and its unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np

from aidsr.sim.actuator_force import gear_of

_TRANSMISSION, _DYNAMICS, _JOINT = mujoco.mjtTrn, mujoco.mjtDyn, mujoco.mjtJoint
_PLAIN = (_DYNAMICS.mjDYN_NONE, _DYNAMICS.mjDYN_FILTER, _DYNAMICS.mjDYN_FILTEREXACT)
"""Actuator dynamics with which the input of the gain equals the command or converges to it."""
_ON_JOINT = (_TRANSMISSION.mjTRN_JOINT, _TRANSMISSION.mjTRN_JOINTINPARENT)
_LENGTH, _ANGLE = ("m", "N"), ("rad", "N m")
"""Unit of position and unit of force."""


@dataclass(frozen=True)
class Command:
    """Physical meaning of a command.

    Attributes:
        kind: Commanded quantity. A torque counts as a force.
        unit: SI unit of the quantity: m, rad, m/s, rad/s, N or N m.
        factor: Factor that converts a command to that unit; it differs from 1 if there is a gear or a gain.
    """

    kind: Literal["position", "speed", "force"]
    unit: str
    factor: float


def command_of(model: mujoco.MjModel, actuator: int) -> Command | None:
    """Return the meaning of an actuator's command, None if it is not known.

    Known are `position`, `velocity`, `intvelocity` and `motor`, and `general` actuators equivalent to one of them, on
    hinges, slides and spatial tendons, and forces or torques at sites. The unit of a fixed tendon depends on its
    coefficients and is not known.

    Source: MuJoCo XML reference, actuator/position, velocity, intvelocity and motor.
    """
    gain, bias = float(model.actuator_gainprm[actuator, 0]), model.actuator_biasprm[actuator, :3]
    bias_type, dynamics = int(model.actuator_biastype[actuator]), int(model.actuator_dyntype[actuator])
    if int(model.actuator_gaintype[actuator]) != mujoco.mjtGain.mjGAIN_FIXED or not gain:
        return None
    if bias_type not in (mujoco.mjtBias.mjBIAS_NONE, mujoco.mjtBias.mjBIAS_AFFINE):
        return None
    offset, position, speed = bias if bias_type == mujoco.mjtBias.mjBIAS_AFFINE else (0.0, 0.0, 0.0)
    acted_on = _acted_on(model, actuator)
    if acted_on is None or offset:
        return None
    (position_unit, force), gear = acted_on
    servo = position_unit and np.isclose(position, -gain)
    if servo and dynamics == _DYNAMICS.mjDYN_INTEGRATOR:
        return Command("speed", f"{position_unit}/s", 1.0 / gear)
    if dynamics not in _PLAIN:
        return None
    if servo:
        return Command("position", position_unit, 1.0 / gear)
    if position_unit and not position and np.isclose(speed, -gain):
        return Command("speed", f"{position_unit}/s", 1.0 / gear)
    return None if position or speed else Command("force", force, gain * gear)


def exerted(model: mujoco.MjModel, actuator: int) -> tuple[float, str]:
    """Return what an actuator exerts per unit of `actuator_force`, as an absolute value, and its unit: N or N m.

    It is a torque on a hinge or a ball, and at a site or a free joint without a force. For a fixed tendon N is stated:
    its coefficients are taken as moment arms [m]. Source: MuJoCo XML reference, actuator/general/gear.
    """
    kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
    gear = gear_of(model, actuator)
    joint = int(model.jnt_type[target]) if kind in _ON_JOINT else -1
    force, torque = float(np.linalg.norm(gear[:3])), float(np.linalg.norm(gear[3:]))
    if joint == _JOINT.mjJNT_FREE or kind == _TRANSMISSION.mjTRN_SITE:
        return (force, "N") if force else (torque, "N m")
    if joint == _JOINT.mjJNT_BALL:
        return force, "N m"
    return abs(float(gear[0])), "N m" if joint == _JOINT.mjJNT_HINGE else "N"


def is_spatial(model: mujoco.MjModel, tendon: int) -> bool:
    """Return whether a tendon is spatial (has a path); a fixed tendon is a weighted sum of joint positions."""
    return bool(model.wrap_type[model.tendon_adr[tendon]] != mujoco.mjtWrap.mjWRAP_JOINT)


def _acted_on(model: mujoco.MjModel, actuator: int) -> tuple[tuple[str, str], float] | None:
    """Return the units of position and of force of an actuator's transmission, and its gear; None if not known.

    The unit of position is empty for a site, which has no position coordinate.
    """
    kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
    gear = gear_of(model, actuator)
    units = None
    if kind == _TRANSMISSION.mjTRN_TENDON:
        units = _LENGTH if is_spatial(model, target) else None
    elif kind in _ON_JOINT:
        units = {int(_JOINT.mjJNT_SLIDE): _LENGTH, int(_JOINT.mjJNT_HINGE): _ANGLE}.get(int(model.jnt_type[target]))
    elif kind == _TRANSMISSION.mjTRN_SITE and gear[:3].any() != gear[3:].any():
        return ("", "N" if gear[:3].any() else "N m"), float(np.linalg.norm(gear))
    return (units, float(gear[0])) if units and gear[0] else None
