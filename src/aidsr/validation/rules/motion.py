"""Rules for robots that shake while they are driven, or whose joints exceed their limits."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.sim.motion_limits import OVERRUN_DEG
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2
from aidsr.validation.curves import SETTLING, battery_of, find_body, limits_of, make_signal
from aidsr.validation.points import last_quarter
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.signals import Signal
from aidsr.validation.thresholds import CHATTER_ERROR_G

CHATTER_WARNING_G = 1.0
"""Root mean square acceleration under constant commands, in standard gravity, above which shaking is a warning. Our
choice."""
OVERRUN_WARNING_DEG = 10.0
"""Angle of a joint beyond its range under load, above which it is a warning; above `OVERRUN_DEG` it is an error. Our
choice."""
_HELD_SHARE = 0.1
"""Share of a test during which a joint has to be beyond its range: a light link that swings into its stop swings back.
Our choice."""
_NO_LENGTH = 0.01
"""Tendon length / L below which the ends of the tendon meet. Our choice."""
_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)


def _tests(robot: RobotUnderTest) -> list[int]:
    """Return the rows of the tests that do not diverge and are among `RobotUnderTest.known_tests`."""
    return sorted(set(robot.sound_tests).intersection(robot.known_tests))


def _find_chatter(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find robots that shake at the end of settling or at the end of a test with constant commands.

    Only tests that do not diverge count. See `RobotUnderTest.shaking_g` for the measurement.
    """
    settle, battery = robot.driven.settle, robot.driven.battery
    worst, where, what = 0.0, -1, ""
    rows = [("settling", rms, 0) for rms in robot.shaking_g(settle)[:1] if not robot.diverged(settle)[0]]
    if battery is not None:
        shaking_g = robot.shaking_g(battery)
        rows += [("", shaking_g[row], row) for row in _tests(robot) if robot.driven.tests[row].kind != "sweep"]
    for phase, rms, row in rows:
        if rms.size and rms.max() > worst:
            worst, where = float(rms.max()), int(np.argmax(rms))
            what = phase or robot.describe_test(row)
    if worst > CHATTER_WARNING_G:
        severe = worst > CHATTER_ERROR_G
        yield CHATTER.fault(
            severity="error" if severe else "warning",
            names=(robot.body(robot.structure.bodies[where]),),
            measured=worst,
            limit=CHATTER_ERROR_G if severe else CHATTER_WARNING_G,
            whole=STANDARD_GRAVITY_M_S2,
            whole_unit="m/s2",
            message=f"keeps accelerating under constant commands, at the end of {what}",
            likely_cause=_why_chatter(robot),
        )


def _why_chatter(robot: RobotUnderTest) -> str:
    """Return the likely cause of shaking: a tendon whose ends meet, so that its direction flips, or high stiffness."""
    evidence, shortest = robot.driven, _NO_LENGTH * robot.length_m
    pulled = [tendon.id for tendon in robot.structure.tendons if tendon.spatial and tendon.actuators]
    if evidence.battery is not None and pulled:
        lengths = evidence.battery.fields["ten_length"][:, -1, pulled].min(axis=0)
        met = [robot.tendon(tendon) for tendon, length in zip(pulled, lengths, strict=True) if length < shortest]
        if met:
            return f"{met[0]} is pulled to no length, where its direction flips"
    return "contacts, limits or servos are stiffer than the time step can follow"


def _chatter_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    evidence, body = robot.driven, find_body(robot, fault.names[0])
    rows = [(SETTLING, evidence.settle, 0)]
    if evidence.battery is not None:
        rows += [
            (robot.describe_test(row), evidence.battery, row)
            for row in _tests(robot)
            if evidence.tests[row].kind != "sweep"
        ]
    test, recording, row = max(
        rows, key=lambda r: float(last_quarter(r[1].acceleration_m_s2[r[2]], axis=0)[:, body].mean())
    )
    curve = {fault.names[0]: recording.acceleration_m_s2[row][:, body] / STANDARD_GRAVITY_M_S2}
    return make_signal("acceleration", "g", test, recording.frame_s, curve, limits_of(fault))


