"""Scope rules for actuation: cables, and nothing else, must drive the robot."""

from __future__ import annotations

from aidsr.core.artifacts import Fault
from aidsr.sim.limbs import SERIES_JOINTS
from aidsr.sim.scope_reader import PUSH_SHARE
from aidsr.validation.curves import Array, actuator_signal
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.scope_check import added, find_out_of_scope_faults
from aidsr.validation.signals import Signal

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


NO_TENDONS = Rule(
    code="no_tendons",
    stage=Stage.SCOPE,
    finds="The robot has no tendons.",
    why="The validator, the Coder and the fabrication are about robots that cables bend.",
    limit="tendons of the robot: at least 1",
    check=find_out_of_scope_faults,
    unit="tendons",
    cure="Add <tendon> with one <spatial> per cable, routed through sites.",
    explains=("tendons_not_actuated", "motorized_joint", "fully_actuated"),
    example=Example(
        (
            (_TENDONS + _MOTORS, _JOINT_MOTORS),
            (_SENSORS, '  <sensor>\n    <framepos objtype="site" objname="tip"/>\n  </sensor>\n'),
        )
    ),
)

NO_ACTUATORS = Rule(
    code="no_actuators",
    stage=Stage.SCOPE,
    finds="The robot has no actuators.",
    why="A policy has nothing to command.",
    limit="actuators of the robot: at least 1",
    check=find_out_of_scope_faults,
    unit="actuators",
    cure='Add <actuator> with one motor or position servo tendon="..." each.',
    explains=("tendons_not_actuated", "sensor_constant"),
    example=Example(((_MOTORS, ""),)),
)

NO_SENSORS = Rule(
    code="no_sensors",
    stage=Stage.SCOPE,
    finds="The robot has no sensors.",
    why="A policy sees the robot through its sensors alone. The physics of a robot without any is sound, so this is a "
    "matter of scope: a tendon-driven continuum robot that a policy can control.",
    limit="sensors of the robot: at least 1",
    check=find_out_of_scope_faults,
    unit="sensors",
    cure="Add <sensor>, such as <tendonpos> for each tendon and <framepos> of a tip.",
    explains=("sensor_constant",),
    example=Example(((_SENSORS, ""),)),
)

TENDONS_NOT_ACTUATED = Rule(
    code="tendons_not_actuated",
    stage=Stage.SCOPE,
    finds="The robot has tendons and actuators, and no actuator acts on a tendon.",
    why="Motors in the joints make it another kind of robot, and its cables are dead weight.",
    limit="tendons that an actuator acts on: at least 1",
    check=find_out_of_scope_faults,
    unit="driven tendons",
    cure='Let actuators act on tendons: <motor tendon="..."> instead of joint="...".',
    explains=("motorized_joint", "fully_actuated"),
    example=Example(((_MOTORS, _JOINT_MOTORS),)),
)

NO_SOFT_CHAIN = Rule(
    code="no_soft_chain",
    stage=Stage.SCOPE,
    finds="No limb has three or more hinge or ball joints one after the other.",
    why="Two joints in series are a linkage: it has no curvature that could vary along it, as a continuum limb has.",
    limit=f"joints in series, hinges about one point counted once: at least {SERIES_JOINTS}",
    check=find_out_of_scope_faults,
    unit="joints in series",
    cure="Nest each segment's <body> inside the one before it, each with its own hinge or ball joint.",
    explains=("fully_actuated",),
    example=Example(tuple((f'<joint name="j{index}"/>', "") for index in (2, 3, 5, 6))),
)

MOTORIZED_JOINT = Rule(
    code="motorized_joint",
    stage=Stage.SCOPE,
    finds="An actuator turns or slides the robot's joints without a cable along a limb.",
    why="A motor in a joint, a piston or a crank makes it a rigid robot. Motors of the environment, as for a moving "
    "mount, are not the robot's.",
    limit="actuators of the robot on joints, on cranks, and on sums of joints that are fewer than three or driven to "
    "both sides: 0",
    check=find_out_of_scope_faults,
    unit="actuators",
    cure='Drive the limb with cables: <motor tendon="..."> along three or more joints.',
    example=Example((added("actuator", '<motor name="turn" joint="j1" ctrlrange="-0.2 0.2"/>'),)),
)

THRUSTER = Rule(
    code="thruster",
    stage=Stage.SCOPE,
    finds="An actuator pushes the robot from outside: a force at a site, or on its free joint.",
    why="Such a force pushes against nothing, as a jet does, and needs no body at all.",
    limit="actuators of the robot on sites or free joints: 0",
    check=find_out_of_scope_faults,
    unit="actuators",
    cure="Leave it out, and let cables move the robot.",
    example=Example((added("actuator", '<motor name="jet" site="tip" gear="1 0 0 0 0 0" ctrlrange="0 1"/>'),)),
)

ADHESION = Rule(
    code="adhesion",
    stage=Stage.SCOPE,
    finds="An actuator or a shape of the robot sticks to what it touches.",
    why="An adhesive pad holds and climbs without a grip, so that the body does no work.",
    limit="adhesion actuators and shapes with adhesion: 0",
    check=find_out_of_scope_faults,
    unit="actuators",
    cure="Leave it out, and let soft limbs hold by their shape and by friction.",
    example=Example((added("actuator", '<adhesion name="pad" body="s6" gain="5" ctrlrange="0 1"/>'),)),
)


def _push_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    def forces(drive: int, _tendon: int) -> Array:
        return robot.force_n(robot.driven.drives[drive])

    if robot.evidence is None:
        return None
    shown = actuator_signal(robot, fault, "force, pushing up", "N", forces)
    return None if shown is None else shown.model_copy(update={"limits": (0.0,)})


TENDON_PUSHES = Rule(
    code="tendon_pushes",
    stage=Stage.SCOPE,
    finds="An actuator pushes on a spatial tendon.",
    why="A cable can only pull: half of what the simulated actuator does, no built one can.",
    limit=f"greatest push / greatest pull of an actuator: at most {PUSH_SHARE:g}",
    check=find_out_of_scope_faults,
    unit="of its greatest pull",
    cure='Let force times gear be negative: a motor with gear="-1", ctrlrange="0 F" and no forcerange, or a servo with '
    'gear 1 and forcerange="-F 0".',
    explains=("tendon_slack", "few_bent_joints"),
    explained_by=("ctrlrange_missing",),
    signal=_push_signal,
    example=Example((('ctrlrange="0 20"', 'ctrlrange="-20 20"'),)),
)


def _short_cables() -> tuple[tuple[str, str], ...]:
    """Return changes to the example arm that add a driven cable along each single joint."""
    tendons = "\n".join(
        f'    <spatial name="own{index}"><site site="front{index - 1}"/><site site="front{index}"/></spatial>'
        for index in range(1, 7)
    )
    motors = "\n".join(
        f'    <motor name="pull{index}" tendon="own{index}" gear="-1" ctrlrange="0 20"/>' for index in range(1, 7)
    )
    return ("  </tendon>", f"{tendons}\n  </tendon>"), ("  </actuator>", f"{motors}\n  </actuator>")


FULLY_ACTUATED = Rule(
    code="fully_actuated",
    stage=Stage.SCOPE,
    finds="The actuators command every degree of freedom on its own.",
    why="A continuum robot is underactuated: its shape follows from a few cables and the stiffness of its backbone.",
    limit="independent actuators: fewer than the degrees of freedom inside the robot",
    check=find_out_of_scope_faults,
    unit="independent actuators",
    cure="Drive several joints with one tendon and leave the rest to the stiffness of the backbone.",
    example=Example(_short_cables()),
)
