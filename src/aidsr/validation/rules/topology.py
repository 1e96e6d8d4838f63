"""Is it one continuum robot: soft chains, connected, without gaps, with fewer actuators than it can move."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim.structure import Chain, joined_bodies
from aidsr.validation.robot_under_test import RobotUnderTest


def no_soft_chain(robot: RobotUnderTest) -> Iterator[Fault]:
    """Somewhere three or more joints follow each other.

    Source: our choice; two joints in series are a linkage, which has no curvature that could vary along it.
    """
    if robot.structure.longest_series < robot.limits.series_joints:
        yield Fault(
            code="no_soft_chain",
            layer="structure",
            severity="error",
            measured=robot.structure.longest_series,
            limit=robot.limits.series_joints,
            unit="joints in series",
            message="no limb has three or more hinge or ball joints one after the other",
            likely_cause="segments stand side by side instead of one inside the other",
            cure="Nest each segment's <body> inside the one before it, each with its own hinge or ball joint.",
        )


def disconnected(robot: RobotUnderTest) -> Iterator[Fault]:
    """All parts hang together.

    Several bodies directly in the world are one robot when nothing but the world holds them and they stand side by
    side, as fingers on a palm do; a free body beside another is a second robot.
    """
    roots = robot.structure.roots
    groups = [{root} for root in roots]
    for one, other in _links(robot):
        first, second = (next(group for group in groups if root in group) for root in (one, other))
        if first is not second:
            first |= second
            groups.remove(second)
    if len(groups) > 1:
        yield Fault(
            code="disconnected",
            layer="structure",
            severity="error",
            names=tuple(robot.body(min(group)) for group in groups),
            measured=len(groups),
            limit=1,
            unit="separate parts",
            message="these bodies and what hangs from them are not joined to each other",
            likely_cause="a <body> is closed too early, so that the next one hangs from the world",
            cure="Nest every body of the robot under one root body.",
        )


def _links(robot: RobotUnderTest) -> Iterator[tuple[int, int]]:
    """Pairs of roots that are joined: by an equality constraint, or standing side by side on the same ground."""
    roots = robot.structure.roots
    for bodies in sorted(map(sorted, joined_bodies(robot.model))):
        ends = [_root_of(robot, body) for body in bodies]
        if len(ends) == 2 and all(end in roots for end in ends):
            yield ends[0], ends[1]
    fixed = [root for root in roots if root not in robot.structure.free_roots]
    for k, one in enumerate(fixed):
        for other in fixed[k + 1 :]:
            if _side_by_side(robot, one, other):
                yield one, other


def _root_of(robot: RobotUnderTest, body: int) -> int:
    while body and body not in robot.structure.roots:
        body = int(robot.model.body_parentid[body])
    return body


def _side_by_side(robot: RobotUnderTest, one: int, other: int) -> bool:
    """Whether two roots held by the same body start at the same height."""
    model = robot.model
    if model.body_parentid[one] != model.body_parentid[other]:
        return False
    between = model.body_pos[other] - model.body_pos[one]
    return bool(abs(between[2]) <= robot.limits.root_level_share * robot.length_m)


def segments_gap(robot: RobotUnderTest) -> Iterator[Fault]:
    """Neighbouring segments of a chain touch, or nearly.

    Source: our choice; `mj_geomDistance` between the nearest geoms of both.
    """
    wide = [gap for chain in robot.structure.chains for gap in _gaps(robot, robot.drawn, chain)]
    if wide:
        share, body, spacing_m = max(wide)
        yield Fault(
            code="segments_gap",
            layer="structure",
            severity="error",
            names=tuple(robot.body(behind) for _, behind, _ in wide),
            measured=share,
            limit=robot.limits.gap_share,
            unit="of the segment's length",
            whole=spacing_m,
            whole_unit="m",
            message=f"empty space before these bodies, widest before {robot.body(body)}",
            likely_cause="a child's pos does not reach the end of its parent's geom",
            cure="Let each segment begin where the one before it ends.",
        )


def _gaps(robot: RobotUnderTest, data: mujoco.MjData, chain: Chain) -> Iterator[tuple[float, int, float]]:
    """Gaps / segment length that are too wide, with the body behind them and the segment's length [m]."""
    spacing_m = chain.spacing_m
    for before, body in zip(chain.bodies, chain.bodies[1:], strict=False):
        ours, theirs = _rigid_geoms(robot, body), _rigid_geoms(robot, before)
        if not ours or not theirs or spacing_m == 0:
            continue
        reach_m = 10 * spacing_m
        gap_m = min(mujoco.mj_geomDistance(robot.model, data, a, b, reach_m, None) for a in ours for b in theirs)
        if gap_m > robot.limits.gap_share * spacing_m:
            yield gap_m / spacing_m, body, spacing_m


def _rigid_geoms(robot: RobotUnderTest, body: int) -> list[int]:
    """Geoms of a body and of what is fixed to it."""
    weld = int(robot.model.body_weldid[body])
    return [
        geom for geom in robot.structure.geoms if int(robot.model.body_weldid[robot.model.geom_bodyid[geom]]) == weld
    ]


def fully_actuated(robot: RobotUnderTest) -> Iterator[Fault]:
    """A continuum robot has fewer independent actuators than ways to bend.

    Source: our choice, after the usual definition of a continuum robot as underactuated; rank of the actuators' moments
    over the degrees of freedom inside the robot.
    """
    model, structure = robot.model, robot.structure
    if structure.longest_series < robot.limits.series_joints:
        return
    data = robot.drawn
    inner = [dof for dof in range(model.nv) if _is_inner(robot, int(model.dof_jntid[dof]))]
    moments = np.zeros((model.nout, model.nv))
    mujoco.mju_sparse2dense(moments, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind)
    outputs = [int(model.actuator_outadr[actuator]) for actuator in structure.actuators]
    rank = int(np.linalg.matrix_rank(moments[np.ix_(outputs, inner)])) if outputs and inner else 0
    if inner and rank >= len(inner):
        yield Fault(
            code="fully_actuated",
            layer="structure",
            severity="error",
            names=tuple(robot.actuator(actuator) for actuator in structure.actuators),
            measured=rank,
            limit=len(inner) - 1,
            unit="independent actuators",
            message=f"the actuators command each of the {len(inner)} degrees of freedom on its own",
            cure="Drive several joints with one tendon and leave the rest to the stiffness of the backbone.",
        )


def _is_inner(robot: RobotUnderTest, joint: int) -> bool:
    return joint in robot.structure.joints and int(robot.model.jnt_type[joint]) != int(mujoco.mjtJoint.mjJNT_FREE)
