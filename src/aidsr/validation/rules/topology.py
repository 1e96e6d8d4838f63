"""Rules for robots that are not one connected body: separate parts, and gaps between segments."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import mujoco

from aidsr.core.artifacts import Fault
from aidsr.sim.geom_distance import geom_distance_m
from aidsr.sim.structure import Chain, joined_bodies, root_of, string_ends
from aidsr.validation.consequences import FALL, NO_MOTION
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage

GAP_SHARE = 0.5
"""Largest gap between neighbouring segments / segment length. At joints, geoms leave gaps of up to a fifth. Our choice.
"""
CARRIER_GAP_SHARE = 2.0
"""The same between a limb and the part that carries it: bases are often modelled as a thin plate. Our choice."""
_ROOT_LEVEL_SHARE = 0.02
"""Largest difference in height / L between bodies fixed to the world that stand side by side, as fingers do; less than
the segment length of a limb of 40 segments. Our choice."""


def _find_disconnected(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find parts of the robot that are not joined to each other.

    Several root bodies are one robot if something joins them, or if they are fixed side by side to the same parent, as
    fingers are to a palm. A free root that nothing joins to the others is a second robot. A fixed root without joints
    and cables belongs to the surroundings or was separated by mistake, and is a warning.
    """
    inert = set(_inert_roots(robot))
    lost = sorted(inert)
    roots = [root for root in robot.structure.roots if root not in inert]
    groups = [{root} for root in roots]
    for one, other in _links(robot):
        if inert & {one, other}:
            lost = [root for root in lost if root not in (one, other)]
            continue
        first, second = (next(group for group in groups if root in group) for root in (one, other))
        if first is not second:
            first |= second
            groups.remove(second)
    if len(groups) == 1 and lost:
        yield DISCONNECTED.fault(
            "nothing moves these bodies, and nothing joins them to the robot",
            names=map(robot.body, lost),
            measured=1 + len(lost),
            limit=1,
            severity="warning",
            likely_cause="a part of the surroundings, or a <body> that was closed too early",
        )
    if len(groups) > 1:
        yield DISCONNECTED.fault(
            "these bodies and what hangs from them are not joined to each other",
            names=(robot.body(min(group)) for group in groups),
            measured=len(groups),
            limit=1,
            likely_cause="a <body> is closed too early, so that the next one hangs from the world",
        )


def _inert_roots(robot: RobotUnderTest) -> Iterator[int]:
    """Yield the roots whose trees have neither joints nor cables; nothing if that holds for all roots."""
    model, structure = robot.model, robot.structure
    alive = {
        root_of(robot.model, robot.structure, body) for tendon in structure.tendons for body in tendon.bodies if body
    }
    alive |= {root_of(model, structure, int(model.jnt_bodyid[joint])) for joint in structure.joints}
    if alive:
        yield from (root for root in structure.roots if root not in alive)


def _links(robot: RobotUnderTest) -> Iterator[tuple[int, int]]:
    """Yield the pairs of roots that are joined: by an equality constraint, by a string, or fixed side by side."""
    roots = robot.structure.roots
    for bodies in sorted(map(sorted, joined_bodies(robot.model))):
        ends = [root_of(robot.model, robot.structure, body) for body in bodies]
        if len(ends) == 2 and all(end in roots for end in ends):
            yield ends[0], ends[1]
    for ends in string_ends(robot.model, robot.structure):
        yield from ((one, other) for one, other in pairwise(ends) if one in roots and other in roots)
    fixed = [root for root in roots if root not in robot.structure.free_roots]
    for k, one in enumerate(fixed):
        for other in fixed[k + 1 :]:
            if _side_by_side(robot, one, other):
                yield one, other


def _side_by_side(robot: RobotUnderTest, one: int, other: int) -> bool:
    """Return whether two roots have the same parent and start at about the same height."""
    model = robot.model
    if model.body_parentid[one] != model.body_parentid[other]:
        return False
    between = model.body_pos[other] - model.body_pos[one]
    return bool(abs(between[2]) <= _ROOT_LEVEL_SHARE * robot.length_m)


