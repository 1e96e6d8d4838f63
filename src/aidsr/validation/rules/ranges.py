"""Ranges of controls and joints that are missing, dropped silently, or in the wrong unit."""

from __future__ import annotations

import math
from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.sim.structure import Chain
from aidsr.validation.robot_under_test import RobotUnderTest


def ctrlrange_missing(robot: RobotUnderTest) -> Iterator[Fault]:
    """Every actuator has a control range, low below high.

    Source: MuJoCo XML reference, compiler/autolimits: a range whose ends are not in order is dropped without a word.
    """
    model = robot.model
    missing = [
        actuator
        for actuator in robot.structure.actuators
        if not model.actuator_ctrllimited[int(model.actuator_ctrladr[actuator])]
    ]
    if missing:
        written = [model.actuator_ctrlrange[int(model.actuator_ctrladr[actuator])] for actuator in missing]
        inverted = any(low > high for low, high in written)
        yield Fault(
            code="ctrlrange_missing",
            layer="structure",
            severity="error",
            names=tuple(robot.actuator(actuator) for actuator in missing),
            measured=len(missing),
            limit=0,
            unit="actuators",
            message="control range without low < high" if inverted else "no control range",
            likely_cause="the range is written high to low, and MuJoCo drops it silently" if inverted else "",
            cure='Give each actuator ctrlrange="low high" in the unit of its command: N for a motor with gear 1, '
            "m of tendon length for a position servo.",
        )


def range_inverted_ignored(robot: RobotUnderTest) -> Iterator[Fault]:
    """No joint range is written high to low.

    Source: as above, for joints; `jnt_range` keeps what was written, degrees too.
    """
    model = robot.model
    inverted = [
        joint
        for joint in robot.structure.joints
        if not model.jnt_limited[joint] and model.jnt_range[joint, 0] > model.jnt_range[joint, 1]
    ]
    if inverted:
        low, high = model.jnt_range[inverted[0]]
        yield Fault(
            code="range_inverted_ignored",
            layer="structure",
            severity="error",
            names=tuple(robot.joint(joint) for joint in inverted),
            measured=float(low - high),
            limit=0,
            unit="by which the first number exceeds the second",
            message=f"joint range written from {low:.3g} down to {high:.3g}: MuJoCo drops it, and the joint has no "
            "limit",
            cure='Write range="low high" with low < high.',
        )


def joint_range_too_small(robot: RobotUnderTest) -> Iterator[Fault]:
    """The limits of a chain let it bend.

    Source: our choice; ranges in radians under the default of degrees are the usual cause.
    """
    for chain in robot.structure.chains:
        if len(chain.bodies) < robot.limits.series_joints:
            continue
        bend_deg = _allowed_bend_deg(robot, chain)
        if bend_deg < robot.limits.chain_bend_deg:
            yield Fault(
                code="joint_range_too_small",
                layer="structure",
                severity="error",
                names=tuple(robot.joint(joint) for joint in chain.joints),
                measured=bend_deg,
                limit=robot.limits.chain_bend_deg,
                unit="deg",
                message="all joint limits of this chain together allow too little bending",
                likely_cause="ranges written in radians are read as degrees",
                cure='Write ranges in degrees, or set <compiler angle="radian"/> for the whole document.',
            )


def _allowed_bend_deg(robot: RobotUnderTest, chain: Chain) -> float:
    """Sum of the bending that each joint's limits allow; a joint without limits allows half a turn."""
    total = 0.0
    for joint in chain.joints:
        if not robot.model.jnt_limited[joint]:
            total += math.pi
        else:
            low, high = robot.model.jnt_range[joint]
            total += max(abs(float(low)), abs(float(high)))
    return math.degrees(total)
