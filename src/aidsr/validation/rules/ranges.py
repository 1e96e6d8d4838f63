"""Rules for ranges of controls and joints that are missing, dropped silently by MuJoCo, or in the wrong unit."""

from __future__ import annotations

import math
from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.sim.actuator_force import control_of, is_integrator
from aidsr.sim.limbs import SERIES_JOINTS
from aidsr.sim.structure import Chain
from aidsr.validation.consequences import COLLAPSE, NO_MOTION, SHAKING
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage

CHAIN_BEND_DEG = 30.0
"""Smallest bend that all joint limits of a chain must allow together; with less, ranges in radians were probably read
as degrees. Our choice."""


def _find_ctrlrange_missing(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find actuators without a control range or with one that is not written low to high.

    Source: MuJoCo XML reference, compiler/autolimits: a range that is not in order is dropped without a warning.
    """
    model = robot.model
    missing = [
        actuator
        for actuator in robot.structure.actuators
        if not model.actuator_ctrllimited[control_of(model, actuator)]
    ]
    if missing:
        ranges = [model.actuator_ctrlrange[control_of(model, actuator)] for actuator in missing]
        inverted = any(low > high for low, high in ranges)
        yield CTRLRANGE_MISSING.fault(
            "control range without low < high" if inverted else "no control range",
            names=(robot.actuator(actuator) for actuator in missing),
            measured=len(missing),
            limit=0,
            likely_cause="the range is written high to low, and MuJoCo drops it silently" if inverted else "",
        )


CTRLRANGE_MISSING = Rule(
    code="ctrlrange_missing",
    stage=Stage.SCOPE,
    finds="An actuator has no control range, or one written high to low, which MuJoCo drops without a word.",
    why="Without a range nobody knows how far a policy may command the actuator, and the tests do not either.",
    limit="actuators without low < high: 0",
    check=_find_ctrlrange_missing,
    unit="actuators",
    cure='Give each actuator ctrlrange="low high" in the unit of its command: N for a motor with gear 1, '
    "m of tendon length for a position servo.",
    explains=("sensor_constant",),
    example=Example(
        (
            (
                '<motor name="pull_front" tendon="front" gear="-1" ctrlrange="0 20"/>',
                '<motor name="pull_front" tendon="front" gear="-1"/>',
            ),
        )
    ),
)


def _find_actrange_missing(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find integrators whose activation has no end."""
    model = robot.model
    endless = [
        actuator
        for actuator in robot.structure.actuators
        if is_integrator(model, actuator) and not model.actuator_actlimited[actuator]
    ]
    if endless:
        yield ACTRANGE_MISSING.fault(
            "an integrator without activation range",
            names=(robot.actuator(actuator) for actuator in endless),
            measured=len(endless),
            limit=0,
        )


ACTRANGE_MISSING = Rule(
    code="actrange_missing",
    stage=Stage.SCOPE,
    finds="The command of an actuator is integrated without an end.",
    why="Its force grows for as long as the command is held, so that its control range says nothing about how hard it "
    "pulls.",
    limit="integrators without activation range: 0",
    check=_find_actrange_missing,
    unit="actuators",
    cure='Give it actlimited="true" and actrange="low high", or leave dyntype="integrator" out.',
    explains=(*SHAKING, "limit_overrun"),
    example=Example(
        (
            (
                '<motor name="pull_front" tendon="front" gear="-1" ctrlrange="0 20"/>',
                '<general name="pull_front" tendon="front" gear="-1" dyntype="integrator" ctrlrange="0 20"/>',
            ),
        )
    ),
)


def _find_inverted_ranges(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find joint ranges written high to low.

    Source: MuJoCo XML reference, compiler/autolimits; `jnt_range` keeps the written numbers, also if they are degrees.
    """
    model = robot.model
    inverted = [
        joint
        for joint in robot.structure.joints
        if not model.jnt_limited[joint] and model.jnt_range[joint, 0] > model.jnt_range[joint, 1]
    ]
    if inverted:
        low, high = model.jnt_range[inverted[0]]
        yield RANGE_INVERTED_IGNORED.fault(
            f"joint range written from {low:.3g} down to {high:.3g}: MuJoCo drops it, and the joint has no limit",
            names=(robot.joint(joint) for joint in inverted),
            measured=float(low - high),
            limit=0,
        )


RANGE_INVERTED_IGNORED = Rule(
    code="range_inverted_ignored",
    stage=Stage.RANGES,
    finds="A joint range is written high to low.",
    why="MuJoCo drops such a range without a word, and the joint turns without limit.",
    limit="joint ranges written high to low: 0",
    check=_find_inverted_ranges,
    unit="by which the first number exceeds the second",
    cure='Write range="low high" with low < high.',
    example=Example((('<joint name="j3"/>', '<joint name="j3" range="45 -45"/>'),)),
)


def _find_small_ranges(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find chains whose joint limits allow too little bending.

    Source: our choice; ranges in radians under the default of degrees are the usual cause.
    """
    for chain in robot.structure.chains:
        if len(chain.bodies) < SERIES_JOINTS:
            continue
        bend_deg = _allowed_bend_deg(robot, chain)
        if bend_deg < CHAIN_BEND_DEG:
            yield JOINT_RANGE_TOO_SMALL.fault(
                "all joint limits of this chain together allow too little bending",
                names=(robot.joint(joint) for joint in chain.joints),
                measured=bend_deg,
                limit=CHAIN_BEND_DEG,
                likely_cause="ranges written in radians are read as degrees",
            )


def _allowed_bend_deg(robot: RobotUnderTest, chain: Chain) -> float:
    """Return the sum of the bending that the joint limits of a chain allow [deg]; 180 for each joint without limits."""
    total = 0.0
    for joint in chain.joints:
        if not robot.model.jnt_limited[joint]:
            total += math.pi
        else:
            low, high = robot.model.jnt_range[joint]
            total += max(abs(float(low)), abs(float(high)))
    return math.degrees(total)


JOINT_RANGE_TOO_SMALL = Rule(
    code="joint_range_too_small",
    stage=Stage.RANGES,
    finds="The joint limits of a limb hardly let it bend.",
    why="MJCF counts angles in degrees unless <compiler> says otherwise: a range of 0.8, meant as radians, is no room.",
    limit=f"bend that all limits of a chain allow together: at least {CHAIN_BEND_DEG:g} deg",
    check=_find_small_ranges,
    unit="deg",
    cure='Write ranges in degrees, or set <compiler angle="radian"/> for the whole document.',
    explains=(*COLLAPSE, *SHAKING, *NO_MOTION),
    example=Example((('range="-45 45"', 'range="-0.8 0.8"'),)),
)