DISCONNECTED = Rule(
    code="disconnected",
    stage=Stage.TOPOLOGY,
    finds="The robot is in several parts that nothing joins.",
    why="Usually a <body> was closed too early, and the rest of the limb hangs in the air. Bodies side by side on the "
    "same level of the world are one robot, as fingers are; so are those that an active weld or connect joins.",
    limit="separate parts: at most 1; rigid free objects do not count, fixed ones are a warning",
    check=_find_disconnected,
    unit="separate parts",
    cure="Nest every body of the robot under one root body.",
    explains=(
        "no_soft_chain",
        "held_from_outside",
        "few_bent_joints",
        "segments_gap",
        "tendon_no_moment",
        "tendon_skips_segments",
        *FALL,
        *NO_MOTION,
    ),
    example=Example(
        (("  </worldbody>", '    <body name="lost" pos="0 0 0.3">\n      <geom/>\n    </body>\n  </worldbody>'),)
    ),
)


def _find_gaps(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find wide gaps between neighbouring segments of a chain, and between limbs and the parts that carry them.

    Source: our choice; `geom_distance_m` between the nearest geoms of both.
    """
    chains, data = robot.structure.chains, robot.drawn
    places = (
        (
            [gap for chain in chains for gap in _gap_to_carrier(robot, data, chain)],
            CARRIER_GAP_SHARE,
            "empty space between limbs and what carries them",
            "the pos of the limb's first body is not where its palm or base is",
        ),
        (
            [gap for chain in chains for gap in _gaps(robot, data, chain)],
            GAP_SHARE,
            "empty space before these bodies",
            "a child's pos does not reach the end of its parent's geom",
        ),
    )
    for gaps, limit, where, why in places:
        if gaps:
            share, body, spacing_m = max(gaps)
            yield SEGMENTS_GAP.fault(
                f"{where}, widest before {robot.body(body)}",
                names=(robot.body(behind) for _, behind, _ in gaps),
                measured=share,
                limit=limit,
                whole=spacing_m,
                whole_unit="m",
                likely_cause=why,
            )


def _gaps(robot: RobotUnderTest, data: mujoco.MjData, chain: Chain) -> Iterator[tuple[float, int, float]]:
    """Yield the gaps in a chain that are too wide, as (gap / segment length, body after it, segment length [m])."""
    for before, body in pairwise(chain.bodies):
        gap = _gap_share(robot, data, chain, before, body)
        if gap > GAP_SHARE:
            yield gap, body, chain.spacing_m


def _gap_to_carrier(robot: RobotUnderTest, data: mujoco.MjData, chain: Chain) -> Iterator[tuple[float, int, float]]:
    """Yield the same for the gap between the first segment of a limb and the part that carries it."""
    carrier = int(robot.model.body_parentid[chain.bodies[0]])
    if not carrier:
        return  # nothing but the world carries it
    gap = _gap_share(robot, data, chain, carrier, chain.bodies[0])
    if gap > CARRIER_GAP_SHARE:
        yield gap, chain.bodies[0], chain.spacing_m


def _gap_share(robot: RobotUnderTest, data: mujoco.MjData, chain: Chain, before: int, body: int) -> float:
    """Return the gap between two bodies / segment length; 0 if a body has no geoms."""
    ours, theirs, spacing_m = _rigid_geoms(robot, body), _rigid_geoms(robot, before), chain.spacing_m
    if not ours or not theirs or spacing_m == 0:
        return 0.0
    reach_m = 10 * spacing_m
    gaps_m = (geom_distance_m(robot.model, data, a, b, reach_m) for a in ours for b in theirs)
    return min(gaps_m) / spacing_m


def _rigid_geoms(robot: RobotUnderTest, body: int) -> list[int]:
    """Return the geoms of a body and of the bodies that are rigidly fixed to it."""
    model = robot.model
    weld = int(model.body_weldid[body])
    return [geom for geom in robot.structure.geoms if int(model.body_weldid[model.geom_bodyid[geom]]) == weld]


SEGMENTS_GAP = Rule(
    code="segments_gap",
    stage=Stage.TOPOLOGY,
    finds="There is empty space between neighbouring segments, or between a limb and what carries it.",
    why="A joint cannot hold what it does not touch: such a robot simulates, and cannot be built as it is drawn.",
    limit=f"gap between neighbouring geoms of a chain / segment length: at most {GAP_SHARE:g}, between a limb and what "
    f"carries it at most {CARRIER_GAP_SHARE:g}",
    check=_find_gaps,
    unit="of the segment's length",
    cure="Let each segment begin where the one before it ends.",
    example=Example((('size="0.011 0.012"', 'size="0.011 0.004"'),)),
)
