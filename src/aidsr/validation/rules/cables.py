"""Rules for tendons that could not be built as cables: they run through parts or skip segments without a guide."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.sim.extent import half_width_m
from aidsr.sim.overlap import OVERLAP_NOTICED
from aidsr.sim.ownership import WRAP_SITE, tendon_wraps
from aidsr.sim.structure import Tendon
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.solids import depth_m

THROUGH_BODY_SHARE = 0.25
"""Largest depth of a tendon inside a part between its guides / half width of that part. Our choice."""
_ALONG = np.linspace(0, 1, 17)[1:-1, None]
"""Points at which the depth along a line is sampled, as shares of its length, (15, 1)."""


def _find_buried_tendons(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find cables that run through parts between two guides, in the reference pose and at the ends of tests.

    The parts of the guides and their neighbours may be touched, see `_own_parts`. In MuJoCo a tendon is straight from
    site to site and passes through everything between them.
    """
    lines = _Lines.of(robot)
    worst: dict[int, tuple[float, float, str]] = {}
    for data in _poses(robot) if lines.tendons else ():
        for tendon, share, half_m, body in lines.buried(robot, data):
            worst[tendon] = max(worst.get(tendon, (0.0, 0.0, "")), (share, half_m, body))
    deep = {tendon: found for tendon, found in worst.items() if found[0] > THROUGH_BODY_SHARE}
    if deep:
        share, half_m, body = max(deep.values())
        yield TENDON_THROUGH_BODY.fault(
            names=tuple(robot.tendon(tendon) for tendon in deep),
            measured=share,
            limit=THROUGH_BODY_SHARE,
            whole=half_m,
            whole_unit="m",
            message=f"runs through {body} between its guides",
        )


def _poses(robot: RobotUnderTest) -> Iterator[mujoco.MjData]:
    """Yield the data in the reference pose and at the ends of the tests of single actuators.

    The same object is yielded for each test; the next one overwrites it.
    """
    evidence = robot.driven
    yield evidence.start
    if evidence.battery is None:
        return
    data = mujoco.MjData(robot.model)
    for row, test in enumerate(evidence.tests):
        if test.kind == "single" and not evidence.battery.failed(row):
            mujoco.mj_setState(robot.model, data, evidence.battery.states[row], mujoco.mjtState.mjSTATE_INTEGRATION)
            mujoco.mj_kinematics(robot.model, data)
            yield data


def _spans(robot: RobotUnderTest, tendon: Tendon) -> Iterator[tuple[int, int]]:
    """Yield the pairs of neighbouring sites that a tendon connects by a straight line."""
    wraps = tendon_wraps(robot.model, tendon.id)
    for (kind, site), (next_kind, next_site) in pairwise(wraps):
        if kind == WRAP_SITE and next_kind == WRAP_SITE:
            yield site, next_site


@dataclass(frozen=True)
class _Lines:
    """All straight lines of tendons between different parts, and the geoms that each line may touch.

    Attributes:
        tendons: Tendon id of each line, n_lines.
        sites: Ids of the two sites of each line, (n_lines, 2).
        own: Whether each line may touch each geom, (n_lines, ngeom).
    """

    tendons: tuple[int, ...]
    sites: NDArray[np.int64]
    own: NDArray[np.bool_]

    @classmethod
    def of(cls, robot: RobotUnderTest) -> _Lines:
        bodies, weld = robot.model.site_bodyid, robot.model.body_weldid
        found = [
            (tendon.id, span)
            for tendon in robot.structure.tendons
            for span in _spans(robot, tendon)
            if weld[bodies[span[0]]] != weld[bodies[span[1]]]
        ]
        ends = [(int(bodies[one]), int(bodies[other])) for _, (one, other) in found]
        own = {pair: _own_parts(robot, *pair) for pair in set(ends)}
        sites = np.array([span for _, span in found], dtype=int).reshape(-1, 2)
        return cls(tuple(tendon for tendon, _ in found), sites, np.array([own[pair] for pair in ends]))

    def buried(self, robot: RobotUnderTest, data: mujoco.MjData) -> Iterator[tuple[int, float, float, str]]:
        """Yield (tendon id, depth / half width, half width [m], body name) of every part that a line passes through."""
        begin, end = data.site_xpos[self.sites[:, 0]], data.site_xpos[self.sites[:, 1]]
        apart = data.geom_xpos - ((begin + end) / 2)[:, None]
        reach = np.linalg.norm(end - begin, axis=1)[:, None] / 2 + robot.model.geom_rbound
        near = np.einsum("lgi,lgi->lg", apart, apart) < reach**2
        for line, geom in np.argwhere(near & ~self.own).tolist():
            points = begin[line] + _ALONG * (end[line] - begin[line])
            depth = float(depth_m(robot.model, data, geom, points).max())
            if depth > 0:
                half_m = half_width_m(robot.model, geom)
                yield self.tendons[line], depth / half_m, half_m, robot.body(int(robot.model.geom_bodyid[geom]))


