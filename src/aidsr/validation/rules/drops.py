"""Does the robot stay where it was put, or fall."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.validation.consequences import COLLAPSE, NO_MOTION, SHAKING
from aidsr.validation.curves import (
    MAX_CURVES,
    OF_LENGTH,
    SETTLING,
    Array,
    find_body,
    make_signal,
)
from aidsr.validation.protocol import STANDARD_GRAVITY_M_S2
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.rules.topology import string_ends
from aidsr.validation.signals import Signal

DROP_SHARE = 0.3
"""Fall of a root / L: the whole of one that does not land, of another what is below it in the drawn pose, since what
stands may topple. Our choice."""
_LANDED_SPEED = 0.3
"""Speed of the root / sqrt(g L) below which a fall has ended. Our choice."""
_SINKING_STEPS = 30
"""Each is a hundredth of L: thinner than what robots and grounds are made of. Our choice."""
_UPHOLDING = 0.3
"""Cosine between gravity and a contact's normal from where the contact carries: a wall beside a robot does not. Our
choice."""
_WITH_GRAVITY = 0
_TRAVELLING = (int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE))
_OF_JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)


def _find_drops(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find roots that do not stay where they were put: that fall for ever, or land from above.

    Environment joints that carry the robot are forgiven: only roots with joints of their own can drop.
    """
    model, evidence = robot.model, robot.driven
    down = np.array(model.opt.gravity)
    if not down.any() or not robot.settled:
        return
    down /= np.linalg.norm(down)
    held = set(_held_roots(robot))
    drops: dict[bool, list[_Drop]] = {}
    for root in robot.structure.roots:
        if root not in robot.structure.moving or root in held:
            continue
        path = (evidence.settle.fields["xpos"][_WITH_GRAVITY, :, root] - evidence.start.xpos[root]) @ down
        if path[-1] > DROP_SHARE * robot.length_m:
            speed = float(evidence.settle.speed_m_s[_WITH_GRAVITY, -1, root])
            landed = speed < _LANDED_SPEED * math.sqrt(STANDARD_GRAVITY_M_S2 * robot.length_m)
            if landed and _clearance_m(robot, root, down) < DROP_SHARE * robot.length_m:
                continue  # it stood on the ground or just above it and toppled, as a limp animal does
            first = int(np.argmax(path > DROP_SHARE * robot.length_m))
            found = _Drop(robot.body(root), float(path[-1]) / robot.length_m, (first + 1) * evidence.settle.frame_s)
            drops.setdefault(landed, []).append(found)
    for landed, dropped in drops.items():
        yield _drop_fault(robot, dropped, landed)


def _held_roots(robot: RobotUnderTest) -> Iterator[int]:
    """Roots that something else than the ground holds: motors of their own joints, or a string elsewhere.

    A motor that turns a root does not hold what a slide or free joint lets go.
    """
    model = robot.model
    driven = {
        int(model.actuator_trnid[actuator, 0])
        for actuator in robot.structure.actuators
        if int(model.actuator_trntype[actuator]) == _OF_JOINT
    }
    for root in robot.structure.roots:
        first, count = int(model.body_jntadr[root]), int(model.body_jntnum[root])
        joints = set(range(first, first + count))
        loose = {joint for joint in joints - driven if int(model.jnt_type[joint]) in _TRAVELLING}
        if joints & driven and not loose:
            yield root
    for ends in string_ends(robot):
        if len(ends) > 1:
            yield from ends


