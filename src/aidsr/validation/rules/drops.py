"""Rules for robots that fall instead of staying at their initial position."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2, string_ends
from aidsr.validation.consequences import COLLAPSE, NO_MOTION, SHAKING
from aidsr.validation.curves import (
    MAX_CURVES,
    OF_LENGTH,
    SETTLING,
    Array,
    find_body,
    make_signal,
)
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.signals import Signal

DROP_SHARE = 0.3
"""Largest fall / L of a root that does not land. For a root that lands, the same limit applies to the clearance below
it in the reference pose, because a standing robot may topple. Our choice."""
_LANDED_SPEED = 0.3
"""Speed of the root / sqrt(g L) below which a fall has ended. Our choice."""
_SINKING_STEPS = 30
"""Steps of the search for the clearance, each a hundredth of L: thinner than the parts of robots and grounds. Our
choice."""
_UPHOLDING = 0.3
"""Cosine between gravity and a contact's normal above which the contact supports weight; a wall beside a robot does
not. Our choice."""
_WITH_GRAVITY = 0
_TRAVELLING = (int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE))
_OF_JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)


def _find_drops(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find roots that do not stay at their initial position: that fall without end, or drop before they land.

    Only roots with joints of their own can drop; joints of the environment that carry the robot do not count.
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
                continue  # it stood on the ground or just above it and toppled
            first = int(np.argmax(path > DROP_SHARE * robot.length_m))
            found = _Drop(robot.body(root), float(path[-1]) / robot.length_m, (first + 1) * evidence.settle.frame_s)
            drops.setdefault(landed, []).append(found)
    for landed, dropped in drops.items():
        yield _drop_fault(robot, dropped, landed)


def _held_roots(robot: RobotUnderTest) -> Iterator[int]:
    """Yield the roots that motors of their own joints or a passive tendon to another root or to the world hold.

    A motor that turns a root does not count if the root also has a free or slide joint without a motor.
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
    for ends in string_ends(robot.model, robot.structure):
        if len(ends) > 1:
            yield from ends


def _clearance_m(robot: RobotUnderTest, root: int, down: Array) -> float:
    """Return the distance that a root and its descendants can sink from the reference pose until something supports it.

    Contacts with the surroundings count if their normal is close enough to the direction of gravity to support weight.

    Returns:
        Distance [m], at most `DROP_SHARE` L.
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
    """A root that fell.

    Attributes:
        name: Name of the root body.
        share: Fall at the end of settling / L.
        first_time_s: Time at which the fall exceeded `DROP_SHARE` L [s].
    """

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
