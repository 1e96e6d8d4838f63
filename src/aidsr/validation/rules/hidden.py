"""Rules for faults that contacts in the reference pose do not show: overlaps without contact, and keyframes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim.couplings import read_couplings
from aidsr.sim.extent import UNBOUNDED, half_width_m
from aidsr.sim.structure import NEIGHBOURS, neighbours
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage

HIDDEN_SHARE = 0.5
"""Largest overlap / thickness of the thinner part, for parts without contact. Our choice: sleeves and guides overlap
less."""
_NOT_COMPARED = (*UNBOUNDED, int(mujoco.mjtGeom.mjGEOM_MESH))
"""Types of geoms without an overlap; the convex hull of a mesh does not show whether the shape itself overlaps."""
_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
_OUTSIDE_SHARE = 0.05
"""Distance beyond a joint's range / size of the range, above which it is not a rounding error. Our choice."""


def _find_hidden_overlaps(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find parts of the robot that overlap although they are not neighbours, without a contact between them."""
    model, data = robot.model, robot.drawn
    touching = {frozenset((int(contact.geom1), int(contact.geom2))) for contact in data.contact}
    near = neighbours(model, robot.structure)
    worst: dict[tuple[str, str], tuple[float, float]] = {}
    solid = [geom for geom in robot.structure.geoms if int(model.geom_type[geom]) not in _NOT_COMPARED]
    for one, other in combinations(solid, 2):
        apart_m = float(np.linalg.norm(data.geom_xpos[one] - data.geom_xpos[other]))
        if apart_m > model.geom_rbound[one] + model.geom_rbound[other] or frozenset((one, other)) in touching:
            continue
        bodies = int(model.geom_bodyid[one]), int(model.geom_bodyid[other])
        if bodies[1] in near[bodies[0]]:
            continue
        depth_m = -float(mujoco.mj_geomDistance(model, data, one, other, 0.0, None))
        thickness_m = 2 * min(half_width_m(model, geom) for geom in (one, other))
        if depth_m > HIDDEN_SHARE * thickness_m > 0:
            worst[robot.body(bodies[0]), robot.body(bodies[1])] = depth_m / thickness_m, thickness_m
    if worst:
        share, thickness_m = max(worst.values())
        yield OVERLAP_HIDDEN.fault(
            "parts of different places stand in each other in the drawn pose, and may not touch",
            names=dict.fromkeys(name for pair in worst for name in pair),
            measured=share,
            limit=HIDDEN_SHARE,
            whole=thickness_m,
            whole_unit="m",
            likely_cause="contype, conaffinity or <exclude> switch off the contact that would show it",
        )


OVERLAP_HIDDEN = Rule(
    code="overlap_hidden",
    stage=Stage.TOPOLOGY,
    finds="Parts of different places stand in each other, and contacts between them are switched off.",
    why="Such a robot moves through itself in simulation and cannot be built.",
    limit=f"overlap / thickness of the thinner part, for parts more than {NEIGHBOURS} steps apart that may not touch: "
    f"at most {HIDDEN_SHARE:g}; always a warning, since shapes that collide are often coarser than what is built",
    check=_find_hidden_overlaps,
    severity="warning",
    unit="of the thinner part",
    cure="Move the parts apart; leave contacts between parts that are not neighbours switched on.",
    example=Example(
        (
            (
                '<geom name="g6"/>',
                '<geom name="g6"/>\n'
                '                  <geom name="rod" size="0.004 0.02" pos="0 0 -0.06" contype="0" conaffinity="0"/>',
            ),
        )
    ),
)


def _find_wrong_keyframes(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find keyframes that put joints outside their ranges.

    It is only a warning if all these joints are coupled to another joint by an equality, which corrects them.
    """
    model, following = robot.model, {coupling.joint for coupling in read_couplings(robot.model)}
    free: set[str] = set()
    outside: dict[str, float] = {}
    for key in range(model.nkey):
        for joint in robot.structure.joints:
            if not model.jnt_limited[joint] or int(model.jnt_type[joint]) not in (_HINGE, _SLIDE):
                continue
            low, high = (float(end) for end in model.jnt_range[joint])
            value = float(model.key_qpos[key, model.jnt_qposadr[joint]])
            beyond = max(low - value, value - high) / (high - low)
            if beyond > _OUTSIDE_SHARE:
                outside[robot.joint(joint)] = max(outside.get(robot.joint(joint), 0.0), beyond)
                free |= {robot.joint(joint)} if joint not in following else set()
    if outside:
        yield KEYFRAME_OUT_OF_RANGE.fault(
            "a keyframe puts these joints outside their ranges",
            names=outside,
            severity="error" if free else "warning",
            measured=max(outside.values()),
            limit=_OUTSIDE_SHARE,
            likely_cause="qpos is in degrees, or in another order than the joints",
        )


KEYFRAME_OUT_OF_RANGE = Rule(
    code="keyframe_out_of_range",
    stage=Stage.RANGES,
    finds="A keyframe starts with joints outside their ranges.",
    why="Whoever resets to it lets the limits throw the robot back. Keyframes are always in radians and metres.",
    limit=f"way beyond the range / the range: at most {_OUTSIDE_SHARE:g}; a warning where only joints that an equality "
    "couples to another are outside",
    check=_find_wrong_keyframes,
    unit="ranges",
    cure="Write qpos in radians, one number for each joint in the order of the document, within the ranges.",
    example=Example(
        (("</mujoco>", '  <keyframe>\n    <key name="bent" qpos="20 20 20 20 20 20"/>\n  </keyframe>\n</mujoco>'),)
    ),
)
