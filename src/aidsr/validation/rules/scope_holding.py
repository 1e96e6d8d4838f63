"""Scope rules for anything other than its limbs that holds, carries or moves the robot."""

from __future__ import annotations

import numpy as np

from aidsr.sim.scope_holding import FREE_TURN_RAD, LOADED_SHARE, SAME_LINE, SPRING_SHARE
from aidsr.validation.consequences import NO_MOTION
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.scope_check import find_out_of_scope_faults, inside

WHEEL = Rule(
    code="wheel",
    stage=Stage.SCOPE,
    finds="A joint turns like a wheel on its axle, driven or not: most of a turn or more, and no spring returns it.",
    why="What rolls carries the robot wherever any push sends it. Wheels that only turn one way are wheels too.",
    limit=f"joints with a range above {np.degrees(FREE_TURN_RAD):g} deg, whose spring holds less than "
    f"{SPRING_SHARE:g} m g L at a quarter turn: 0; hinges in series about one line, within {SAME_LINE:g} L, count as "
    "one",
    check=find_out_of_scope_faults,
    unit="axles",
    cure="Give the joint a range and a spring, as a segment of a limb has, or fix the part to its parent.",
    example=Example(
        (
            inside(
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
    limit=f"energy of all springs in the initial pose / (m g L): at most {LOADED_SHARE:g}; negative stiffness: "
    "none; start outside the range: at most 0.02 rad; springs of joints and tendons that turn or slide what no cable "
    "bends, loaded beyond twice the weight behind them: none. A polynomial stiffness counts as what it is within the "
    "joint's range",
    check=find_out_of_scope_faults,
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
    check=find_out_of_scope_faults,
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
    check=find_out_of_scope_faults,
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
    check=find_out_of_scope_faults,
    unit="joints",
    cure="Leave the constraint out, or draw the locked part as one body.",
    example=Example((("  <tendon>", '  <equality>\n    <joint joint1="j3"/>\n  </equality>\n  <tendon>'),)),
)