def _clearance_m(robot: RobotUnderTest, root: int, down: Array) -> float:
    """How far what hangs from a root can sink from the drawn pose before it touches what is around the robot [m].

    Up to `DROP_SHARE` L; that where nothing is below. What stands beside it carries nothing, nor what touches nothing.
    """
    model, most_m, data = robot.model, DROP_SHARE * robot.length_m, copy.copy(robot.driven.start)
    below = [body for body in range(model.nbody) if int(model.body_rootid[body]) == root]
    hanging = {geom for geom in robot.structure.geoms if int(model.geom_bodyid[geom]) in below}
    around = set(range(model.ngeom)) - set(robot.structure.geoms)
    step_m = most_m / _SINKING_STEPS
    for k in range(_SINKING_STEPS):
        mujoco.mj_collision(model, data)
        for contact in data.contact:
            one, other = int(contact.geom1), int(contact.geom2)
            apart = (one in hanging and other in around) or (other in hanging and one in around)
            if apart and contact.dist <= 0 and abs(float(contact.frame[:3] @ down)) > _UPHOLDING:
                return k * step_m
        for places in (data.xpos, data.xipos):
            places[below] += step_m * down
        data.geom_xpos[sorted(hanging)] += step_m * down
    return most_m


@dataclass(frozen=True)
class _Drop:
    """A root that fell: by how much / L, and when that was too much."""

    name: str
    share: float
    first_time_s: float


def _drop_fault(robot: RobotUnderTest, dropped: list[_Drop], landed: bool) -> Fault:
    rule = BASE_NOT_ATTACHED if landed else FREE_FALL
    return rule.fault(
        names=tuple(each.name for each in dropped),
        measured=max(each.share for each in dropped),
        limit=DROP_SHARE,
        whole=robot.length_m,
        whole_unit="m",
        message="the root drops and lands" if landed else "the root falls and does not land",
        likely_cause="the root has a free or slide joint and starts above the ground"
        if landed
        else "the root has a free or slide joint and nothing below it that it can touch",
        first_time_s=min(each.first_time_s for each in dropped),
    )


def _drop_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    down = np.array(robot.model.opt.gravity)
    down /= np.linalg.norm(down)
    evidence = robot.driven
    curves: dict[str, Array] = {}
    for name in fault.names[:MAX_CURVES]:
        root = find_body(robot, name)
        way = (evidence.settle.fields["xpos"][0, :, root] - evidence.start.xpos[root]) @ down
        curves[name] = way / robot.length_m
    frame_s = evidence.settle.frame_s
    return make_signal("fall", OF_LENGTH, SETTLING, frame_s, curves, (DROP_SHARE,), fault.first_time_s)


_CURE_FALL = "Remove the root's joint to fix it, or start it on the ground with contacts enabled."

FREE_FALL = Rule(
    code="free_fall",
    stage=Stage.PASSIVE,
    finds="The root of the robot falls and does not land.",
    why="It has a free or slide joint, and nothing below it that it can touch.",
    limit=f"fall of a root with joints of its own / the robot's length: at most {DROP_SHARE:g}",
    check=_find_drops,
    unit="of the robot's length",
    cure=_CURE_FALL,
    explains=(*COLLAPSE, *SHAKING, *NO_MOTION),
    blame="integrator",
    signal=_drop_signal,
    example=Example(
        (
            (
                '<body name="base">',
                '<body name="base">\n      <joint name="lift" type="slide" axis="0 0 1" stiffness="0" damping="0" '
                'limited="false"/>',
            ),
        )
    ),
)

BASE_NOT_ATTACHED = Rule(
    code="base_not_attached",
    stage=Stage.PASSIVE,
    finds="The root of the robot drops before it lands.",
    why="It has a free or slide joint and starts above the ground, so it does not stand where it was put.",
    limit=f"fall of a root with joints of its own / the robot's length: at most {DROP_SHARE:g}; one that touches what "
    "is below it before it sinks that far may topple",
    check=_find_drops,
    unit="of the robot's length",
    cure=_CURE_FALL,
    explains=(*COLLAPSE, *SHAKING, *NO_MOTION),
    blame="integrator",
    signal=_drop_signal,
    example=Example(
        (
            ('<body name="base">', '<body name="base">\n      <freejoint/>'),
            ("<worldbody>", '<worldbody>\n    <geom name="floor" type="plane" size="1 1 0.1" pos="0 0 -0.2"/>'),
        )
    ),
)
