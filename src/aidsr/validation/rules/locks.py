"""Rules for robots that block their own motion by contacts between their parts or by antagonistic tendons."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.sim.structure import joined_bodies
from aidsr.validation.consequences import NO_MOTION
from aidsr.validation.counterfactuals import without_self_contact
from aidsr.validation.curves import OF_LENGTH, battery_of, find_drives, make_signal, moved_over_length
from aidsr.validation.protocol import gather_evidence
from aidsr.validation.registry import is_explained
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.rules.drops import DROP_SHARE
from aidsr.validation.rules.effect import (
    MIN_EFFECT,
    effect_fault,
    effect_signal,
    improved_drives,
    largest_effect_if,
    measured_drives,
)
from aidsr.validation.signals import Signal

_MOST_PAIRS = 3
"""Most pairs of touching parts in a message. Our choice: more would not be read."""
LOCK_SHARE = 0.35
"""Effect / effect without the obstacle, below which the obstacle locks the robot. Our choice."""


def _find_self_collision_lock(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find robots whose motion is blocked by their own contacts. Only actuators that make parts touch are checked.

    Contacts between neighbouring parts do not count: they touch at the end of their joint's range, as at a stop. This
    includes parts that an equality constraint joins to close a chain to a ring.
    """
    if is_explained("self_collision_lock", robot.found):
        return
    locked, freed = _locked_drives(robot)
    if locked:
        pairs = sorted({pair for found in _touching_pairs(robot, locked).values() for pair in found})
        fallen = _has_fallen(robot) and not _is_locked_as_drawn(robot)
        yield effect_fault(
            robot,
            SELF_COLLISION_LOCK,
            locked,
            freed,
            message=f"the robot's own contacts hold it ({_in_words(robot, pairs)})",
            instead="where its parts may pass through each other",
            likely_cause="it has fallen on its own parts"
            if fallen
            else "segments overlap or touch before they can bend",
            whole=not fallen,
            limit=LOCK_SHARE * largest_effect_if(robot, locked, freed),
            parts=[robot.body(body) for body in sorted({body for pair in pairs for body in pair})],
        )


def _locked_drives(robot: RobotUnderTest) -> tuple[list[int], dict[int, float]]:
    """Return the actuators whose motion the robot's own contacts block, and the effects / L without these contacts.

    Actuators are indices in `Evidence.drives`; the effects are by row of the battery.
    """
    weak = list(_touching_pairs(robot, _hindered(robot)))
    if not weak:
        return [], {}
    tests = robot.single_tests(weak)
    freed = robot.effects_if("without self-contact", without_self_contact(robot.structure), tests)
    return improved_drives(robot, weak, freed, 1 / LOCK_SHARE), freed


def _is_locked_as_drawn(robot: RobotUnderTest) -> bool:
    """Return whether its own contacts also block a robot near its reference pose: repeat all tests without gravity."""
    floating = copy.copy(robot.model)
    floating.opt.gravity[:] = 0
    evidence = gather_evidence(floating, robot.structure)
    again = replace(robot, model=floating, evidence=evidence, found=[], counterfactual_effects={})
    return evidence.battery is None or bool(_locked_drives(again)[0])


def _has_fallen(robot: RobotUnderTest) -> bool:
    """Return whether a free root has fallen during settling, so that the robot is not in its intended pose."""
    evidence = robot.driven
    sunk_m = [
        float(evidence.start.xpos[root, 2] - evidence.settle.fields["xpos"][0, -1, root, 2])
        for root in robot.structure.free_roots
    ]
    return max(sunk_m, default=0.0) > DROP_SHARE * robot.length_m


def _hindered(robot: RobotUnderTest) -> list[int]:
    """Return the actuators that an obstacle might block: those with an effect / L below `LOCK_SHARE`.

    L is about the effect of an unobstructed limb.
    """
    return [index for index in measured_drives(robot) if robot.effect_of(index) < LOCK_SHARE]


def _in_words(robot: RobotUnderTest, pairs: Sequence[tuple[int, int]]) -> str:
    """Return pairs of bodies that touch each other in words, such as "link_2 on link_4"."""
    told = [f"{robot.body(first)} on {robot.body(second)}" for first, second in pairs[:_MOST_PAIRS]]
    return ", ".join(told) + (f" and {len(pairs) - _MOST_PAIRS} more" if len(pairs) > _MOST_PAIRS else "")


def _touching_pairs(robot: RobotUnderTest, drives: Sequence[int]) -> dict[int, set[tuple[int, int]]]:
    """Return the pairs of bodies, not joined to each other, that touch after the tests of some actuators, by actuator.

    If such bodies touch after settling, every actuator gets those pairs. Actuators without a pair are left out.
    """
    evidence, data = robot.driven, mujoco.MjData(robot.model)
    # Source: MuJoCo documentation, Modeling, "Collision detection": only parent and child do not collide.
    joined = joined_bodies(robot.model)
    if evidence.battery is None or not drives:
        return {}
    settled = _touching(robot, data, evidence.settle.states[0], joined)
    if settled:
        return dict.fromkeys(drives, settled)
    states = evidence.battery.states
    found = {
        drive: set().union(*(_touching(robot, data, state, joined) for state in states[robot.single_tests([drive])]))
        for drive in drives
    }
    return {drive: pairs for drive, pairs in found.items() if pairs}


