"""Do parts get into each other, or into what stands around, while the actuators pull."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.core.formatting import format_number
from aidsr.sim.deep_overlap import DEEP, DeepOverlap, deepest_overlap, half_thickness_m
from aidsr.validation.curves import battery_of, limits_of, make_signal
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Severity, Stage
from aidsr.validation.rules.ranges import known_tests
from aidsr.validation.signals import Signal

CROSSED = 3.0
"""Overlap / half the thickness of the thinner part that is an error. Our choice: 2 is the whole thickness, as deep as
two equal round parts ever get, and arms of sound robots that meet while commands are random come to that. At 3 a thin
part has gone through by half its thickness again. For 5 % of a test no robot without a fault was above 2.3; tips that
passed through each other were above 3.5."""
_LONG, _BRIEF = 0.05, 0.02
"""Shares of a test during which parts are so deep in each other, for an error and for a warning. Our choice: limbs that
swing into each other come apart again, and a single frame tells little. Of 19 designs of language models that were
above 1 in some frame, 6 had policies that were not valid for it; of 5 that were for 2 % of a test, all 5."""
_EVERY_FRAME = ("all", "sweep")
_EVERY_OTHER = 4
"""Frames from one look to the next in the other tests. Our choice: limbs meet where all pull or where commands change
at random, what one actuator alone presses into something stays there, and to look at every frame of every test costs a
tenth of simulating them."""


@dataclass(frozen=True)
class _Held:
    """An overlap that is held, and the row of the test in the battery."""

    overlap: DeepOverlap
    row: int


def _find_driven_overlap(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find overlaps of the robot with itself or with anything else in the tests that do not diverge.

    Parts that may pass through each other make no contact, and do not count.
    """
    overlaps = _overlaps(robot)
    limits: tuple[tuple[Severity, float, float], ...] = (("error", _LONG, CROSSED), ("warning", _BRIEF, DEEP))
    for severity, share, limit in limits:
        held = _deepest_held(overlaps, share)
        if held is None or held.overlap.share <= limit:
            continue
        geoms = sorted(held.overlap.geoms, key=lambda geom: geom not in robot.structure.geoms)
        names, depth_mm = [robot.geom(geom) for geom in geoms], format_number(1000 * held.overlap.depth_m)
        yield DRIVEN_OVERLAP.fault(
            severity=severity,
            names=names,
            measured=held.overlap.share,
            limit=limit,
            whole=held.overlap.depth_m / held.overlap.share,
            whole_unit="m",
            message=f"{names[0]} and {names[1]} are {depth_mm} mm or more deep in each other for {100 * share:g} % of "
            f"{robot.describe_test(held.row)}",
            cure=_CURE_WITHIN if geoms[1] in robot.structure.geoms else _CURE_OUTSIDE,
        )
        return


def _overlaps(robot: RobotUnderTest) -> dict[int, list[DeepOverlap | None]]:
    """Return the robot's deepest overlap in each frame looked at, the deepest first, by row of the battery."""
    frames, tests = _Frames(robot), robot.driven.tests
    found = {}
    for row in sorted(set(known_tests(robot)).intersection(robot.sound_tests)):
        looks = frames.of(row)[:: 1 if tests[row].kind in _EVERY_FRAME else _EVERY_OTHER]
        found[row] = sorted(map(frames.look, looks), key=_share, reverse=True)
    return found


def _share(overlap: DeepOverlap | None) -> float:
    return 0.0 if overlap is None else overlap.share


def _deepest_held(overlaps: dict[int, list[DeepOverlap | None]], share: float) -> _Held | None:
    """Return the deepest overlap of those that are reached for a share of a test."""
    reached = ((looks[int(share * len(looks))], row) for row, looks in overlaps.items())
    held = [_Held(overlap, row) for overlap, row in reached if overlap is not None]
    return max(held, key=lambda each: each.overlap.share, default=None)


class _Frames:
    """Looks at recorded frames of the battery."""

    def __init__(self, robot: RobotUnderTest) -> None:
        self.model, self.data = robot.model, mujoco.MjData(robot.model)
        self.half_m, self.ours = half_thickness_m(robot.model), frozenset(robot.structure.geoms)
        self.battery = robot.driven.battery

    def of(self, row: int) -> NDArray[np.float64]:
        """Return the positions in a test, (n_frames, nq)."""
        return np.zeros((0, self.model.nq)) if self.battery is None else self.battery.fields["qpos"][row]

    def look(self, qpos: NDArray[np.float64]) -> DeepOverlap | None:
        """Return the deepest overlap of the robot in a frame."""
        self.data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_collision(self.model, self.data)
        return deepest_overlap(self.data, self.half_m, self.ours) if self.data.ncon else None


def _overlap_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    held = _deepest_held(_overlaps(robot), _LONG if fault.severity == "error" else _BRIEF)
    if held is None:
        return None
    frames = _Frames(robot)
    curves = {"the deepest of all": np.array([_share(frames.look(qpos)) for qpos in frames.of(held.row)])}
    test = robot.describe_test(held.row)
    return make_signal("overlap", fault.unit, test, battery_of(robot).frame_s, curves, limits_of(fault))


_CURE_SOFTER = (
    'pull with less force, make the parts thicker where they meet, or their contact stiffer (solref="0.004 1" on the '
    "geoms of both)."
)
_CURE_WITHIN = (
    "Keep parts from meeting at full pull: shorter or fewer limbs, limbs farther apart, or joint ranges that stop "
    f"them. Else {_CURE_SOFTER}"
)
_CURE_OUTSIDE = f"{_CURE_SOFTER[0].upper()}{_CURE_SOFTER[1:]}"

DRIVEN_OVERLAP = Rule(
    code="driven_overlap",
    stage=Stage.DRIVEN,
    finds="A driven part of the robot gets deep into another, or into something around it.",
    why="Beyond the middle of the thinner part, contact may push the other out on the wrong side: limbs pass through "
    "each other, which no built robot does. A policy that learns from that is not valid.",
    limit="overlap / half the thickness of the thinner part, in tests that do not diverge: at most "
    f"{CROSSED:g} but for {100 * _LONG:g} % of a test; a warning above {DEEP:g} for {100 * _BRIEF:g} % of one",
    check=_find_driven_overlap,
    unit="of half the thinner part",
    cure=_CURE_WITHIN,
    signal=_overlap_signal,
    example=Example(
        (
            (
                '<body name="base">',
                '<body name="base">\n      <geom name="post" type="box" size="0.001 0.01 0.05" pos="0.05 0 0.06"/>',
            ),
            ('<geom type="cylinder"', '<geom solref="0.06 1" type="cylinder"'),
        )
    ),
)
