"""Rule for commands of servos that leave their cable slack in every pose."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim.actuator_force import servo_target
from aidsr.sim.drive import Drive
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage

SLACK_SHARE = 0.3
_SLACK_LENGTH = 0.01
"""Largest share of a servo's commands with which its cable is slack in every pose; and the excess length / longest path
above which a cable is slack. Our choice."""


def _find_slack_tendons(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find servos that pay out more cable than the robot takes up in any pose.

    A servo's command sets the length of its cable: the length at which it gives no force. If that is more than the
    longest path of all tests, the cable is slack in every pose and tangles on its spool, and the command has the same
    effect as a shorter one. A force actuator only pays out the cable that the robot takes up, so it is not checked.

    Source: MuJoCo documentation, Computation, "Actuation model": force = gain * ctrl + bias, affine in the length.
    """
    loose: dict[str, tuple[float, float]] = {}
    for drive in robot.driven.drives:
        ends = _paid_out_m(robot, drive)
        if ends is None:
            continue
        shortest, longest = ends
        taut = _longest_path_m(robot, drive) * (1 + _SLACK_LENGTH)
        share = min(1.0, (longest - taut) / (longest - shortest))
        if share > SLACK_SHARE:
            loose[robot.actuator(drive.actuator)] = share, longest - shortest
    if loose:
        share, range_m = max(loose.values())
        yield TENDON_SLACK.fault(
            names=tuple(loose),
            measured=share,
            limit=SLACK_SHARE,
            whole=range_m,
            whole_unit="m",
            message="pays out more cable than any pose takes up, so that it hangs loose",
        )


def _paid_out_m(robot: RobotUnderTest, drive: Drive) -> tuple[float, float] | None:
    """Return the shortest and longest cable that a tendon servo can be commanded to [m]; None for other actuators."""
    if not drive.on_tendon or drive.low >= drive.high:
        return None
    one, other = (servo_target(robot.model, drive.actuator, command) for command in (drive.low, drive.high))
    if one is None or other is None or one == other:
        return None
    return min(one, other), max(one, other)


def _longest_path_m(robot: RobotUnderTest, drive: Drive) -> float:
    """Return the longest path of an actuator's tendon in any test [m]."""
    tendon = int(robot.model.actuator_trnid[drive.actuator, 0])
    recordings = [recording for recording in (robot.driven.settle, robot.driven.battery) if recording is not None]
    return max(float(np.max(recording.fields["ten_length"][:, :, tendon])) for recording in recordings)


TENDON_SLACK = Rule(
    code="tendon_slack",
    stage=Stage.BUILDING,
    finds="Commands of a servo pay out more cable than the robot takes up in any pose.",
    why="The cable hangs loose and tangles on its spool, and those commands do nothing that a shorter cable does "
    "not. A "
    "force actuator pays out only what the robot draws.",
    limit="commands that let out more cable than the longest path of all tests, by more than "
    f"{100 * _SLACK_LENGTH:g} % / "
    f"all commands: at most {SLACK_SHARE:g}, always a warning",
    check=_find_slack_tendons,
    severity="warning",
    unit="of its commands",
    cure="End ctrlrange at the longest path of the tendon: its rest length and its stroke.",
    example=Example(
        (
            (
                '<motor name="pull_front" tendon="front" gear="-1" ctrlrange="0 20"/>',
                '<position name="pull_front" tendon="front" kp="2000" kv="20" '
                'ctrlrange="0.12 0.2" forcerange="-10 0"/>',
            ),
        )
    ),
)
