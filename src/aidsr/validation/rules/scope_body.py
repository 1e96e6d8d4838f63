"""Scope rules for robots that are mostly rigid or whose cables do not bend a soft limb."""

from __future__ import annotations

from aidsr.sim.limbs import SERIES_JOINTS
from aidsr.sim.scope_actuation import HEAVIEST_SHARE, LEVER_SHARE, RIGID_SHARE, UNMOVED_SHARE
from aidsr.validation.consequences import NO_MOTION
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.scope_check import added, find_out_of_scope_faults, inside

FEW_BENT_JOINTS = Rule(
    code="few_bent_joints",
    stage=Stage.SCOPE,
    finds="No cable bends three or more joints one after the other.",
    why="A limb whose joints are as good as rigid, or that no cable passes, is a rod or a decoration.",
    limit="joints in series that the strongest cable bends by their share of 6 degrees, within ten seconds, against "
    "springs, damping, friction and stops of joints and of tendons, locks and gears, and that share the bending: at "
    f"least {SERIES_JOINTS}",
    check=find_out_of_scope_faults,
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
    finds="A cable turns a rigid part on a hinge of its own, or slides one, directly or through a limb's joints.",
    why="Then a mechanism of rigid parts does the work, beside a soft limb that is there for show.",
    limit="bodies that cables, or joint or tendon equalities with the joints of a limb on a cable, move on joints "
    "outside limbs of three or more bent joints: 0; the same for connect and weld constraints, which may join limbs of "
    "three or more joints, bent by cables or not",
    check=find_out_of_scope_faults,
    unit="bodies",
    cure="Make that part a soft limb of three or more joints, or let the cables of a soft limb move it.",
    explained_by=("zero_gear", "tendon_one_body", "tendon_no_moment"),
    example=Example(
        (
            inside(
                "base",
                '<site name="jaw0" pos="0.06 0.01 0"/>\n        <body name="jaw" pos="0.06 0 0.01"><joint name="jaw"'
                ' axis="1 0 0" stiffness="0.3"/><geom size="0.004 0.03" pos="0 0 0.03"/>'
                '<site name="jaw1" pos="0 0.01 0.02"/></body>',
            ),
            added("tendon", '<spatial name="jaw"><site site="jaw0"/><site site="jaw1"/></spatial>'),
            added("actuator", '<motor name="pull_jaw" tendon="jaw" gear="-1" ctrlrange="0 20"/>'),
        )
    ),
)

MOSTLY_RIGID = Rule(
    code="mostly_rigid",
    stage=Stage.SCOPE,
    finds="A rigid part makes up most of the robot, in length or in mass, or no cable moves most of its mass.",
    why="A basket, a rod, a heavy hull or a jaw on a limb's first joint does such a robot's work, and its soft limb is "
    "there for show.",
    limit=f"extent of the largest rigid part / length of the limbs that cables bend: at most {RIGID_SHARE:g}, a "
    f"post between mount and limb aside; distance of a rigid part from its joint, where fewer than {SERIES_JOINTS} "
    f"joints that cables bend carry it / length of its limb: at most {LEVER_SHARE:g}; mass of the heaviest rigid part "
    f"/ moving mass: at most {HEAVIEST_SHARE:g}; mass that no cable of a mounted robot moves: at most "
    f"{UNMOVED_SHARE:g}",
    check=find_out_of_scope_faults,
    unit="of the length that cables bend",
    cure="Make the rigid part smaller or lighter, or the soft limbs longer.",
    explained_by=("few_bent_joints", "mass_ratio"),
    example=Example(
        (inside("base", '<geom name="rod" type="capsule" size="0.008 0.25" pos="0.25 0 -0.03" euler="0 90 0"/>'),)
    ),
)
