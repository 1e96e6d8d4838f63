"""Rule for simulations that diverge."""

from __future__ import annotations

from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.sim.divergence import MAX_BODY_SPEED_M_S, DivergenceSign
from aidsr.sim.rollout import TOO_LITTLE_MEMORY, Recording
from aidsr.validation.curves import SETTLING, make_signal
from aidsr.validation.divergence_causes import find_cause
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.signals import Signal
from aidsr.validation.stiffness import explain_divergence
from aidsr.validation.thresholds import JOINT_SPEED_RAD_S

_CURE_FULL = (
    "Let fewer parts touch: exclude neighbours from contact, use fewer geoms; or reserve more with "
    '<size memory="..."/>.'
)


def find_divergence(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find the first test with numbers that are not finite, a warning of MuJoCo, or speeds that are not realistic."""
    for phase, recording, row in _phases(robot):
        found = robot.first_divergence(recording, row)
        if found is None:
            continue
        what = recording.failures[row] or "faster than anything real"
        if what == TOO_LITTLE_MEMORY:
            yield NUMERICAL_INSTABILITY.fault(
                message=f"the simulation fails during {phase}: {what}", cure=_CURE_FULL, first_time_s=found.time_s
            )
            return
        cause = find_cause(robot)
        numbers = explain_divergence(robot.model, robot.structure)
        tried = f"it no longer fails {cause.words}" if cause else ""
        yield NUMERICAL_INSTABILITY.fault(
            names=_fast_part(robot, found),
            measured=found.measured,
            limit=found.limit,
            unit=found.unit,
            message=f"the simulation fails during {phase}: {what}",
            likely_cause="; ".join(text for text in (numbers, tried) if text),
            cure=cause.cure if cause else None,
            first_time_s=found.time_s,
        )
        return


def _fast_part(robot: RobotUnderTest, sign: DivergenceSign) -> tuple[str, ...]:
    if sign.joint is not None:
        return (robot.joint(sign.joint),)
    return () if sign.body is None else (robot.body(sign.body),)


def _phases(robot: RobotUnderTest) -> Iterator[tuple[str, Recording, int]]:
    """Yield the simulations with a sign of divergence as (description, recording, row), the passive phase first."""
    settle, battery = robot.driven.settle, robot.driven.battery
    if robot.diverged(settle)[0]:
        yield "settling", settle, 0
    if battery is not None:
        for row in sorted(set(robot.known_tests).difference(robot.sound_tests)):
            yield robot.describe_test(row), battery, row


def _signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    """Return the speed of the fastest part in the first simulation that diverged, up to its last good frame."""
    evidence = robot.driven
    phases = [(SETTLING, evidence.settle, 0)]
    if evidence.battery is not None:
        phases += [(robot.describe_test(row), evidence.battery, row) for row in range(len(evidence.tests))]
    for test, recording, row in phases:
        if robot.first_divergence(recording, row) is None:
            continue
        count = max(1, int(recording.good_frames[row]))
        dofs = [dof for dof in range(robot.model.nv) if int(robot.model.dof_jntid[dof]) in robot.structure.joints]
        by_joint = fault.unit != "m/s" and dofs
        values = recording.fastest[row][:, dofs] if by_joint else recording.speed_m_s[row]
        unit, limit = ("rad/s", JOINT_SPEED_RAD_S) if by_joint else ("m/s", MAX_BODY_SPEED_M_S)
        curve = {"fastest joint" if by_joint else "fastest body": values[:count].max(axis=1)}
        return make_signal(
            "speed", unit, test, recording.frame_s, curve, (limit,), fault.first_time_s, logarithmic=True
        )
    return None


NUMERICAL_INSTABILITY = Rule(
    code="numerical_instability",
    stage=Stage.DIVERGENCE,
    finds="A test ends in numbers that are not finite, in a warning of MuJoCo about its state, or faster than anything "
    "real.",
    why="From there on the simulation says nothing about the robot, and a policy learns to exploit it.",
    limit=f"joints: at most {JOINT_SPEED_RAD_S:g} rad/s; bodies: at most {MAX_BODY_SPEED_M_S:g} m/s; not finite, or a "
    "warning: never",
    check=find_divergence,
    cure='Use <option integrator="implicitfast" timestep="0.002"/>, joint damping of at least 0.02 s times its '
    "stiffness, heavier segments or softer joints and servos.",
    signal=_signal,
    example=Example(
        (
            ('timestep="0.002" integrator="implicitfast"', 'timestep="0.01" integrator="Euler"'),
            ('damping="0.05"', 'damping="0"'),
        )
    ),
)
