"""How actuators scale: what their input, gain and bias measure.

A position servo's input is a coordinate of its transmission and a velocity servo's a rate of it; both scale as such.
Every other input keeps its numbers, and the gain carries the force. So a policy that pulls a tendon halfway pulls it
halfway after scaling, whatever the kind of actuator.

Source: MuJoCo XML reference, actuator/general and its shortcuts; force = gain(length, velocity) x input + bias.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from aidsr.sim.unit_scaling import Coordinate, Units

_TRN, _GAIN, _BIAS, _DYN = mujoco.mjtTrn, mujoco.mjtGain, mujoco.mjtBias, mujoco.mjtDyn
_GAINS = (_GAIN.mjGAIN_FIXED, _GAIN.mjGAIN_AFFINE, _GAIN.mjGAIN_MUSCLE)
_BIASES = (_BIAS.mjBIAS_NONE, _BIAS.mjBIAS_AFFINE, _BIAS.mjBIAS_MUSCLE)
_DYNAMICS = (_DYN.mjDYN_NONE, _DYN.mjDYN_INTEGRATOR, _DYN.mjDYN_FILTER, _DYN.mjDYN_FILTEREXACT, _DYN.mjDYN_MUSCLE)
_TRANSMISSIONS = (
    _TRN.mjTRN_JOINT,
    _TRN.mjTRN_JOINTINPARENT,
    _TRN.mjTRN_SLIDERCRANK,
    _TRN.mjTRN_TENDON,
    _TRN.mjTRN_SITE,
    _TRN.mjTRN_BODY,
)


def has_scaling_rule(actuator: Any) -> bool:
    """Return whether `scale_actuator` knows this kind; electrical motors are not matter that could be scaled."""
    return (
        actuator.gaintype in _GAINS
        and actuator.biastype in _BIASES
        and actuator.dyntype in _DYNAMICS
        and actuator.trntype in _TRANSMISSIONS
    )


def actuator_coordinate(actuator: Any, coordinates: Mapping[tuple[str, str], Coordinate], units: Units) -> Coordinate:
    """Return the coordinate an actuator's transmission moves.

    Args:
        actuator: The actuator.
        coordinates: Those of the model's joints and tendons.
        units: The change of units.
    """
    if actuator.trntype == _TRN.mjTRN_TENDON:
        return coordinates["tendon", actuator.target]
    if actuator.trntype in (_TRN.mjTRN_JOINT, _TRN.mjTRN_JOINTINPARENT):
        return coordinates["joint", actuator.target]
    if actuator.trntype == _TRN.mjTRN_SITE:
        return Coordinate(units, is_length=bool(np.any(actuator.gear[:3])))
    return Coordinate(units, is_length=True)


def scale_actuator(actuator: Any, coordinate: Coordinate) -> None:
    """Multiply an actuator's attributes by what their units say, in place."""
    units = coordinate.units
    if coordinate.is_length:
        # Forces and torques share the six gears of a site or free joint: torques are forces on longer arms.
        actuator.gear = actuator.gear * np.repeat([1.0, units.length], 3)
    activation = _input_factor(actuator, coordinate)
    control = activation / units.time if actuator.dyntype == _DYN.mjDYN_INTEGRATOR else activation
    actuator.ctrlrange = actuator.ctrlrange * control
    actuator.actrange = actuator.actrange * activation
    actuator.forcerange = actuator.forcerange * coordinate.force
    actuator.lengthrange = actuator.lengthrange * coordinate.value()
    actuator.cranklength = actuator.cranklength * units.length
    actuator.delay = actuator.delay * units.time
    actuator.damping = actuator.damping * np.array(coordinate.damping)
    actuator.armature = actuator.armature * coordinate.inertia
    actuator.dynprm = actuator.dynprm * _dynamics_factors(actuator, units)
    bias = actuator.biasprm * _bias_factors(actuator, coordinate)
    gain = actuator.gainprm * _gain_factors(actuator, coordinate, activation)
    if _is_position_servo(actuator):
        bias[1] = -gain[0]  # MuJoCo recognises a position servo by their being equal to the last bit
        if bias[2] > 0:
            bias[2] = actuator.biasprm[2]  # and then reads a positive third number as a damping ratio
    actuator.gainprm, actuator.biasprm = gain, bias


def _is_position_servo(actuator: Any) -> bool:
    affine = actuator.gaintype == _GAIN.mjGAIN_FIXED and actuator.biastype == _BIAS.mjBIAS_AFFINE
    return bool(affine and actuator.biasprm[1] == -actuator.gainprm[0] != 0)


def _is_velocity_servo(actuator: Any) -> bool:
    affine = actuator.gaintype == _GAIN.mjGAIN_FIXED and actuator.biastype == _BIAS.mjBIAS_AFFINE
    same = np.isclose(actuator.biasprm[2], -actuator.gainprm[0], rtol=1e-9, atol=0)
    return bool(affine and same and actuator.biasprm[1] == 0 != actuator.gainprm[0])


def _input_factor(actuator: Any, coordinate: Coordinate) -> float:
    """Return the factor on what the gain multiplies: the activation, or the control where there is none."""
    if _is_position_servo(actuator):
        return coordinate.value()
    if _is_velocity_servo(actuator):
        return coordinate.value(time=-1)
    return 1.0


def _dynamics_factors(actuator: Any, units: Units) -> np.ndarray:
    factors = np.ones(len(actuator.dynprm))
    if actuator.dyntype in (_DYN.mjDYN_FILTER, _DYN.mjDYN_FILTEREXACT):
        factors[0] = units.time
    elif actuator.dyntype == _DYN.mjDYN_MUSCLE:
        factors[:2] = units.time
    return factors


def _affine_factors(coordinate: Coordinate) -> list[float]:
    """Return the factors on force, force per coordinate and force per rate of it."""
    force = coordinate.force
    return [force, force * coordinate.value(-1), force * coordinate.value(-1, time=1)]


def _muscle_factors(actuator: Any, coordinate: Coordinate) -> list[float]:
    """Return the factors on range (2), force, scale, lmin, lmax, vmax, fpmax, fvmax."""
    # A negative force asks the compiler for scale / acc0, where scale is an angular acceleration.
    force = coordinate.force if actuator.gainprm[2] >= 0 else 1.0
    per_time = coordinate.units.of(time=-1)
    return [1.0, 1.0, force, per_time**2, 1.0, 1.0, per_time, 1.0, 1.0]


def _gain_factors(actuator: Any, coordinate: Coordinate, activation: float) -> np.ndarray:
    factors = np.ones(len(actuator.gainprm))
    if actuator.gaintype == _GAIN.mjGAIN_MUSCLE:
        factors[:9] = _muscle_factors(actuator, coordinate)
    else:
        factors[:3] = np.array(_affine_factors(coordinate)) / activation
    return factors


def _bias_factors(actuator: Any, coordinate: Coordinate) -> np.ndarray:
    factors = np.ones(len(actuator.biasprm))
    if actuator.biastype == _BIAS.mjBIAS_MUSCLE:
        factors[:9] = _muscle_factors(actuator, coordinate)
    else:
        factors[:3] = _affine_factors(coordinate)
    return factors
