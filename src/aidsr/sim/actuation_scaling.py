"""Scaling of actuators according to the physical units of their input, gain and bias.

The input of a position servo is a coordinate of its transmission and is scaled like it; the input of a velocity servo
is the rate of that coordinate and is scaled like the rate. Every other input keeps its numbers, and the gain is scaled
like a force. For every kind of actuator, a policy that pulls a tendon halfway still pulls it halfway after scaling.

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
    """Return whether `scale_actuator` supports this kind of actuator; it does not support DC motors, for example.

    Material scaling says nothing about the electrical constants of a motor.
    """
    return (
        actuator.gaintype in _GAINS
        and actuator.biastype in _BIASES
        and actuator.dyntype in _DYNAMICS
        and actuator.trntype in _TRANSMISSIONS
    )


def actuator_coordinate(actuator: Any, coordinates: Mapping[tuple[str, str], Coordinate], units: Units) -> Coordinate:
    """Return the generalized coordinate on which an actuator's transmission acts.

    Args:
        actuator: The actuator.
        coordinates: Coordinates of the model's joints and tendons, by kind ("joint", "tendon") and name.
        units: Factors on mass, length and time.
    """
    if actuator.trntype == _TRN.mjTRN_TENDON:
        return coordinates["tendon", actuator.target]
    if actuator.trntype in (_TRN.mjTRN_JOINT, _TRN.mjTRN_JOINTINPARENT):
        return coordinates["joint", actuator.target]
    if actuator.trntype == _TRN.mjTRN_SITE:
        return Coordinate(units, is_length=bool(np.any(actuator.gear[:3])))
    return Coordinate(units, is_length=True)


def scale_actuator(actuator: Any, coordinate: Coordinate) -> None:
    """Multiply each attribute of an actuator by the factor for its physical unit, in place."""
    units = coordinate.units
    if coordinate.is_length:
        # The six gears of a site or free joint are three for forces and three for torques; a torque has one more
        # power of length.
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
        bias[1] = -gain[0]  # MuJoCo recognizes a position servo by bit-exact equality of the two
        if bias[2] > 0:
            bias[2] = actuator.biasprm[2]  # MuJoCo then reads a positive third number as a damping ratio
    actuator.gainprm, actuator.biasprm = gain, bias


def _is_position_servo(actuator: Any) -> bool:
    affine = actuator.gaintype == _GAIN.mjGAIN_FIXED and actuator.biastype == _BIAS.mjBIAS_AFFINE
    return bool(affine and actuator.biasprm[1] == -actuator.gainprm[0] != 0)


def _is_velocity_servo(actuator: Any) -> bool:
    affine = actuator.gaintype == _GAIN.mjGAIN_FIXED and actuator.biastype == _BIAS.mjBIAS_AFFINE
    same = np.isclose(actuator.biasprm[2], -actuator.gainprm[0], rtol=1e-9, atol=0)
    return bool(affine and same and actuator.biasprm[1] == 0 != actuator.gainprm[0])


def _input_factor(actuator: Any, coordinate: Coordinate) -> float:
    """Return the factor on the input of the gain: the activation, or the control of an actuator without activation."""
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
    """Return the factors on force, on force per coordinate and on force per rate of the coordinate."""
    force = coordinate.force
    return [force, force * coordinate.value(-1), force * coordinate.value(-1, time=1)]


def _muscle_factors(actuator: Any, coordinate: Coordinate) -> list[float]:
    """Return the factors on range (2), force, scale, lmin, lmax, vmax, fpmax, fvmax."""
    # With a negative force, the compiler computes the force as scale / acc0, where scale is an angular acceleration.
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
