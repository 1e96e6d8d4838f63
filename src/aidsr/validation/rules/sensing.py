"""Do the sensors see what the robot does."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.validation.robot_under_test import RobotUnderTest

_TOUCHING = tuple(
    int(kind)
    for kind in (
        mujoco.mjtSensor.mjSENS_TOUCH,
        mujoco.mjtSensor.mjSENS_CONTACT,
        mujoco.mjtSensor.mjSENS_RANGEFINDER,
    )
)


def sensor_constant(robot: RobotUnderTest) -> Iterator[Fault]:
    """Sensors change while the robot is driven; those that wait for a touch are left out."""
    model, battery, sound = robot.model, robot.driven.battery, robot.sound_tests
    if battery is None or not robot.driven.drives or len(sound) < len(robot.driven.tests):
        return  # what a test that diverged would have shown is not known
    looked_at = [i for i in robot.structure.sensors if int(model.sensor_type[i]) not in _TOUCHING]
    constant = []
    for sensor in looked_at:
        first = int(model.sensor_adr[sensor])
        values = battery.fields["sensordata"][:, :, first : first + int(model.sensor_dim[sensor])]
        if np.ptp(values, axis=(0, 1)).max() <= robot.limits.sensor_change * max(1.0, np.abs(values).max()):
            constant.append(sensor)
    if constant:
        all_of_them = len(constant) == len(looked_at)
        yield Fault(
            code="sensor_constant",
            layer="simulate",
            severity="error" if all_of_them else "warning",
            names=tuple(robot.sensor(sensor) for sensor in constant),
            measured=len(looked_at) - len(constant),
            limit=1 if all_of_them else len(looked_at),
            unit="sensors that change",
            message="no sensor changes in any test" if all_of_them else "these sensors never change in any test",
            likely_cause="they are attached to parts that do not move",
            cure="Attach sensors to what moves: tendon lengths, the pose of a tip.",
        )
