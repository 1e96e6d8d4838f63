"""Are the parts there without which it is no tendon-driven robot that a policy can use."""

from __future__ import annotations

from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.validation.robot_under_test import RobotUnderTest


def no_tendons(robot: RobotUnderTest) -> Iterator[Fault]:
    """A tendon-driven robot has tendons."""
    if not robot.structure.tendons:
        yield _missing("no_tendons", "tendons", "Add <tendon> with one <spatial> per cable, routed through sites.")


def no_actuators(robot: RobotUnderTest) -> Iterator[Fault]:
    """A robot has actuators."""
    if not robot.structure.actuators:
        yield _missing(
            "no_actuators", "actuators", 'Add <actuator> with one motor or position servo tendon="..." each.'
        )


def no_sensors(robot: RobotUnderTest) -> Iterator[Fault]:
    """A policy needs sensors to see what the robot does."""
    if not robot.structure.sensors:
        yield _missing(
            "no_sensors", "sensors", "Add <sensor>, such as <tendonpos> for each tendon and <framepos> of a tip."
        )


def tendons_not_actuated(robot: RobotUnderTest) -> Iterator[Fault]:
    """At least one tendon is pulled by an actuator."""
    structure = robot.structure
    if structure.tendons and structure.actuators and not structure.tendon_actuators:
        yield Fault(
            code="tendons_not_actuated",
            layer="structure",
            severity="error",
            names=tuple(robot.tendon(tendon.id) for tendon in structure.tendons),
            measured=0,
            limit=1,
            unit="driven tendons",
            message="no actuator pulls on a tendon",
            cure='Let actuators act on tendons: <motor tendon="..."> instead of joint="...".',
        )


def _missing(code: str, what: str, cure: str) -> Fault:
    return Fault(
        code=code,
        layer="structure",
        severity="error",
        measured=0,
        limit=1,
        unit=what,
        message=f"the robot has no {what}",
        cure=cure,
    )