CHATTER = Rule(
    code="chatter",
    stage=Stage.DRIVEN,
    finds="The robot keeps shaking while its commands are constant.",
    why="No force, power or sensor can be trusted while contacts, limits or servos hammer, and a policy learns "
    "from noise.",
    limit="rms acceleration of a centre of mass under constant commands, in the calmest part of the last quarter of a "
    f"test that does not diverge: at most {CHATTER_ERROR_G:g} g; a warning above {CHATTER_WARNING_G:g} g",
    check=_find_chatter,
    unit="g",
    cure="Raise joint damping, soften servos (kp) or give them kv, and separate parts that rub.",
    explains=("antagonist_lock", "actuator_too_weak", "too_stiff", "no_effect", "sensor_constant"),
    signal=_chatter_signal,
    example=Example(
        (
            ('integrator="implicitfast"', 'integrator="Euler"'),
            (
                '<motor name="pull_front" tendon="front" gear="-1" ctrlrange="0 20"/>',
                '<position name="pull_front" tendon="front" kp="2000" kv="20000" '
                'ctrlrange="0.1 0.14" forcerange="-40 0"/>',
            ),
        )
    ),
)


def _find_overrun_limits(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find hinges that are far beyond their ranges in the tests.

    Source: MuJoCo documentation, Modeling, "Solver parameters": limits are soft, and softer for light links.
    """
    model = robot.model
    worst_deg, at = 0.0, -1
    for joint in robot.structure.joints:
        if int(model.jnt_type[joint]) != _HINGE or not model.jnt_limited[joint]:
            continue
        low, high = model.jnt_range[joint]
        for angles in _angles_rad(robot, joint):
            beyond = np.maximum(low - angles, angles - high)
            held = np.quantile(beyond, 1 - _HELD_SHARE, axis=1) if beyond.ndim == 2 else beyond
            beyond_deg = math.degrees(float(held.max(initial=0.0)))
            if beyond_deg > worst_deg:
                worst_deg, at = beyond_deg, joint
    if worst_deg > OVERRUN_WARNING_DEG:
        severe = worst_deg > OVERRUN_DEG
        yield LIMIT_OVERRUN.fault(
            severity="error" if severe else "warning",
            names=(robot.joint(at),),
            measured=worst_deg,
            limit=OVERRUN_DEG if severe else OVERRUN_WARNING_DEG,
            message="pulled past its limit under load",
            likely_cause="limits are soft for light links with the default solreflimit",
        )


def _angles_rad(robot: RobotUnderTest, joint: int) -> Iterator[NDArray[np.float64]]:
    """Yield arrays of the angles of a hinge in the tests that do not diverge [rad].

    (n_tests, n_frames) for tests in which the robot does not shake; (n_tests,), the mean angle over the last quarter,
    for tests in which it shakes. If the robot shakes in any test, the random sweep is left out.
    """
    battery, tests = robot.driven.battery, robot.driven.tests
    if battery is None:
        return
    angles = battery.fields["qpos"][:, :, int(robot.model.jnt_qposadr[joint])]
    held = [row for row in _tests(robot) if tests[row].kind != "sweep"]
    shaking = [row for row in held if robot.shakes(row)]
    if not shaking:
        yield angles[_tests(robot)]
        return
    # a robot that shakes under constant commands shakes in the sweep too
    yield last_quarter(angles[shaking], axis=1).mean(axis=1)
    yield angles[[row for row in held if row not in shaking]]


def _overrun_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    model, battery = robot.model, battery_of(robot)
    joint = next(index for index in robot.structure.joints if robot.joint(index) == fault.names[0])
    degrees = np.degrees(battery.fields["qpos"][:, :, int(model.jnt_qposadr[joint])])
    low, high = np.degrees(model.jnt_range[joint])
    row = int(np.argmax(np.maximum(low - degrees.min(axis=1), degrees.max(axis=1) - high)))
    curves, limits = {fault.names[0]: degrees[row]}, (float(low), float(high))
    return make_signal("angle", "deg", robot.describe_test(row), battery.frame_s, curves, limits)


LIMIT_OVERRUN = Rule(
    code="limit_overrun",
    stage=Stage.DRIVEN,
    finds="A driven hinge turns far beyond its range.",
    why="Limits are soft in MuJoCo, and softer for light links: with the default solreflimit a tendon pulls a "
    "small joint "
    "through its stop, where a built one would hold.",
    limit=f"hinge beyond its range for {100 * _HELD_SHARE:g} % of a test that does not diverge, the mean where it "
    "shakes: at most "
    f"{OVERRUN_DEG:g} deg; a warning above {OVERRUN_WARNING_DEG:g} deg",
    check=_find_overrun_limits,
    unit="deg beyond its range",
    cure='Set solreflimit="0.004 1" on the joints, or reduce the tendon force.',
    explains=("driven_overlap",),
    signal=_overrun_signal,
    example=Example(
        (
            ('range="-45 45"', 'range="-6 6"'),
            (' solreflimit="0.004 1"', ""),
            ('ctrlrange="0 20"', 'ctrlrange="0 80"'),
        )
    ),
)
