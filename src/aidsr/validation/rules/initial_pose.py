"""Rules for the reference pose ("drawn pose" in messages): overlaps, tendon limits, parts that cannot touch."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim.extent import half_width_m
from aidsr.sim.overlap import OVERLAP_LENGTH, OVERLAP_NOTICED, OVERLAP_SHARE
from aidsr.sim.poses import bent_pose
from aidsr.validation.consequences import COLLAPSE, FALL, NO_MOTION, SHAKING
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage

_OVERLAP_LEVER = 0.1
"""Lever of an overlap's contact force about every joint / thickness of the thinner part, below which the force can turn
no joint: for example a round end that reaches into its base. Our choice."""
TENDON_LIMIT_SHARE = 0.02
"""Largest distance of the length in the reference pose from the tendon's range / that length. Our choice."""

_TURNING = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL))
_BENT_RAD = 0.2
"""Bend of each joint at which the levers of overlaps are checked again: contact forces may be in balance in the
reference pose only."""


_CURE_WITHIN = (
    "Move or shorten the parts, or add <contact><exclude body1=... body2=.../></contact> for neighbours that are meant "
    "to meet."
)
_CURE_OUTSIDE = "Place the robot farther away or turned, or make the overlapping parts smaller."


def _find_overlaps(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find overlaps of the robot with itself or its surroundings in the reference pose, beyond rounding errors.

    In MuJoCo, parents and children do not collide, unless the parent is fixed to the world. If the contact force
    between two robot parts passes through every joint, as between a round end and the base it reaches into, it turns
    no joint, and the overlap is only a warning: its friction still holds the joint a little.
    """
    everywhere = list(overlaps(robot))
    for severity in ("error", "warning"):
        found = [overlap for overlap in everywhere if overlap.acts == (severity == "error")]
        if not found:
            continue
        worst = max(found, key=lambda overlap: overlap.share)
        measured, limit, unit, whole_m = worst.excess(robot)
        others = len({overlap.names for overlap in found}) - 1
        yield INITIAL_PENETRATION.fault(
            severity="error" if severity == "error" else "warning",
            names=tuple(dict.fromkeys(name for overlap in found for name in overlap.names)),
            measured=measured,
            limit=limit,
            unit=unit,
            whole=whole_m,
            whole_unit="m",
            message=f"{worst.names[0]} overlaps {worst.names[1]} by {1000 * worst.depth_m:.3g} mm in the drawn pose"
            + (f", and {others} more pairs overlap" if others else ""),
            cure=_CURE_OUTSIDE if worst.outside else _CURE_WITHIN,
            first_time_s=0.0,
        )


INITIAL_PENETRATION = Rule(
    code="initial_penetration",
    stage=Stage.INITIAL_POSE,
    finds="A part of the robot overlaps another, or something around it, in the drawn pose.",
    why="Contacts push overlapping parts out of each other with forces that no actuator has: the robot springs, "
    "shakes or "
    "jams. A warning where two parts of the robot overlap and the force between them passes through every joint, "
    "as with "
    "a round end drawn into its base: that turns nothing, but its friction holds the joint a little.",
    limit=f"overlap / thickness of the thinner part: at most {OVERLAP_SHARE:g}, where it is more than "
    f"{OVERLAP_NOTICED:g} "
    f"of the robot's length; overlap / the robot's length: at most {OVERLAP_LENGTH:g}",
    check=_find_overlaps,
    cure=_CURE_WITHIN,
    explains=(*COLLAPSE, *SHAKING, "driven_overlap", *NO_MOTION),
    example=Example((('pos="0 0 -0.011"', 'pos="0 0 0"'),)),
)


@dataclass(frozen=True)
class Overlap:
    """A contact that is too deep.

    Attributes:
        geoms: Ids of the two geoms.
        names: Names of the two geoms.
        depth_m: Depth of the contact [m].
        share: Depth / thickness of the thinner geom.
        outside: Whether one of the geoms does not belong to the robot.
        acts: Whether the contact force can move the robot; True if `outside`.
    """

    geoms: tuple[int, int]
    names: tuple[str, str]
    depth_m: float
    share: float
    outside: bool
    acts: bool

    def excess(self, robot: RobotUnderTest) -> tuple[float, float, str, float]:
        """Return the limit that is exceeded: measured value, limit, their unit, and the length of 1 unit [m]."""
        relative = self.depth_m / robot.length_m
        if _is_too_thick(self.share, relative):
            return self.share, OVERLAP_SHARE, "of the thinner part", self.depth_m / self.share
        return relative, OVERLAP_LENGTH, "of the robot's length", robot.length_m


def overlaps(robot: RobotUnderTest) -> Iterator[Overlap]:
    """Yield the contacts of the robot in the reference pose that are too deep."""
    bent = bent_pose(robot.model, robot.structure, _BENT_RAD)
    ours = [geom for geom in robot.structure.geoms if _is_held_together(robot, geom)]
    for contact in robot.driven.start.contact:
        geoms = int(contact.geom1), int(contact.geom2)
        depth_m = -float(contact.dist)
        if depth_m <= 0 or not any(geom in ours for geom in geoms):
            continue
        thickness_m = 2 * min(half_width_m(robot.model, geom) for geom in geoms)
        share, relative = depth_m / thickness_m, depth_m / robot.length_m
        if _is_too_thick(share, relative) or relative > OVERLAP_LENGTH:
            outside = any(geom not in robot.structure.geoms for geom in geoms)
            lever_m = max(_lever_m(robot, data, geoms) for data in (robot.driven.start, bent))
            acts = outside or lever_m > _OVERLAP_LEVER * thickness_m
            yield Overlap(geoms, (robot.geom(geoms[0]), robot.geom(geoms[1])), depth_m, share, outside, acts)


def _is_held_together(robot: RobotUnderTest, geom: int) -> bool:
    """Return whether a geom is in a kinematic tree that has moving bodies, or in a scene.

    In a robot tested alone, trees without moving bodies are furniture of the surroundings.
    """
    model, structure = robot.model, robot.structure
    root = int(model.body_rootid[model.geom_bodyid[geom]])
    return structure.is_scene or any(int(model.body_rootid[body]) == root for body in structure.moving)


def _is_too_thick(share: float, relative: float) -> bool:
    """Return whether an overlap is too deep for the thinner part, and deeper than rounding errors.

    Args:
        share: Depth / thickness of the thinner part.
        relative: Depth / L.
    """
    return share > OVERLAP_SHARE and relative > OVERLAP_NOTICED


def _lever_m(robot: RobotUnderTest, data: mujoco.MjData, geoms: tuple[int, int]) -> float:
    """Return the largest lever about any joint of the normal forces between two geoms [m].

    Infinite if a force acts on a slide or free joint.
    """
    model, largest = robot.model, 0.0
    bodies = [int(model.geom_bodyid[geom]) for geom in geoms]
    turning = np.isin(model.jnt_type[model.dof_jntid], _TURNING)
    for contact in data.contact:
        if {int(contact.geom1), int(contact.geom2)} != set(geoms):
            continue
        jacobians = np.zeros((2, 3, model.nv))
        for jacobian, body in zip(jacobians, bodies, strict=True):
            mujoco.mj_jac(model, data, jacobian, None, contact.pos, body)
        levers = np.abs(contact.frame[:3] @ (jacobians[1] - jacobians[0]))
        if (levers[~turning] > 0).any():
            return math.inf
        largest = max(largest, float(levers.max(initial=0.0)))
    return largest


def _find_violated_tendon_limits(robot: RobotUnderTest) -> Iterator[Fault]:
    model = robot.model
    for tendon in robot.structure.tendons:
        if not model.tendon_limited[tendon.id]:
            continue
        length_m = float(robot.driven.start.ten_length[tendon.id])
        low, high = model.tendon_range[tendon.id]
        outside = max(float(low) - length_m, length_m - float(high)) / max(abs(length_m), 1e-9)
        if outside > TENDON_LIMIT_SHARE:
            yield TENDON_LIMIT_VIOLATED.fault(
                names=(robot.tendon(tendon.id),),
                measured=outside,
                limit=TENDON_LIMIT_SHARE,
                whole=abs(length_m),
                whole_unit="m",
                message=f"length {length_m:.4g} m in the drawn pose, range {low:.4g} to {high:.4g} m",
                first_time_s=0.0,
            )


TENDON_LIMIT_VIOLATED = Rule(
    code="tendon_limit_violated",
    stage=Stage.INITIAL_POSE,
    finds="A tendon with a range is outside it in the drawn pose.",
    why="The limit pulls or pushes with whatever force it takes from the first time step on, and drags the robot "
    "along.",
    limit=f"rest length outside the tendon's range / length: at most {TENDON_LIMIT_SHARE:g}",
    check=_find_violated_tendon_limits,
    unit="of its length outside that range",
    cure="Let the range of the tendon include its length in the drawn pose, or leave the range out.",
    explains=(*COLLAPSE, *SHAKING, *NO_MOTION),
    example=Example((('<spatial name="front">', '<spatial name="front" range="0 0.1">'),)),
)


def _find_contact_disabled(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find robots that have a free root or a task with contact, but no moving geom that can touch anything.

    Source: MuJoCo documentation, Computation, "Collision detection": contype of one geom and conaffinity of another.
    """
    model, structure = robot.model, robot.structure
    if not (structure.free_roots or robot.needs_contact):
        return
    disabled = bool(model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CONTACT))
    others = [geom for geom in range(model.ngeom) if geom not in structure.geoms]
    moving = [geom for geom in structure.geoms if int(model.geom_bodyid[geom]) in structure.moving]
    if disabled or not any(_can_touch(model, geom, others) for geom in moving):
        yield CONTACT_DISABLED.fault(
            names=tuple(robot.body(root) for root in structure.roots),
            measured=0,
            limit=1,
            message="no moving geom of the robot can touch anything around it",
            likely_cause="contacts are switched off in <option>" if disabled else "contype and conaffinity are 0",
        )


def _can_touch(model: mujoco.MjModel, geom: int, others: list[int]) -> bool:
    if not others:  # without other geoms, check whether a geom with default settings could be touched
        return bool(model.geom_contype[geom] & 1 or model.geom_conaffinity[geom] & 1)
    return any(
        model.geom_contype[geom] & model.geom_conaffinity[other]
        or model.geom_contype[other] & model.geom_conaffinity[geom]
        for other in others
    )


CONTACT_DISABLED = Rule(
    code="contact_disabled",
    stage=Stage.INITIAL_POSE,
    finds="No moving geom of a robot that is free, or whose task needs touch, can touch anything around it.",
    why="It falls through the ground, or through what it shall hold.",
    limit="moving geoms that can touch anything, where the robot is free or `needs_contact`: at least 1",
    check=_find_contact_disabled,
    unit="moving geoms that can touch",
    cure="Leave contype and conaffinity at 1 for the outer geoms, and keep robot parts apart with <exclude>.",
    explains=FALL,
    example=Example(
        (('mass="0.01"/>', 'mass="0.01" contype="0" conaffinity="0"/>'),), arguments={"needs_contact": True}
    ),
)