def _touching(
    robot: RobotUnderTest, data: mujoco.MjData, state: NDArray[np.float64], joined: set[frozenset[int]]
) -> set[tuple[int, int]]:
    """Return the pairs of bodies of the robot that touch each other in a state, without the pairs in `joined`."""
    model = robot.model
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    geoms = np.asarray(data.contact.geom).reshape(-1, 2)
    bodies = model.geom_bodyid[geoms[np.isin(geoms, robot.structure.geoms).all(axis=1)]]
    pairs = {(min(pair), max(pair)) for pair in bodies.tolist()}
    return {pair for pair in pairs if frozenset(pair) not in joined}


def _shell(body: int) -> tuple[str, str]:
    """Return a change to the example arm that adds to a segment two blocks that reach halfway over its neighbours."""
    blocks = "".join(
        f'<geom type="box" size="0.002 0.002 0.0248" pos="{x} 0 0.0125" mass="0.0001"/>' for x in ("0.016", "-0.016")
    )
    return f'<geom name="g{body}"/>', f'<geom name="g{body}"/>{blocks}'


SELF_COLLISION_LOCK = Rule(
    code="self_collision_lock",
    stage=Stage.EFFECT,
    finds="The robot's own contacts keep it from bending.",
    why="The actuators press its parts against each other instead of moving it. Parts next to each other, also "
    "where an "
    "equality constraint closes a ring, only come to a stop.",
    limit="effect / effect without contacts between the robot's parts, for actuators that make parts touch: at least "
    f"{LOCK_SHARE:g}; a warning for a robot that has toppled on its own parts and is free of them "
    "without gravity",
    check=_find_self_collision_lock,
    unit=OF_LENGTH,
    cure="Leave gaps between segments, or exclude contacts between neighbours with <contact><exclude>.",
    explains=tuple(code for code in NO_MOTION if code not in ("self_collision_lock", "mass_ratio")),
    signal=effect_signal,
    example=Example(
        (
            *map(_shell, (2, 4, 6)),
            (
                '<body name="base">',
                '<body name="base">\n'
                '      <geom type="box" size="0.002 0.002 0.006" pos="0.016 0 0.006" mass="0.0001"/>\n'
                '      <geom type="box" size="0.002 0.002 0.006" pos="-0.016 0 0.006" mass="0.0001"/>',
            ),
        )
    ),
)


def _find_antagonist_lock(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find tendons that bend the robot while the others are slack, but not while the others are commanded to release.

    Source: a position servo releases its tendon only if its range extends beyond the length that the tendon needs.
    """
    evidence = robot.driven
    locked = []
    for row in robot.sound_tests:
        test = evidence.tests[row]
        alone, together = robot.effect_of(test.drive), robot.effect_in(row)
        if test.kind == "released" and alone >= MIN_EFFECT and together < LOCK_SHARE * alone:
            locked.append((together / alone, alone, evidence.drives[test.drive].actuator))
    if locked:
        share, alone, _ = min(locked)
        yield ANTAGONIST_LOCK.fault(
            names=tuple(robot.actuator(actuator) for _, _, actuator in locked),
            measured=share,
            limit=LOCK_SHARE,
            whole=alone * robot.length_m,
            whole_unit="m",
            message="the other tendons hold the robot although they are told to let go",
            likely_cause="no command in their control ranges lets the opposite tendons grow long enough",
        )


def _antagonist_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    moved, (drive, *_) = moved_over_length(robot), find_drives(robot, fault.names)
    alone = max(robot.single_tests([drive]), key=robot.effect_in)
    released = next(
        row for row, test in enumerate(robot.driven.tests) if test.kind == "released" and test.drive == drive
    )
    curves = {"the others slack": moved[alone], "the others let go": moved[released]}
    limits = (LOCK_SHARE * robot.effect_in(alone),)
    quantity, test = "largest displacement", f"tests in which {fault.names[0]} pulls"
    return make_signal(quantity, OF_LENGTH, test, battery_of(robot).frame_s, curves, limits)


ANTAGONIST_LOCK = Rule(
    code="antagonist_lock",
    stage=Stage.EFFECT,
    finds="A tendon bends the robot only while the others are slack, and not while they are commanded to let go.",
    why="No command in their control ranges lets the opposite tendons grow long enough, so a policy cannot bend "
    "the robot.",
    limit=f"effect with the others commanded to let go / effect with them slack: at least {LOCK_SHARE:g}",
    check=_find_antagonist_lock,
    unit="of the effect with the others slack",
    cure="Let the upper end of each servo's ctrlrange exceed the tendon's rest length by its stroke, or, "
    'with gear 1, allow pulling only with forcerange="-F 0".',
    explains=tuple(code for code in NO_MOTION if code not in ("self_collision_lock", "antagonist_lock", "mass_ratio")),
    signal=_antagonist_signal,
    example=Example(
        tuple(
            (
                f'<motor name="pull_{side}" tendon="{side}" gear="-1" ctrlrange="0 20"/>',
                f'<position name="pull_{side}" tendon="{side}" kp="500" kv="5" ctrlrange="0.11 0.115"/>',
            )
            for side in ("front", "back")
        )
    ),
)
