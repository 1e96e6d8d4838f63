"""Rule for parts that penetrate each other or their surroundings while the actuators drive the robot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.core.formatting import format_number
from aidsr.sim.deep_overlap import DEEP, DeepOverlap, OverlapProbe
from aidsr.sim.structure import NEIGHBOURS
from aidsr.validation.curves import battery_of, limits_of, make_signal
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Severity, Stage
from aidsr.validation.signals import Signal

CROSSED = 3.0
"""Overlap / half the thickness of the thinner part above which it is an error. Our choice: 2 is the whole thickness,
the most for two equal round parts, and arms of sound robots that meet under random commands reach it. At 3 a thin part
has passed through by half its thickness. For 5 % of a test no robot without a fault was above 2.3; tips that passed
through each other were above 3.5."""
_LONG, _BRIEF = 0.05, 0.02
"""Shares of a test during which an overlap must be too deep, for an error and for a warning. Our choice: limbs that
swing into each other separate again, and a single frame is not significant. Of 19 designs of language models that were
above 1 in some frame, 6 had policies that were invalid for this reason; of 5 that were above 1 for 2 % of a test, all
5 had."""
_EVERY_FRAME = ("all", "sweep")
_EVERY_OTHER = 4
"""In tests other than those of `_EVERY_FRAME`, every how many frames are checked. Our choice: limbs meet when all
actuators pull or when commands are random, whereas a part that one actuator presses into something stays there, and
checking every frame of every test costs a tenth of the time of simulating them."""


@dataclass(frozen=True)
class _Held:
    """A sustained overlap.

    Attributes:
        overlap: The overlap.
        row: Row of its test in the battery.
    """

    overlap: DeepOverlap
    row: int


def _find_driven_overlap(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find sustained overlaps of the robot with itself or with anything else in the tests that do not diverge.

    Neighbours without contact and parts that an <exclude> names do not count.
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
            likely_cause=_PASSES if held.overlap.passes else "",
        )
        return


def _overlaps(robot: RobotUnderTest) -> dict[int, list[DeepOverlap | None]]:
    """Return the robot's deepest overlap in each checked frame, the deepest first, by row of the battery."""
    frames, tests = _Frames(robot), robot.driven.tests
    found = {}
    for row in sorted(set(robot.known_tests).intersection(robot.sound_tests)):
        looks = frames.of(row)[:: 1 if tests[row].kind in _EVERY_FRAME else _EVERY_OTHER]
        found[row] = sorted(map(frames.look, looks), key=_share, reverse=True)
    return found


def _share(overlap: DeepOverlap | None) -> float:
    return 0.0 if overlap is None else overlap.share


def _deepest_held(overlaps: dict[int, list[DeepOverlap | None]], share: float) -> _Held | None:
    """Return the deepest overlap that is reached or exceeded during a share of a test, or None without any overlap."""
    reached = ((looks[int(share * len(looks))], row) for row, looks in overlaps.items())
    held = [_Held(overlap, row) for overlap, row in reached if overlap is not None]
    return max(held, key=lambda each: each.overlap.share, default=None)


class _Frames:
    """Recorded frames of the battery and the overlaps in them."""

    def __init__(self, robot: RobotUnderTest) -> None:
        self.model, self.data = robot.model, mujoco.MjData(robot.model)
        self.probe = OverlapProbe(robot.model, robot.structure)
        self.battery = robot.driven.battery

    def of(self, row: int) -> NDArray[np.float64]:
        """Return the joint positions `qpos` of all frames of a test, (n_frames, nq)."""
        return np.zeros((0, self.model.nq)) if self.battery is None else self.battery.fields["qpos"][row]

    def look(self, qpos: NDArray[np.float64]) -> DeepOverlap | None:
        """Return the deepest overlap of the robot in a frame, or None.

        Args:
            qpos: Joint positions of the frame, (nq,).
        """
        return self.probe.look(self.data, qpos)


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
_PASSES = "contype and conaffinity let them pass through each other: leave both at 1"
_CURE_OUTSIDE = f"{_CURE_SOFTER[0].upper()}{_CURE_SOFTER[1:]}"

DRIVEN_OVERLAP = Rule(
    code="driven_overlap",
    stage=Stage.DRIVEN,
    finds="A driven part of the robot gets deep into another, or into something around it.",
    why="Beyond the middle of the thinner part, contact may push the other out on the wrong side: limbs pass through "
    "each other, which no built robot does. A policy that learns from that is not valid.",
    limit="overlap / half the thickness of the thinner part, in tests that do not diverge: at most "
    f"{CROSSED:g} but for {100 * _LONG:g} % of a test; a warning above {DEEP:g} for {100 * _BRIEF:g} % of one; "
    f"parts of the robot more than {NEIGHBOURS} steps apart that collide with anything count also where contype and "
    "conaffinity let them pass through each other",
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
