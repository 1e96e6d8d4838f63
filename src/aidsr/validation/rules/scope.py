"""Is it a tendon-driven continuum robot: do cables and a soft body do the work, and nothing else.

What is measured, and from where it is a fault, stands in `aidsr.sim.scope`, which the evaluation of policies uses too.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim import scope
from aidsr.sim.soft_body import SERIES_JOINTS
from aidsr.validation.consequences import NO_MOTION
from aidsr.validation.curves import Array, actuator_signal
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
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


def _find_out_of_scope(robot: RobotUnderTest) -> Iterator[Fault]:
    for found in scope.find_out_of_scope(robot.model, robot.structure):
        rule = _RULES[found.code]
        yield rule.fault(
            found.message,
            names=found.names,
            measured=found.measured,
            limit=found.limit,
            unit=found.unit or rule.unit,
            whole=found.whole,
            whole_unit=found.whole_unit,
        )


def _added(element: str, text: str) -> tuple[str, str]:
    """A change to the example arm: text before the end of an element."""
    return f"  </{element}>", f"  {text}\n  </{element}>"


def _inside(body: str, text: str) -> tuple[str, str]:
    """A change to the example arm: text at the beginning of a body."""
    place = "" if body == "base" else ' pos="0 0 0.025"'
    return f'<body name="{body}"{place}>', f'<body name="{body}"{place}>\n        {text}'


NO_TENDONS = Rule(
    code="no_tendons",
    stage=Stage.SCOPE,
    finds="The robot has no tendons.",
    why="The validator, the Coder and the fabrication are about robots that cables bend.",
    limit="tendons of the robot: at least 1",
    check=_find_out_of_scope,
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
    check=_find_out_of_scope,
    unit="actuators",
    cure='Add <actuator> with one motor or position servo tendon="..." each.',
    explains=("tendons_not_actuated", "sensor_constant"),
    example=Example(((_MOTORS, ""),)),
)

NO_SENSORS = Rule(
    code="no_sensors",
    stage=Stage.SCOPE,
    finds="The robot has no sensors.",
    why="A policy sees the robot through its sensors alone.",
    limit="sensors of the robot: at least 1",
    check=_find_out_of_scope,
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
    check=_find_out_of_scope,
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
    limit=f"turning points in series, hinges about one point counted once: at least {SERIES_JOINTS}",
    check=_find_out_of_scope,
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
    limit="actuators of the robot on joints, cranks or the sum of fewer than three joints: 0",
    check=_find_out_of_scope,
    unit="actuators",
    cure='Drive the limb with cables: <motor tendon="..."> along three or more joints.',
    example=Example((_added("actuator", '<motor name="turn" joint="j1" ctrlrange="-0.2 0.2"/>'),)),
)

THRUSTER = Rule(
    code="thruster",
    stage=Stage.SCOPE,
    finds="An actuator pushes the robot from outside: a force at a site, or on its free joint.",
    why="Such a force pushes against nothing, as a jet does, and needs no body at all.",
    limit="actuators of the robot on sites or free joints: 0",
    check=_find_out_of_scope,
    unit="actuators",
    cure="Leave it out, and let cables move the robot.",
    example=Example((_added("actuator", '<motor name="jet" site="tip" gear="1 0 0 0 0 0" ctrlrange="0 1"/>'),)),
)

ADHESION = Rule(
    code="adhesion",
    stage=Stage.SCOPE,
    finds="An actuator of the robot sticks to what it touches.",
    why="An adhesive pad holds and climbs without a grip, so that the body does no work.",
    limit="adhesion actuators of the robot: 0",
    check=_find_out_of_scope,
    unit="actuators",
    cure="Leave it out, and let soft limbs hold by their shape and by friction.",
    example=Example((_added("actuator", '<adhesion name="pad" body="s6" gain="5" ctrlrange="0 1"/>'),)),
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
    limit=f"greatest push / greatest pull of an actuator: at most {scope.PUSH_SHARE:g}",
    check=_find_out_of_scope,
    unit="of its greatest pull",
    cure='Let commands only pull: motor gear="-1" with ctrlrange="0 F", or a servo with forcerange="-F 0".',
    explains=("tendon_slack", "few_bent_joints"),
    explained_by=("ctrlrange_missing",),
    signal=_push_signal,
    example=Example((('ctrlrange="0 20"', 'ctrlrange="-20 20"'),)),
)

WHEEL = Rule(
    code="wheel",
    stage=Stage.SCOPE,
    finds="A joint turns like a wheel on its axle, driven or not: most of a turn or more, and no spring returns it.",
    why="What rolls carries the robot wherever any push sends it. Wheels that only turn one way are wheels too.",
    limit=f"joints with a range above {np.degrees(scope.FREE_TURN_RAD):g} deg, whose spring holds less than "
    f"{scope.SPRING_SHARE:g} m g L at a quarter turn: 0",
    check=_find_out_of_scope,
    unit="axles",
    cure="Give the joint a range and a spring, as a segment of a limb has, or fix the part to its parent.",
    example=Example(
        (
            _inside(
                "base",
                '<body name="wheel" pos="0 0.05 0"><joint name="axle" limited="false" stiffness="0"/>'
                '<geom size="0.02 0.004" pos="0 0 0" mass="0.01"/></body>',
            ),
        )
    ),
)

LOADED_SPRING = Rule(
    code="loaded_spring",
    stage=Stage.SCOPE,
    finds="Springs are loaded in the initial pose, have a negative stiffness, or a joint starts outside its range.",
    why="What is stored before the start throws the robot without a cable's work, as a catapult does.",
    limit=f"energy of all springs in the initial pose / (m g L): at most {scope.LOADED_SHARE:g}; negative stiffness: "
    "none; start outside the range: at most 0.02 rad; springs of joints that no cable bends, loaded beyond twice the "
    "weight behind them: none",
    check=_find_out_of_scope,
    unit="m g L",
    cure="Let springref and springlength be where the joint or tendon is drawn, within the joint's range.",
    explained_by=("range_inverted_ignored", "passive_collapse"),
    example=Example(
        (
            ('<spatial name="front">', '<spatial name="front" stiffness="200" springlength="0.1">'),
            ('<spatial name="back">', '<spatial name="back" stiffness="200" springlength="0.1">'),
        )
    ),
)

OUTSIDE_FORCE = Rule(
    code="outside_force",
    stage=Stage.SCOPE,
    finds="Gravity compensation carries the robot, or its document makes wind.",
    why="A force from nowhere does what its body shall do. Wind that the environment makes is the environment's.",
    limit="force that carries the robot, and wind: 0",
    check=_find_out_of_scope,
    unit="N",
    cure="Leave out gravcomp and wind: make the robot lighter, or its limbs stiff enough to carry it.",
    example=Example((('<body name="s1">', '<body name="s1" gravcomp="1">'),)),
)

HELD_FROM_OUTSIDE = Rule(
    code="held_from_outside",
    stage=Stage.SCOPE,
    finds="A constraint, a cable or a rail holds the robot from outside its mount.",
    why="A weld that works like a magnet, a mocap body, a rail, or a cable to the world does what its limbs shall do.",
    limit="active equalities, cables, slides and mocap bodies between the robot and what is not the robot: 0",
    check=_find_out_of_scope,
    unit="holds",
    cure="Fix the root's <body> to the world or let it be free, and hold nothing else.",
    explains=("joint_locked", *NO_MOTION),
    explained_by=("free_fall", "base_not_attached"),
    example=Example(
        (("  <tendon>", '  <equality>\n    <connect body1="s6" anchor="0 0 0.025"/>\n  </equality>\n  <tendon>'),)
    ),
)

JOINT_LOCKED = Rule(
    code="joint_locked",
    stage=Stage.SCOPE,
    finds="An equality constraint leaves a joint no motion.",
    why="A limb that is locked is a rod, however many joints are drawn in it.",
    limit="hinge, ball and slide joints without any motion left: 0",
    check=_find_out_of_scope,
    unit="joints",
    cure="Leave the constraint out, or draw the locked part as one body.",
    example=Example((("  <tendon>", '  <equality>\n    <joint joint1="j3"/>\n  </equality>\n  <tendon>'),)),
)

CONTACT_MARGIN = Rule(
    code="contact_margin",
    stage=Stage.SCOPE,
    finds="A shape of the robot pushes what is still away from it.",
    why="With a wide margin it works from afar, like a field of force, and not by its body.",
    limit=f"margin of a geom / L: at most {scope.MARGIN_SHARE:g}",
    check=_find_out_of_scope,
    unit="of the robot's length",
    cure="Leave margin out.",
    example=Example((('<geom name="g6"/>', '<geom name="g6" margin="0.02"/>'),)),
)

GHOST_SHAPE = Rule(
    code="ghost_shape",
    stage=Stage.SCOPE,
    finds="A large part of the robot's shapes passes through what is around it.",
    why="An arm of which only the tip collides reaches through walls. Discs or a skin that collide stand for the "
    "backbone between them.",
    limit=f"length of moving shapes that collide with nothing, more than {scope.COVER_SHARE:g} L from one that does / "
    f"length of all: at most {scope.GHOST_SHARE:g}",
    check=_find_out_of_scope,
    unit="of the length of its shapes",
    cure="Leave contype, conaffinity and gap at their defaults.",
    explained_by=("contact_disabled",),
    example=Example(
        (('pos="0 0 0.0125" mass="0.01"/>', 'pos="0 0 0.0125" mass="0.01" contype="0" conaffinity="0"/>'),)
    ),
)

CONTACT_EXCLUDED = Rule(
    code="contact_excluded",
    stage=Stage.SCOPE,
    finds="A contact exclusion or pair is between the robot and its surroundings.",
    why="The environment decides how it is touched. Between parts of the robot exclusions are allowed, and where a "
    "limb begins on its mount.",
    limit="bodies of the robot with exclusions or pairs towards others: 0",
    check=_find_out_of_scope,
    unit="bodies",
    cure="Leave the exclusion or the pair out.",
    example=Example(
        (("  <tendon>", '  <contact>\n    <exclude body1="world" body2="s6"/>\n  </contact>\n  <tendon>'),)
    ),
)


FEW_BENT_JOINTS = Rule(
    code="few_bent_joints",
    stage=Stage.SCOPE,
    finds="No cable bends three or more joints one after the other.",
    why="A limb whose joints are as good as rigid, or that no cable passes, is a rod or a decoration.",
    limit="joints in series that the strongest cable bends by their share of 6 degrees, within ten seconds, against "
    f"springs, damping, friction and locks, and that share the bending: at least {SERIES_JOINTS}",
    check=_find_out_of_scope,
    unit="bent joints in series",
    cure="Lead a cable along three or more joints, beside the backbone, and make them soft enough for it.",
    explained_by=(
        "zero_gear",
        "tendon_one_body",
        "tendon_no_moment",
        "joint_range_too_small",
        "ctrlrange_missing",
        "held_from_outside",
        *NO_MOTION,
    ),
    example=Example(
        tuple((f'<joint name="j{index}"/>', f'<joint name="j{index}" stiffness="20"/>') for index in (1, 2, 3, 6))
    ),
)

CABLE_ON_LINKAGE = Rule(
    code="cable_on_linkage",
    stage=Stage.SCOPE,
    finds="A cable turns a rigid part on a hinge of its own, or slides one.",
    why="Then a mechanism of rigid parts does the work, beside a soft limb that is there for show.",
    limit="bodies that cables move on joints outside limbs of three or more bent joints: 0",
    check=_find_out_of_scope,
    unit="bodies",
    cure="Make that part a soft limb of three or more joints, or let the cables of a soft limb move it.",
    explained_by=("zero_gear", "tendon_one_body", "tendon_no_moment"),
    example=Example(
        (
            _inside(
                "base",
                '<site name="jaw0" pos="0.06 0.01 0"/>\n        <body name="jaw" pos="0.06 0 0.01"><joint name="jaw"'
                ' axis="1 0 0" stiffness="0.3"/><geom size="0.004 0.03" pos="0 0 0.03"/>'
                '<site name="jaw1" pos="0 0.01 0.02"/></body>',
            ),
            _added("tendon", '<spatial name="jaw"><site site="jaw0"/><site site="jaw1"/></spatial>'),
            _added("actuator", '<motor name="pull_jaw" tendon="jaw" gear="-1" ctrlrange="0 20"/>'),
        )
    ),
)

MOSTLY_RIGID = Rule(
    code="mostly_rigid",
    stage=Stage.SCOPE,
    finds="A rigid part makes up most of the robot, in length or in mass, or no cable moves most of its mass.",
    why="A basket, a rod or a heavy hull does such a robot's work, and its soft limb is there for show.",
    limit=f"extent of the largest rigid part / length of the limbs that cables bend: at most {scope.RIGID_SHARE:g}, a "
    f"post between mount and limb aside; mass of the heaviest rigid part / moving mass: at most "
    f"{scope.HEAVIEST_SHARE:g}; mass that no cable of a mounted robot moves: at most {scope.UNMOVED_SHARE:g}",
    check=_find_out_of_scope,
    unit="of the length that cables bend",
    cure="Make the rigid part smaller or lighter, or the soft limbs longer.",
    explained_by=("few_bent_joints", "mass_ratio"),
    example=Example(
        (_inside("base", '<geom name="rod" type="capsule" size="0.008 0.25" pos="0.25 0 -0.03" euler="0 90 0"/>'),)
    ),
)


def _short_cables() -> tuple[tuple[str, str], ...]:
    """Cables along one joint each of the example arm."""
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
    check=_find_out_of_scope,
    unit="independent actuators",
    cure="Drive several joints with one tendon and leave the rest to the stiffness of the backbone.",
    example=Example(_short_cables()),
)

_RULES = {value.code: value for value in list(vars().values()) if isinstance(value, Rule)}
