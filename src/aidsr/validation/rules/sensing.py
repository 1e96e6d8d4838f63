"""Rule for sensors that do not respond to the robot's motion."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.validation.curves import MAX_CURVES, Array, battery_of, make_signal
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.signals import Signal

_CHANGE = 1e-9
"""Change / max(largest absolute value, 1) up to which a sensor is constant. Our choice."""
_TOUCHING = tuple(
    int(kind)
    for kind in (
        mujoco.mjtSensor.mjSENS_TOUCH,
        mujoco.mjtSensor.mjSENS_CONTACT,
        mujoco.mjtSensor.mjSENS_RANGEFINDER,
    )
)


def _find_constant_sensors(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find sensors that never change while the robot is driven; touch, contact and range sensors are left out."""
    model, battery, sound = robot.model, robot.driven.battery, robot.sound_tests
    if battery is None or not robot.driven.drives or len(sound) < len(robot.driven.tests):
        return  # a sensor might have changed in a test that diverged
    looked_at = [i for i in robot.structure.sensors if int(model.sensor_type[i]) not in _TOUCHING]
    constant = []
    for sensor in looked_at:
        first = int(model.sensor_adr[sensor])
        values = battery.fields["sensordata"][:, :, first : first + int(model.sensor_dim[sensor])]
        if np.ptp(values, axis=(0, 1)).max() <= _CHANGE * max(1.0, np.abs(values).max()):
            constant.append(sensor)
    if constant:
        all_of_them = len(constant) == len(looked_at)
        yield SENSOR_CONSTANT.fault(
            severity="error" if all_of_them else "warning",
            names=tuple(robot.sensor(sensor) for sensor in constant),
            measured=len(looked_at) - len(constant),
            limit=1 if all_of_them else len(looked_at),
            message="no sensor changes in any test" if all_of_them else "these sensors never change in any test",
            likely_cause="they are attached to parts that do not move",
        )


def _signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    model, battery, row = robot.model, battery_of(robot), len(robot.driven.tests) - 1
    curves: dict[str, Array] = {}
    for sensor in robot.structure.sensors:
        if robot.sensor(sensor) in fault.names and len(curves) < MAX_CURVES:
            values = battery.fields["sensordata"][row, :, int(model.sensor_adr[sensor])]
            curves[robot.sensor(sensor)] = values - values[0]
    return make_signal("change of the sensor", "", robot.describe_test(row), battery.frame_s, curves)


SENSOR_CONSTANT = Rule(
    code="sensor_constant",
    stage=Stage.SENSORS,
    finds="A sensor never changes while every actuator is driven.",
    why="A policy that sees the same number always sees nothing.",
    limit="sensors that change, touch and range sensors left out: at least 1; a warning for each that does not",
    check=_find_constant_sensors,
    unit="sensors that change",
    cure="Attach sensors to what moves: tendon lengths, the pose of a tip.",
    signal=_signal,
    example=Example(
        (
            ('    <tendonpos name="front_length" tendon="front"/>\n', ""),
            ('    <tendonpos name="back_length" tendon="back"/>\n', ""),
            ('objtype="site" objname="tip"', 'objtype="body" objname="base"'),
        )
    ),
)
