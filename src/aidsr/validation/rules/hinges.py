"""Rule for two hinges about the same line, which act as one."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim.couplings import read_couplings
from aidsr.validation.consequences import SHAKING
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage

_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)
SAME_AXIS = 0.98
"""Cosine between two axes above which they are parallel: 11 deg. Our choice."""
_SAME_LINE = 1e-3
"""Distance between two parallel axes / L below which they are one line. Our choice: a hundredth of a segment of a limb
with ten segments."""


def _find_parallel_hinges(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find neighbouring hinges of a limb that turn about the same line.

    Hinges that an equality couples to another joint are left out.
    """
    model, data = robot.model, robot.drawn
    following = {coupling.joint for coupling in read_couplings(model)}
    found: dict[tuple[int, int], float] = {}
    for chain in robot.structure.chains:
        for one, other in pairwise(chain.joints):
            if int(model.jnt_type[one]) != _HINGE or int(model.jnt_type[other]) != _HINGE:
                continue
            if following & {one, other}:
                continue
            axis = data.xaxis[one]
            cosine = abs(float(axis @ data.xaxis[other]))
            apart_m = float(np.linalg.norm(np.cross(data.xanchor[other] - data.xanchor[one], axis)))
            if cosine > SAME_AXIS and apart_m < _SAME_LINE * robot.length_m:
                found[one, other] = cosine
    if found:
        yield HINGES_PARALLEL.fault(
            "two hinges turn about one line, so that they are one hinge and no joint turns about another",
            names=dict.fromkeys(robot.joint(joint) for pair in found for joint in pair),
            measured=max(found.values()),
            limit=SAME_AXIS,
            likely_cause="the second hinge was meant to have another axis",
        )


HINGES_PARALLEL = Rule(
    code="hinges_parallel",
    stage=Stage.TOPOLOGY,
    finds="Two hinges of one link turn about the same line.",
    why="They act as one hinge of half the stiffness. Usually the second was meant for the other direction, in which "
    "nothing bends now.",
    limit=f"cosine between the axes of two hinges at one point: at most {SAME_AXIS:g}; hinges that an equality couples "
    "to another joint are left alone",
    check=_find_parallel_hinges,
    unit="(cosine)",
    cure='Turn the axis of the second hinge by 90 deg, as in axis="1 0 0" and axis="0 1 0", or remove it.',
    explains=SHAKING,
    example=Example((('<joint name="j3"/>', '<joint name="j3"/>\n            <joint name="j3b"/>'),)),
)
