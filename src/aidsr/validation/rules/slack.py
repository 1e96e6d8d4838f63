"""Does a command leave its cable hanging loose."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.validation.drive import Drive
from aidsr.validation.robot_under_test import RobotUnderTest

_AFFINE = int(mujoco.mjtBias.mjBIAS_AFFINE)
_INTEGRATOR = int(mujoco.mjtDyn.mjDYN_INTEGRATOR)


def tendon_slack(robot: RobotUnderTest) -> Iterator[Fault]:
    """A servo pays out no more cable than the robot takes up in any pose.

    Only a servo says how long its cable is: the length at which it gives no force. Where that is beyond the longest
    path of all tests, the cable hangs loose however the robot moves, tangles on its spool, and the command does nothing
    that a shorter one does not. A force actuator pays out what the robot draws, so its cable is never longer.

    Source: MuJoCo documentation, Computation, "Actuation model": force = gain * ctrl + bias, affine in the length.
    """
    limits = robot.limits
    loose: dict[str, tuple[float, float]] = {}
    for drive in robot.driven.drives:
        ends = _paid_out_m(robot, drive)
        if ends is None:
            continue
        shortest, longest = ends
        taut = _longest_path_m(robot, drive) * (1 + limits.slack_length)
        share = min(1.0, (longest - taut) / (longest - shortest))
        if share > limits.slack_share:
            loose[robot.actuator(drive.actuator)] = share, longest - shortest
    if loose:
        share, range_m = max(loose.values())
        yield Fault(
            code="tendon_slack",
            layer="realizability",
            severity="warning",
            names=tuple(loose),
            measured=share,
            limit=limits.slack_share,
            unit="of its commands",
            whole=range_m,
            whole_unit="m",
            message="pays out more cable than any pose takes up, so that it hangs loose",
            cure="End ctrlrange at the longest path of the tendon: its rest length and its stroke.",
        )


def _paid_out_m(robot: RobotUnderTest, drive: Drive) -> tuple[float, float] | None:
    """Shortest and longest cable that a tendon servo can be told [m]; None for any other actuator."""
    model, actuator = robot.model, drive.actuator
    stiffness = -float(model.actuator_biasprm[actuator, 1]) * float(model.actuator_gear[actuator, 0])
    servo = int(model.actuator_biastype[actuator]) == _AFFINE and int(model.actuator_dyntype[actuator]) != _INTEGRATOR
    if not drive.on_tendon or not servo or stiffness == 0 or drive.low >= drive.high:
        return None
    gain, offset = float(model.actuator_gainprm[actuator, 0]), float(model.actuator_biasprm[actuator, 0])
    lengths = sorted((gain * command + offset) / stiffness for command in (drive.low, drive.high))
    return None if lengths[0] == lengths[1] else (lengths[0], lengths[1])


def _longest_path_m(robot: RobotUnderTest, drive: Drive) -> float:
    """Longest path of a tendon in any test [m]."""
    tendon = int(robot.model.actuator_trnid[drive.actuator, 0])
    recordings = [recording for recording in (robot.driven.settle, robot.driven.battery) if recording is not None]
    return max(float(np.max(recording.fields["ten_length"][:, :, tendon])) for recording in recordings)
