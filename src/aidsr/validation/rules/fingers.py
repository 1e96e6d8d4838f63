"""Rule for grippers whose fingers cannot close."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.sim.structure import Chain
from aidsr.validation.points import last_quarter
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage

Array = NDArray[np.float64]

_LIMB = 3
"""Fewest turning points of a limb that counts as a finger. Our choice."""
_OPEN = 0.1
"""Smallest distance / L between any two fingertips in the reference pose of an open gripper. Our choice."""
CLOSES_BY = 0.02
"""Smallest distance / L by which some test must bring two fingertips nearer to each other at any time. Our choice: the
least effect of a single actuator."""
_OPENS_BY = 0.1
"""Distance / L by which some test must move two fingertips apart for the fingers to count as driven to open. Our
choice."""


def _find_fingers_that_only_open(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find grippers without a free root whose actuators move fingertips apart but never bring two of them together."""
    battery = robot.driven.battery
    fingers = [chain for chain in robot.structure.chains if len(chain.bodies) >= _LIMB]
    if battery is None or robot.structure.free_roots or len(fingers) < 2 or not _from_one_palm(robot, fingers):
        return
    tips = [robot.driven.start.xipos[chain.bodies[-1]] for chain in fingers]
    pairs = list(combinations(range(len(fingers)), 2))
    if min(float(np.linalg.norm(tips[i] - tips[j])) for i, j in pairs) < _OPEN * robot.length_m:
        return
    ends = battery.fields["xipos"][:, :, [chain.bodies[-1] for chain in fingers]]
    apart = np.array([np.linalg.norm(ends[:, :, i] - ends[:, :, j], axis=-1) for i, j in pairs]) / robot.length_m
    tests = [row for row in robot.sound_tests if robot.driven.tests[row].kind in ("single", "all")]
    rest = last_quarter(apart[:, :1], axis=2).mean(axis=2)
    # fingers side by side may pass each other and end farther apart, so the smallest distance over time counts
    nearest, held = (found - rest for found in (apart.min(axis=2), last_quarter(apart, axis=2).mean(axis=2)))
    if tests and nearest[:, tests].min() > -CLOSES_BY and held[:, tests].max() > _OPENS_BY:
        yield ONLY_OPENS.fault(
            "every actuator moves the ends of the limbs apart, none brings them together",
            names=(robot.body(chain.bodies[-1]) for chain in fingers),
            measured=max(0.0, -float(nearest[:, tests].min())),
            limit=CLOSES_BY,
            whole=robot.length_m,
            whole_unit="m",
            likely_cause="all flexors run along the backs of the fingers",
        )


def _from_one_palm(robot: RobotUnderTest, fingers: list[Chain]) -> bool:
    """Return whether all fingers point in about the same direction; the limbs of a star or of a tree do not."""
    ways: list[Array] = []
    for chain in fingers:
        way = robot.driven.start.xipos[chain.bodies[-1]] - chain.anchors_m[0]
        ways.append(way / max(float(np.linalg.norm(way)), np.finfo(float).tiny))
    return all(float(one @ other) > 0 for one, other in combinations(ways, 2))


ONLY_OPENS = Rule(
    code="only_opens",
    stage=Stage.EFFECT,
    finds="Every actuator of a gripper moves its fingertips apart.",
    why="Springs close such fingers up to where they were drawn and no farther, so that they hold nothing.",
    limit="distance by which a test of one actuator or of all brings two fingertips nearer to each other, at any time, "
    f"/ L: at least {CLOSES_BY:g}, where another moves them apart by more than {_OPENS_BY:g}; limbs of {_LIMB} joints "
    f"or more on a base, that point the same way and are drawn {_OPEN:g} L apart; always a warning, since hooks "
    "that hold from inside are meant so",
    check=_find_fingers_that_only_open,
    severity="warning",
    unit="of the robot's length",
    cure="If they are to grip, route the flexors on the sides of the fingers that face each other.",
    example=Example(
        (
            (
                "<worldbody>",
                '<worldbody>\n    <replicate count="2" euler="0 0 180">\n    <body name="finger" pos="0.06 0 0">',
            ),
            ("  </worldbody>", "    </body>\n    </replicate>\n  </worldbody>"),
            ('pos="-0.009 0', 'pos="0.006 0'),
        )
    ),
)
