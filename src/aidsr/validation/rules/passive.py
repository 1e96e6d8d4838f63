"""Rules for robots that gain energy or keep oscillating while nothing drives them."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.sim.motion_limits import ENERGY_OF_WEIGHT
from aidsr.sim.overlap import OVERLAP_NOTICED
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2
from aidsr.validation.consequences import SHAKING
from aidsr.validation.curves import SETTLING, make_signal, settling_signal
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.signals import Signal
from aidsr.validation.stiffness import integration_numbers

DAMPING_RATIO = 0.02
"""Smallest damping ratio of a visible oscillation. Soft bodies with any loss reach 0.05. Our choice."""
RINGING_SHARE = 0.02
"""Amplitude / L above which an oscillation is still visible after settling. Our choice."""
_SWING_SHARE = 0.35
"""Third largest distance between reversals / the largest, from which a motion is an oscillation. It is below a half,
because the slowest pendulum is recorded for less than three half swings, of which the first and the last are cut off.
Our choice."""
_STRAINED_RAD = 0.02
"""Angle beyond a joint's range in the reference pose, above which its limit stores energy that is then released. Our
choice."""
_WITH_GRAVITY, _WEIGHTLESS = 0, 1
_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)
_WINDOW = 3 / 8
"""Length of each window / length of the settling phase: 4.5 sqrt(L / g), longer than half a swing of the slowest
pendulum."""


def _find_energy_growth(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find robots with negative damping and robots that gain mechanical energy in the passive phase.

    The energy is measured only if all actuators are tendon actuators, which are slack: any other may do work while it
    holds a position.

    Source: the energy of a passive mechanism with losses can only decrease.
    """
    yield from _find_negative_damping(robot)
    model, evidence, limit = robot.model, robot.driven, ENERGY_OF_WEIGHT
    scale = robot.structure.mass_kg * STANDARD_GRAVITY_M_S2 * robot.length_m
    if len(robot.structure.tendon_actuators) < model.nactuator or not robot.settled or scale <= 0:
        return
    if _is_strained(robot):
        return
    energy = evidence.settle.fields["energy"][_WITH_GRAVITY].sum(axis=-1)
    gain = (energy - energy[0]) / scale
    if gain.max() > limit:
        yield ENERGY_GROWTH.fault(
            measured=float(gain.max()),
            limit=limit,
            whole=scale,
            whole_unit="J",
            message="mechanical energy rises while nothing drives the robot",
            likely_cause="the time step is too large for the stiffness: "
            f"dt x omega is {integration_numbers(model)[0]:.3g}",
            first_time_s=float(np.argmax(gain > limit) + 1) * evidence.settle.frame_s,
        )


def _is_strained(robot: RobotUnderTest) -> bool:
    """Return whether joint limits or contacts store energy in the reference pose, which MuJoCo's energy leaves out."""
    data, model = robot.drawn, robot.model
    strained = data.efc_pos < -OVERLAP_NOTICED * robot.length_m
    limits = data.efc_type == int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
    contacts = data.efc_type >= int(mujoco.mjtConstraint.mjCNSTR_CONTACT_FRICTIONLESS)
    bent = limits & (data.efc_pos < -_STRAINED_RAD)
    return bool(model.nv and (bent.any() or (contacts & strained).any()))


