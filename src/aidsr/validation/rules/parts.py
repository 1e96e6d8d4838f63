"""Are the parts there without which it is no tendon-driven robot that a policy can use."""

from __future__ import annotations

from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.validation.consequences import NO_MOTION
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage

_MOTORS = """  <actuator>
    <motor name="pull_front" tendon="front" gear="-1" ctrlrange="0 20"/>
    <motor name="pull_back" tendon="back" gear="-1" ctrlrange="0 20"/>
  </actuator>
"""
_SENSORS = """  <sensor>
    <tendonpos name="front_length" tendon="front"/>
    <tendonpos name="back_length" tendon="back"/>
    <framepos name="tip_position" objtype="site" objname="tip"/>
  </sensor>
"""
_TENDONS = """  <tendon>
    <spatial name="front">
      <site site="front0"/>
      <site site="front1"/>
      <site site="front2"/>
      <site site="front3"/>
      <site site="front4"/>
      <site site="front5"/>
      <site site="front6"/>
    </spatial>
    <spatial name="back">
      <site site="back0"/>
      <site site="back1"/>
      <site site="back2"/>
      <site site="back3"/>
      <site site="back4"/>
      <site site="back5"/>
      <site site="back6"/>
    </spatial>
  </tendon>
"""
_JOINT_MOTORS = """  <actuator>
    <motor name="turn1" joint="j1" ctrlrange="-0.2 0.2"/>
    <motor name="turn2" joint="j2" ctrlrange="-0.2 0.2"/>
    <motor name="turn3" joint="j3" ctrlrange="-0.2 0.2"/>
  </actuator>
"""


def _find_no_tendons(robot: RobotUnderTest) -> Iterator[Fault]:
    if not robot.structure.tendons:
        yield _missing(NO_TENDONS)


def _find_no_actuators(robot: RobotUnderTest) -> Iterator[Fault]:
    if not robot.structure.actuators:
        yield _missing(NO_ACTUATORS)


def _find_no_sensors(robot: RobotUnderTest) -> Iterator[Fault]:
    if not robot.structure.sensors:
        yield _missing(NO_SENSORS)


def _missing(rule: Rule) -> Fault:
    return rule.fault(f"the robot has no {rule.unit}", measured=0, limit=1)


NO_TENDONS = Rule(
    code="no_tendons",
    stage=Stage.PARTS,
    finds="The robot has no tendons.",
    why="The validator, the Coder and the fabrication are about robots that cables bend.",
    limit="tendons of the robot: at least 1",
    check=_find_no_tendons,
    unit="tendons",
    cure="Add <tendon> with one <spatial> per cable, routed through sites.",
    explains=("tendons_not_actuated", *NO_MOTION),
    example=Example(
        (
            (_TENDONS + _MOTORS, _JOINT_MOTORS),
            (_SENSORS, '  <sensor>\n    <framepos objtype="site" objname="tip"/>\n  </sensor>\n'),
        )
    ),
)

NO_ACTUATORS = Rule(
    code="no_actuators",
    stage=Stage.PARTS,
    finds="The robot has no actuators.",
    why="A policy has nothing to command.",
    limit="actuators of the robot: at least 1",
    check=_find_no_actuators,
    unit="actuators",
    cure='Add <actuator> with one motor or position servo tendon="..." each.',
    explains=("tendons_not_actuated", *NO_MOTION),
    example=Example(((_MOTORS, ""),)),
)

NO_SENSORS = Rule(
    code="no_sensors",
    stage=Stage.PARTS,
    finds="The robot has no sensors.",
    why="A policy sees the robot through its sensors alone.",
    limit="sensors of the robot: at least 1",
    check=_find_no_sensors,
    unit="sensors",
    cure="Add <sensor>, such as <tendonpos> for each tendon and <framepos> of a tip.",
    explains=("sensor_constant",),
    example=Example(((_SENSORS, ""),)),
)


def _find_tendons_not_actuated(robot: RobotUnderTest) -> Iterator[Fault]:
    structure = robot.structure
    if structure.tendons and structure.actuators and not structure.tendon_actuators:
        yield TENDONS_NOT_ACTUATED.fault(
            "no actuator pulls on a tendon",
            names=(robot.tendon(tendon.id) for tendon in structure.tendons),
            measured=0,
            limit=1,
        )


TENDONS_NOT_ACTUATED = Rule(
    code="tendons_not_actuated",
    stage=Stage.PARTS,
    finds="The robot has tendons and actuators, and no actuator acts on a tendon.",
    why="Motors in the joints make it another kind of robot, and its cables are dead weight.",
    limit="tendons that an actuator acts on: at least 1",
    check=_find_tendons_not_actuated,
    unit="driven tendons",
    cure='Let actuators act on tendons: <motor tendon="..."> instead of joint="...".',
    explains=("fully_actuated", *NO_MOTION),
    example=Example(((_MOTORS, _JOINT_MOTORS),)),
)
