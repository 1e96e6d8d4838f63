"""What the command of an actuator means: a position, a speed or a force, and in which unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np

_TRANSMISSION, _DYNAMICS, _JOINT = mujoco.mjtTrn, mujoco.mjtDyn, mujoco.mjtJoint
_PLAIN = (_DYNAMICS.mjDYN_NONE, _DYNAMICS.mjDYN_FILTER, _DYNAMICS.mjDYN_FILTEREXACT)
"""Dynamics under which an actuator comes to what it is commanded."""
_LENGTH, _ANGLE = ("m", "N"), ("rad", "N m")


@dataclass(frozen=True)
class Command:
    """What a command means.

    Attributes:
        kind: What is commanded. A torque is a force here.
        unit: Its SI unit: m, rad, m/s, rad/s, N or N m.
        factor: By which a command is multiplied to be in that unit; not 1 where a gear or a gain stands between.
    """

    kind: Literal["position", "speed", "force"]
    unit: str
    factor: float


def command_of(model: mujoco.MjModel, actuator: int) -> Command | None:
    """Return what the command of an actuator means, None where that is none of MuJoCo's shortcuts.

    Known are `position`, `velocity`, `intvelocity` and `motor`, also written as `general`, on hinges, slides and
    spatial tendons, and forces or torques at sites. The unit of a fixed tendon depends on its coefficients and is not
    known.

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
    (way, force), gear = acted_on
    servo = way and np.isclose(position, -gain)
    if servo and dynamics == _DYNAMICS.mjDYN_INTEGRATOR:
        return Command("speed", f"{way}/s", 1.0 / gear)
    if dynamics not in _PLAIN:
        return None
    if servo:
        return Command("position", way, 1.0 / gear)
    if way and not position and np.isclose(speed, -gain):
        return Command("speed", f"{way}/s", 1.0 / gear)
    return None if position or speed else Command("force", force, gain * gear)


def is_spatial(model: mujoco.MjModel, tendon: int) -> bool:
    """Return whether a tendon has a path; else it is fixed, a weighted sum of joint positions."""
    return bool(model.wrap_type[model.tendon_adr[tendon]] != mujoco.mjtWrap.mjWRAP_JOINT)


def _acted_on(model: mujoco.MjModel, actuator: int) -> tuple[tuple[str, str], float] | None:
    """Return the units of the way and of the force of what an actuator acts on, and its gear; None where not known.

    A site has no way of its own: its unit is empty.
    """
    kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
    gear = model.actuator_gear[actuator]
    units = None
    if kind == _TRANSMISSION.mjTRN_TENDON:
        units = _LENGTH if is_spatial(model, target) else None
    elif kind in (_TRANSMISSION.mjTRN_JOINT, _TRANSMISSION.mjTRN_JOINTINPARENT):
        units = {int(_JOINT.mjJNT_SLIDE): _LENGTH, int(_JOINT.mjJNT_HINGE): _ANGLE}.get(int(model.jnt_type[target]))
    elif kind == _TRANSMISSION.mjTRN_SITE and gear[:3].any() != gear[3:].any():
        return ("", "N" if gear[:3].any() else "N m"), float(np.linalg.norm(gear))
    return (units, float(gear[0])) if units and gear[0] else None