def _find_negative_damping(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find joints, tendons and actuators with negative damping, which adds energy; MuJoCo accepts it silently.

    Of polynomial damping, the lowest of the three numbers counts.
    """
    model, structure = robot.model, robot.structure
    dofs = {int(model.dof_jntid[dof]): dof for dof in range(model.nv)}
    found = [
        (
            robot.joint(joint),
            _lowest(model.dof_damping, model.dof_dampingpoly, dofs[joint]),
            _damping_unit(robot, joint),
        )
        for joint in structure.joints
    ]
    for each in structure.tendons:
        found.append((robot.tendon(each.id), _lowest(model.tendon_damping, model.tendon_dampingpoly, each.id), "N s/m"))
    for actuator in structure.actuators:
        damping = _lowest(model.actuator_damping, model.actuator_dampingpoly, actuator)
        found.append((robot.actuator(actuator), damping, "N s/m"))
    negative = [each for each in found if each[1] < 0]
    if negative:
        _, lowest, unit = min(negative, key=lambda each: each[1])
        yield ENERGY_GROWTH.fault(
            names=tuple(dict.fromkeys(name for name, _, _ in negative)),
            measured=lowest,
            limit=0,
            unit=unit,
            message="negative damping feeds energy in",
            cure="Make damping positive.",
            first_time_s=0.0,
        )


def _lowest(damping: NDArray[np.float64], poly: NDArray[np.float64], index: int) -> float:
    """Return the lowest of the coefficients of polynomial damping."""
    return float(min(damping[index], *poly[index]))


def _damping_unit(robot: RobotUnderTest, joint: int) -> str:
    return "N s/m" if int(robot.model.jnt_type[joint]) == _SLIDE else "N m s/rad"


def _energy_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    settle, scale = robot.driven.settle, robot.structure.mass_kg * STANDARD_GRAVITY_M_S2 * robot.length_m
    good = int(settle.good_frames[_WITH_GRAVITY])
    energy = settle.fields["energy"][_WITH_GRAVITY, :good].sum(axis=-1)
    if scale <= 0 or not good:
        return None
    curve, limits = {"potential and kinetic": (energy - energy[0]) / scale}, (ENERGY_OF_WEIGHT,)
    quantity = "rise of mechanical energy"
    return make_signal(quantity, "m g L", SETTLING, settle.frame_s, curve, limits, fault.first_time_s)


ENERGY_GROWTH = Rule(
    code="energy_growth",
    stage=Stage.PASSIVE,
    finds="The robot gains mechanical energy while nothing drives it, or a damping is negative.",
    why="The energy of a passive mechanism with losses can only fall: a rise is made by the integrator or by a sign.",
    limit="rise of mechanical energy / (m g L), where all actuators are slack tendon actuators: at most "
    f"{ENERGY_OF_WEIGHT:g}; damping of joints, tendons and actuators, each number of a polynomial one: at least 0",
    check=_find_energy_growth,
    unit="m g L",
    cure="Raise joint damping, or reduce the time step.",
    explains=SHAKING[1:],
    signal=_energy_signal,
    example=Example((('damping="0.05"', 'damping="-0.0005"'),)),
)


def _find_underdamped(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find robots that keep oscillating.

    The damping ratio is computed from the decay between two windows at the end of settling and the number of reversals
    in the last window. An oscillation consists of several similar swings; a single late motion, as of a ring that rolls
    on to its next link, is not one.

    Source: logarithmic decrement; the amplitude decreases by exp(-pi zeta) between reversals for small zeta.
    """
    evidence = robot.driven
    if not robot.settled:
        return
    points = evidence.settling_m[_WITH_GRAVITY]
    window = int(_WINDOW * points.shape[0])
    later = points[-window:]
    amplitude_m = np.linalg.norm(np.ptp(later, axis=0), axis=-1) / 2
    point = int(np.argmax(amplitude_m))
    if amplitude_m[point] <= RINGING_SHARE * robot.length_m:
        return
    axis = int(np.argmax(np.ptp(later[:, point], axis=0)))
    before, after = points[-2 * window : -window, point, axis], later[:, point, axis]
    reversals = int(np.count_nonzero(np.diff(np.sign(np.diff(after)))))
    if not reversals or not _is_even(points[-2 * window :, point, axis], _SWING_SHARE):
        return  # it creeps, is still falling, or topples
    decay = math.log(max(float(np.ptp(before)), 1e-12) / float(np.ptp(after)))
    ratio = decay / (math.pi * reversals)
    if ratio < DAMPING_RATIO:
        yield UNDERDAMPED.fault(
            severity="error" if robot.structure.tendon_actuators else "warning",
            names=_owner_of_point(robot, point),
            measured=max(ratio, 0.0),
            limit=DAMPING_RATIO,
            message=f"still swings by {1000 * float(amplitude_m[point]):.2g} mm "
            f"({100 * float(amplitude_m[point]) / robot.length_m:.2g} % of the robot's length) after settling",
            likely_cause="joints have little or no damping",
        )


def _is_even(path_m: NDArray[np.float64], share: float) -> bool:
    """Return whether the third largest distance between reversals of a path is at least `share` of the largest."""
    turns = 1 + np.flatnonzero(np.diff(np.sign(np.diff(path_m))))
    displacements_m = np.sort(np.abs(np.diff(path_m[[0, *turns, -1]])))
    return bool(len(displacements_m) >= 3 and displacements_m[-3] >= share * displacements_m[-1])


def _owner_of_point(robot: RobotUnderTest, point: int) -> tuple[str, ...]:
    bodies = robot.structure.bodies
    body = (
        bodies[point]
        if point < len(bodies)
        else int(robot.model.site_bodyid[robot.structure.marks[point - len(bodies)]])
    )
    return (robot.body(body),)


def _swing_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    return settling_signal(robot, fault, ())


UNDERDAMPED = Rule(
    code="underdamped",
    stage=Stage.PASSIVE,
    finds="The robot still swings after settling, with hardly any loss.",
    why="Every command starts a swing that outlasts it; soft materials damp far more.",
    limit=f"damping ratio of a swing of more than {RINGING_SHARE:g} of the robot's length at the end of settling: at "
    f"least {DAMPING_RATIO:g}. What moves once, as a ring that rolls on, does not swing. A warning where no "
    "tendon drives the robot: pendulums are meant to swing",
    check=_find_underdamped,
    unit="damping ratio",
    cure="Give each joint damping of about 0.02 to 0.1 s times its stiffness.",
    explains=("chatter",),
    signal=_swing_signal,
    example=Example(
        (
            ('damping="0.05"', 'damping="0.0001"'),
            ('timestep="0.002"', 'timestep="0.0005"'),
            ('<body name="base">', '<body name="base" euler="0 90 0">'),
        )
    ),
)