def _own_parts(robot: RobotUnderTest, one: int, other: int) -> NDArray[np.bool_]:
    """Return which geoms a line between two bodies may touch, (ngeom,).

    These are the geoms of the two bodies, of their neighbours that are not between them, and of the environment.
    """
    model, weld = robot.model, robot.model.body_weldid.tolist()
    ends = {weld[one], weld[other]}
    parents = model.body_parentid.tolist()
    steps = [(weld[body], weld[parents[body]]) for body in robot.structure.bodies]
    near = (
        ends | {part for part, parent in steps if parent in ends} | {parent for part, parent in steps if part in ends}
    )
    near -= {weld[body] for body in _between(robot, one, other)} - ends
    own = np.ones(model.ngeom, dtype=bool)
    ours = list(robot.structure.geoms)
    own[ours] = [weld[body] in near for body in model.geom_bodyid[ours].tolist()]
    return own


_GUIDES = tuple(f'      <site site="front{index}"/>\n' for index in range(7))

TENDON_THROUGH_BODY = Rule(
    code="tendon_through_body",
    stage=Stage.BUILDING,
    finds="Between two guides a tendon runs through a part of the robot.",
    why="MuJoCo pulls a tendon straight from site to site, whatever is between them; a cable cannot.",
    limit="depth of the straight cable inside a part that it passes over / half width of that part, drawn and at "
    "the end of "
    f"each test of one actuator: at most {THROUGH_BODY_SHARE:g}",
    check=_find_buried_tendons,
    unit="of the half width of the part",
    cure="Add a routing site in every segment, at its surface, so that the cable follows the limb.",
    example=Example((("".join(_GUIDES[2:5]), ""),)),
)


def _find_skipped_segments(robot: RobotUnderTest) -> Iterator[Fault]:
    skipping: dict[str, int] = {}
    for tendon in robot.structure.tendons:
        for site, next_site in _spans(robot, tendon):
            skipped = _skipped_joints(robot, site, next_site)
            if skipped > 1:
                name = robot.tendon(tendon.id)
                skipping[name] = max(skipping.get(name, 0), skipped)
    if skipping:
        yield TENDON_SKIPS_SEGMENTS.fault(
            names=tuple(skipping),
            measured=max(skipping.values()),
            limit=1,
            message="runs along a limb without a guide in every segment",
        )


def _skipped_joints(robot: RobotUnderTest, site: int, next_site: int) -> int:
    """Return the number of turning points between two sites that a straight cable runs along; 0 if it crosses a loop.

    The cable runs along the limb if none of these turning points is farther from it than the sites are from their
    nearest turning point. A cable across a loop is farther from the turning points.
    """
    model, data = robot.model, robot.driven.start
    begin, end = data.site_xpos[site], data.site_xpos[next_site]
    span_m = float(np.linalg.norm(end - begin))
    between = _between(robot, int(model.site_bodyid[site]), int(model.site_bodyid[next_site]))
    if len(between) < 2:
        return 0
    anchors: list[NDArray[np.float64]] = []
    for body in between:
        anchor = data.xanchor[int(model.body_jntadr[body])]
        if not anchors or np.linalg.norm(anchor - anchors[-1]) > OVERLAP_NOTICED * robot.length_m:
            anchors.append(np.array(anchor))
    if span_m == 0 or len(anchors) < 2:
        return 0
    offsets = np.array(anchors) - begin
    direction = (end - begin) / span_m
    away = np.linalg.norm(offsets - np.outer(offsets @ direction, direction), axis=1)
    guide = max(np.linalg.norm(np.array(anchors) - point, axis=1).min() for point in (begin, end))
    return len(anchors) if away.max() <= guide else 0


def _between(robot: RobotUnderTest, one: int, other: int) -> list[int]:
    """Return the bodies with joints on the path from one body to another through the kinematic tree."""
    parents, joints = robot.model.body_parentid.tolist(), robot.model.body_jntnum.tolist()

    def ancestors(body: int) -> list[int]:
        line = [body]
        while line[-1]:
            line.append(parents[line[-1]])
        return line

    first, second = ancestors(one), ancestors(other)
    apart = [body for body in first if body not in second] + [body for body in second if body not in first][::-1]
    return [body for body in apart if joints[body]]


TENDON_SKIPS_SEGMENTS = Rule(
    code="tendon_skips_segments",
    stage=Stage.DRAWING,
    finds="A tendon runs along a limb without a guide in every segment.",
    why="Where the limb bends, the cable leaves it and cuts across; a cable across a loop is meant to.",
    limit="joints that a cable runs along between two guides: at most 1, always a warning",
    check=_find_skipped_segments,
    severity="warning",
    unit="joints between neighbouring guides",
    cure="Add a routing site in every segment the tendon passes.",
    example=Example(((_GUIDES[3], ""),)),
)
