"""Does the simulation stay a simulation while the robot is driven: divergence, chatter, overrun limits."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.sim.divergence import DivergenceSign
from aidsr.sim.rollout import Recording
from aidsr.validation.points import last_quarter
from aidsr.validation.protocol import STANDARD_GRAVITY_M_S2
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.stiffness import explain_divergence

_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)


def numerical_instability(robot: RobotUnderTest) -> Iterator[Fault]:
    """No test ends in numbers that are not finite, warned about, or faster than anything real."""
    for phase, recording, row in _phases(robot):
        found = robot.first_divergence(recording, row)
        if found is None:
            continue
        what = recording.failures[row] or "faster than anything real"
        yield Fault(
            code="numerical_instability",
            layer="simulate",
            severity="error",
            names=_fast_part(robot, found),
            measured=found.measured,
            limit=found.limit,
            unit=found.unit,
            message=f"the simulation fails during {phase}: {what}",
            likely_cause=explain_divergence(robot.model, robot.structure),
            cure='Use <option integrator="implicitfast" timestep="0.002"/>, joint damping of at least 0.02 s times its '
            "stiffness, heavier segments or softer joints and servos.",
            first_time_s=found.time_s,
        )
        return


def _fast_part(robot: RobotUnderTest, sign: DivergenceSign) -> tuple[str, ...]:
    if sign.joint is not None:
        return (robot.joint(sign.joint),)
    return () if sign.body is None else (robot.body(sign.body),)


def _phases(robot: RobotUnderTest) -> Iterator[tuple[str, Recording, int]]:
    """Simulations with a sign of divergence, the passive one first."""
    settle, battery = robot.driven.settle, robot.driven.battery
    if robot.diverged(settle)[0]:
        yield "settling", settle, 0
    if battery is not None:
        for row in sorted(set(range(len(robot.driven.tests))).difference(robot.sound_tests)):
            yield describe_test(robot, row), battery, row


def describe_test(robot: RobotUnderTest, row: int) -> str:
    """Return a test of the battery in words."""
    test = robot.driven.tests[row]
    if test.drive >= 0:
        actuator = robot.actuator(robot.driven.drives[test.drive].actuator)
        return f"the test of {actuator} at ctrl {test.command:.4g}"
    return {
        "reference": "the test with slack tendons",
        "rest": "the test at rest with all actuators on",
        "all": "the test of all actuators together",
    }.get(test.kind, "the random sweep of all actuators")


def chatter(robot: RobotUnderTest) -> Iterator[Fault]:
    """Under constant commands, after settling, the robot stands still.

    Looked at in tests that do not diverge. See `RobotUnderTest.shaking_g` for what is measured.
    """
    limits = robot.limits
    settle, battery = robot.driven.settle, robot.driven.battery
    worst, where, what = 0.0, -1, ""
    rows = [("settling", rms, 0) for rms in robot.shaking_g(settle)[:1] if not robot.diverged(settle)[0]]
    if battery is not None:
        shaking_g = robot.shaking_g(battery)
        rows += [("", shaking_g[row], row) for row in robot.sound_tests if robot.driven.tests[row].kind != "sweep"]
    for phase, rms, row in rows:
        if rms.size and rms.max() > worst:
            worst, where = float(rms.max()), int(np.argmax(rms))
            what = phase or describe_test(robot, row)
    if worst > limits.chatter_warning_g:
        severe = worst > limits.chatter_error_g
        yield Fault(
            code="chatter",
            layer="simulate",
            severity="error" if severe else "warning",
            names=(robot.body(robot.structure.bodies[where]),),
            measured=worst,
            limit=limits.chatter_error_g if severe else limits.chatter_warning_g,
            unit="g",
            whole=STANDARD_GRAVITY_M_S2,
            whole_unit="m/s2",
            message=f"keeps accelerating under constant commands, at the end of {what}",
            likely_cause=_why_chatter(robot),
            cure="Raise joint damping, soften servos (kp) or give them kv, and separate parts that rub.",
        )


def _why_chatter(robot: RobotUnderTest) -> str:
    """A tendon whose ends meet has no direction left to pull in; otherwise something is too stiff."""
    evidence, shortest = robot.driven, robot.limits.slack_length * robot.length_m
    pulled = [tendon.id for tendon in robot.structure.tendons if tendon.spatial and tendon.actuators]
    if evidence.battery is not None and pulled:
        lengths = evidence.battery.fields["ten_length"][:, -1, pulled].min(axis=0)
        met = [robot.tendon(tendon) for tendon, length in zip(pulled, lengths, strict=True) if length < shortest]
        if met:
            return f"{met[0]} is pulled to no length, where its direction flips"
    return "contacts, limits or servos are stiffer than the time step can follow"


def limit_overrun(robot: RobotUnderTest) -> Iterator[Fault]:
    """Driven joints stay about within their ranges.

    Source: MuJoCo documentation, Modeling, "Solver parameters": limits are soft, and softer for light links.
    """
    model, limits = robot.model, robot.limits
    worst_deg, at = 0.0, -1
    for joint in robot.structure.joints:
        if int(model.jnt_type[joint]) != _HINGE or not model.jnt_limited[joint]:
            continue
        low, high = model.jnt_range[joint]
        for angles in _angles_rad(robot, joint):
            beyond_deg = math.degrees(max(float(low - angles.min(initial=low)), float(angles.max(initial=high) - high)))
            if beyond_deg > worst_deg:
                worst_deg, at = beyond_deg, joint
    if worst_deg > limits.overrun_warning_deg:
        severe = worst_deg > limits.overrun_error_deg
        yield Fault(
            code="limit_overrun",
            layer="simulate",
            severity="error" if severe else "warning",
            names=(robot.joint(at),),
            measured=worst_deg,
            limit=limits.overrun_error_deg if severe else limits.overrun_warning_deg,
            unit="deg beyond its range",
            message="pulled past its limit under load",
            likely_cause="limits are soft for light links with the default solreflimit",
            cure='Set solreflimit="0.004 1" on the joints, or reduce the tendon force.',
        )


def _angles_rad(robot: RobotUnderTest, joint: int) -> Iterator[NDArray[np.float64]]:
    """Angles of a hinge in each test that does not diverge; of one that shakes, only the mean it shakes about."""
    battery, tests = robot.driven.battery, robot.driven.tests
    if battery is None:
        return
    angles = battery.fields["qpos"][:, :, int(robot.model.jnt_qposadr[joint])]
    held = [row for row in robot.sound_tests if tests[row].kind != "sweep"]
    shaking = [row for row in held if robot.shakes(row)]
    if not shaking:
        yield angles[list(robot.sound_tests)]
        return
    # what shakes when held shakes in the sweep too
    yield last_quarter(angles[shaking], axis=1).mean(axis=1)
    yield angles[[row for row in held if row not in shaking]]
