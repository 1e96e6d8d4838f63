"""Rule for robots on the ground that have no friction to push against."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco

from aidsr.core.artifacts import Fault
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage

LEAST_FRICTION = 0.1
"""Smallest coefficient of sliding friction; ice has 0.1 and less. Our choice."""
_FRICTIONLESS = 1
"""`condim` of a contact without friction."""


def _find_slippery_ground(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find free robots whose contacts with their surroundings all have too little friction after settling."""
    if not robot.structure.free_roots or not robot.settled:
        return
    model, data = robot.model, mujoco.MjData(robot.model)
    mujoco.mj_setState(model, data, robot.driven.settle.states[0], mujoco.mjtState.mjSTATE_INTEGRATION)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    ours = set(robot.structure.geoms)
    grips: dict[str, float] = {}
    for contact in data.contact:
        geoms = {int(contact.geom1), int(contact.geom2)}
        if len(geoms & ours) == 1:
            friction = 0.0 if int(contact.dim) == _FRICTIONLESS else float(contact.friction[0])
            name = robot.geom(next(iter(geoms & ours)))
            grips[name] = max(grips.get(name, 0.0), friction)
    if grips and max(grips.values()) < LEAST_FRICTION:
        yield NO_GRIP.fault(
            "nothing with which the robot stands on the ground has friction",
            names=grips,
            measured=max(grips.values()),
            limit=LEAST_FRICTION,
            likely_cause="friction or condim of its geoms, or of the ground with a higher priority, is too small",
        )


NO_GRIP = Rule(
    code="no_grip",
    stage=Stage.PASSIVE,
    finds="A robot on the ground slides on it without friction.",
    why="It has nothing to push off from: it wriggles on the spot whatever its actuators do.",
    limit=f"friction of the robot's contacts with the ground after settling: at least {LEAST_FRICTION:g} in one",
    check=_find_slippery_ground,
    unit="(coefficient of friction)",
    cure='Give feet and ground friction="1 0.005 0.0001" and condim="3".',
    example=Example(
        (
            (
                "<worldbody>",
                '<worldbody>\n    <geom type="plane" size="0 0 1" pos="0 0 0" friction="0.01" priority="1"/>',
            ),
            ('<body name="base">', '<body name="base" pos="0 0 0.0221" euler="0 90 0">\n      <freejoint/>'),
        )
    ),
)
