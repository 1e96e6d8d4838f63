"""Checks whether the motion of a policy is plausible, which the paper calls "valid"."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.core.artifacts import Base, PlausibilityCheck
from aidsr.core.formatting import counted
from aidsr.learn.episodes.episode_stats import EpisodeStats
from aidsr.learn.episodes.rollout import EpisodeOutcomes
from aidsr.sim.deep_overlap import DEEP, OverlapProbe
from aidsr.sim.extent import bounding_box_m
from aidsr.sim.functional_part import FUNCTIONAL_SITE
from aidsr.sim.motion_limits import ENERGY_OF_WEIGHT, OVERRUN_DEG
from aidsr.sim.placement import mount_names
from aidsr.sim.scope import find_out_of_scope
from aidsr.sim.scope_reader import ScopeReader
from aidsr.sim.structure import Structure
from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.readings import FloatArray

MOVED_LENGTHS = 0.02
"""A robot that moves less than this share of its length counts as not moving. Source: our choice, after the
paper's wording; small, because only robots that stand still are to fail."""

TRAINING_DIVERGED = 0.01
"""Largest share of training episodes that may diverge. Source: our choice: random actions may break a few episodes,
while the evaluation may have none."""

ENERGY_OF_WORK = 0.1
"""Allowed rise of energy that no actuator supplied, as a share of the robot's work; `ENERGY_OF_WEIGHT` of weight x
length is added.

Source: our choice. Soft contacts store energy that the
balance does not include: five fingers that squeeze a body until it slips out gave back 0.07 of their work at most,
robots that squeeze nothing below 0.002.
"""

OUTLIERS = 0.05
"""Share of episodes, the worst ones, that each of the checks of energy, joints and overlap ignores, whether they
succeeded or not. Our choice: a gripper that succeeded in 17 of 20 episodes, with an energy balance off by 0.2 % of the
work, had been called an exploit because of 11 % in an unsuccessful episode."""

START_LENGTHS = 0.5
"""Largest distance from its mount at which a robot may start, in lengths of the robot: horizontal distance of the
centre of mass for a free robot, distance of the nearest part for a held one. Source: our choice: a worm that is held at
one of its ends."""

HIGHEST_M = 0.5
"""Largest height of a robot at the start of a lane along which it has to travel [m]. A robot that falls over brings its
centre of mass forward by its height at most. Source: our choice: below the shortest way, 0.7 m to the plateau of the
incline and to the last edge of the stairs; built-in rings are up to 0.21 m high, other robots up to 0.14 m."""

CARRIED = 0.5
"""Largest moving mass from the functional part outwards, as a share of all moving mass, where only that part's contacts
count. Source: our choice: a tip carries a tenth, and a hub carries everything."""

LIMBS = 1
"""Largest number of limbs that may begin on a functional part, where only that part's contacts count, unless an arm
carries it. Source: our choice: no functional part of a recorded design for such a task has any."""

_ASIDE = "one episode in twenty aside"
_TOO_FEW = "too few successful episodes to tell"

SURVIVING = 0.5
"""Successes required with changed physics, as a share of those with the scene's own physics. Source: our choice, the
same half that makes a design successful."""
FEWEST_SUCCESSES = 4
"""Number of successes from which the check is applied. Our choice: a policy that brushed one wall of twenty by luck was
called an exploit, while one that brushed none was not. Chance remains: a policy that succeeds in a fifth of twenty
episodes by chance alone, with any physics, fails this check about one time in ten; one that succeeds in half of them
hardly ever."""

_OF_LENGTH = "of the robot's length"
"""Unit of what is measured in characteristic lengths of the robot."""

VANISHED = 0.1
"""Successes allowed without cables or with a locked body, as a share of those with them. Our choice: above zero,
because a variation may be so easy that the remaining motion solves it by luck; far below half, where luck would do as
much as the cables."""


def _max_without_outliers(values: FloatArray) -> float:
    """Return the largest value of the episodes after removing the worst ones, a share of `OUTLIERS`."""
    return float(np.sort(values)[len(values) - 1 - int(OUTLIERS * len(values) + 1e-9)])


def _at_most(limit: float, name: str, measured: float, message: str, unit: str = "") -> PlausibilityCheck:
    facts = {"measured": measured, "limit": limit, "unit": unit, "message": message}
    return PlausibilityCheck(name=name, passed=measured <= limit, bound="at most", **facts)


def training_check(episodes: int, diverged: int) -> PlausibilityCheck:
    """Check that the simulation was stable while the policy learned."""
    message = f"the simulation broke down in {diverged} of {episodes} training episodes"
    return _at_most(TRAINING_DIVERGED, "training_stable", diverged / max(episodes, 1), message)


def behavior_checks(
    outcomes: EpisodeOutcomes, stats: EpisodeStats, structure: Structure
) -> tuple[PlausibilityCheck, ...]:
    """Check that the simulation was stable and the robot moved, gained no energy and respected its joint ranges."""
    moved = float(np.median(stats.moved))
    weight_j = structure.weight_n * structure.characteristic_length_m
    allowed_j = ENERGY_OF_WEIGHT * weight_j + ENERGY_OF_WORK * stats.work_j
    gain = _max_without_outliers(stats.energy_gain_j / allowed_j)
    over = _max_without_outliers(stats.over_limit)
    broken = f"the simulation broke down in {int(outcomes.diverged.sum())} of {outcomes.diverged.size} episodes"
    gained = f"largest rise of mechanical energy that no actuator paid for, {_ASIDE}"
    turned = f"farthest that a joint went beyond its range, {_ASIDE}; {OVERRUN_DEG:g} degrees are allowed"
    return (
        _at_most(0.0, "evaluation_stable", float(outcomes.diverged.mean()), broken),
        PlausibilityCheck(
            name="moves",
            passed=moved > MOVED_LENGTHS,
            measured=moved,
            limit=MOVED_LENGTHS,
            bound="at least",
            unit=_OF_LENGTH,
            message="farthest that a part of the robot came from where it began, median over the episodes",
        ),
        _at_most(1.0, "energy_paid_for", gain, gained, "of what is allowed"),
        _at_most(1.0, "within_limits", over, turned, "of what is allowed"),
    )


def penetration_check(
    models: Sequence[mujoco.MjModel],
    stats: EpisodeStats,
    structure: Structure,
    *,
    indices: Sequence[int],
    dt_s: float,
    frames: int = 100,
) -> PlausibilityCheck:
    """Check that bodies do not overlap deeply; if they do, name the bodies, the episode and the time.

    Args:
        models: The scene as varied for each episode.
        stats: Statistics of these episodes.
        structure: Structure of the robot.
        indices: Indices of the episodes' variations.
        dt_s: Time between two positions [s].
        frames: Number of positions checked in each episode, evenly spaced. More would find the deep overlap of a single
            control step and thereby change the benchmark: `BENCHMARK_VERSION` has to change with this number.
    """
    deepest = []
    for model, qpos in zip(models, stats.qpos, strict=True):
        data = mujoco.MjData(model)
        probe, found = OverlapProbe(model, structure), _Found(0.0)
        for frame in np.linspace(0, len(qpos) - 1, frames).astype(int).tolist():
            overlap = probe.look(data, qpos[frame])
            if overlap is not None and overlap.share > found.share:
                found = _Found(overlap.share, overlap.geoms, frame)
        deepest.append(found)
    depths = np.array([one.share for one in deepest])
    depth = _max_without_outliers(depths)
    message = f"how deep the robot overlaps itself or anything else at most, {_ASIDE}"
    if depth > DEEP:
        row = int(np.flatnonzero(depths == depth)[0])
        one, two = (_body_name(models[row], geom) for geom in deepest[row].geoms)
        message += f"; {one} and {two} in episode {indices[row]}, {dt_s * deepest[row].frame:.3g} s after its start"
    return _at_most(DEEP, "no_deep_overlap", depth, message, "of half the thinner body")


@dataclass(frozen=True)
class _Found:
    """Deepest overlap of an episode."""

    share: float
    """Depth as a share of half the thinner geom's thickness."""
    geoms: tuple[int, ...] = ()
    frame: int = 0


def _body_name(model: mujoco.MjModel, geom: int) -> str:
    body = int(model.geom_bodyid[geom])
    return model.body(body).name or model.geom(geom).name or f"body {body}"


def structure_check(structure: Structure) -> PlausibilityCheck:
    """Check that the robot is a tendon-driven continuum robot.

    Source: docs/validation.md, scope: tendons, driven by actuators, along three joints or more in series (hinges about
    one point are one joint), in one piece.
    """
    joints = structure.longest_series
    whole = bool(structure.tendons) and bool(structure.tendon_actuators) and len(structure.roots) == 1
    return PlausibilityCheck(
        name="continuum_robot",
        passed=whole and joints >= 3,
        measured=float(joints),
        limit=3.0,
        bound="at least",
        unit="joints in series",
        message=f"{len(structure.tendons)} tendons, {len(structure.tendon_actuators)} of its actuators pull on one, "
        f"in {counted(len(structure.roots), 'piece')}",
    )


def scope_check(model: mujoco.MjModel, structure: Structure) -> PlausibilityCheck:
    """Check that only cables and soft limbs drive, hold and carry the robot; see `aidsr.sim.scope`."""
    findings = find_out_of_scope(model, structure)
    codes = dict.fromkeys(finding.code for finding in findings)
    message = f"out of scope: {', '.join(codes)}" if codes else "nothing but cables drives or holds the robot"
    return _at_most(0.0, "in_scope", float(len(findings)), message, "findings")


def start_check(model: mujoco.MjModel, structure: Structure, base: Base) -> PlausibilityCheck:
    """Check that the robot starts as and where its task starts, and not at the goal.

    Nothing is measured of a robot that is held where the task asks for a free one, or the other way round.

    Args:
        model: The scene. If its environment has no mount, a robot may start anywhere.
        structure: Structure of its robot.
        base: How the task wants the robot held.
    """
    if base != "any" and (base == "free") != bool(structure.free_roots):
        held = "held by its surroundings, and the task is for one that moves freely"
        free = "free, and the task is for one that its mount holds"
        return PlausibilityCheck(
            name="starts_at_mount",
            passed=False,
            measured=None,
            limit=START_LENGTHS,
            bound="at most",
            unit=_OF_LENGTH,
            message=f"the robot is {held if base == 'free' else free}",
        )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mounts_m = [data.site(name).xpos for name in mount_names(model)]
    length_m, away_m = structure.characteristic_length_m, 0.0
    if mounts_m and structure.free_roots:
        bodies = list(structure.bodies)
        middle_m = np.average(data.xipos[bodies], axis=0, weights=model.body_mass[bodies])
        away_m = min(float(np.linalg.norm((middle_m - mount_m)[:2])) for mount_m in mounts_m)
        what = "the robot's centre of mass is beside the mount"
    else:
        geoms = list(structure.geoms)
        gaps_m = [
            np.linalg.norm(data.geom_xpos[geoms] - mount_m, axis=1) - model.geom_rbound[geoms] for mount_m in mounts_m
        ]
        away_m = max(0.0, float(np.min(gaps_m))) if gaps_m and geoms else 0.0
        what = "the nearest part of the robot is from the mount"
    message = f"how far {what} at the start"
    return _at_most(START_LENGTHS, "starts_at_mount", away_m / length_m, message, _OF_LENGTH)


def height_check(model: mujoco.MjModel, structure: Structure) -> PlausibilityCheck:
    """Check that a robot that has to travel does not start so high that it need only fall over.

    Args:
        model: The scene.
        structure: Structure of its robot.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    low_m, high_m = bounding_box_m(model, data, structure.bodies)
    message = "height of the robot at the start: it travels and does not fall over"
    return _at_most(HIGHEST_M, "starts_low", float(high_m[2] - low_m[2]), message, "m")


def part_check(model: mujoco.MjModel, structure: Structure, sensors: Sequence[TaskSensor]) -> PlausibilityCheck:
    """Check that the functional part is not the whole robot, where a task counts only that part's contacts.

    It may not be a hub of several limbs either, however much the rest weighs, unless an arm as long as they are carries
    it.

    Args:
        model: The scene.
        structure: Structure of its robot.
        sensors: Sensors of the task.
    """
    counts = any(sensor.part == "functional_part" and "contact" in sensor.quantity for sensor in sensors)
    name, share = "functional_part_is_a_part", 0.0
    if counts and structure.mass_kg > 0:
        part = int(model.site(FUNCTIONAL_SITE).bodyid[0])
        behind = {part}
        for body in structure.bodies:
            if int(model.body_parentid[body]) in behind:
                behind.add(body)
        share = float(sum(model.body_mass[body] for body in behind & set(structure.moving))) / structure.mass_kg
        limbs = _hub_limbs(model, structure, part, behind)
        if share <= CARRIED and limbs > LIMBS:
            return _at_most(LIMBS, name, limbs, "limbs that begin on the functional part, a hub", "limbs")
    message = "moving mass of the functional part and what it carries" if counts else "the task counts every touch"
    return _at_most(CARRIED, name, share, message, "of the robot's moving mass")


def _hub_limbs(model: mujoco.MjModel, structure: Structure, part: int, behind: set[int]) -> int:
    """Return the number of limbs that cables bend and that begin on a part; 0 if an arm as long as they are carries it.

    Args:
        model: The scene.
        structure: Structure of its robot.
        part: Body of the functional part.
        behind: That body and all that it carries.
    """
    bent, before = set(ScopeReader(model, structure).soft.bent), int(model.body_parentid[part])
    carriers = set[int]()
    while before in structure.bodies:
        carriers.add(before)
        before = int(model.body_parentid[before])
    limbs_m, arm_m = [], 0.0
    for chain in structure.chains:
        length_m = float(np.linalg.norm(np.diff(chain.anchors_m, axis=0), axis=1).sum())
        bodies = {int(model.jnt_bodyid[joint]) for joint in chain.joints}
        if not bodies & bent:
            continue
        if int(model.jnt_bodyid[chain.joints[0]]) in behind:
            limbs_m.append(length_m)
        elif bodies & carriers:
            arm_m += length_m
    return 0 if arm_m >= max(limbs_m, default=0.0) else len(limbs_m)


def exploit_check(name: str, how: str, survived: int, successes: int) -> PlausibilityCheck:
    """Check that at least half as many episodes succeed when the same physics is computed in another way.

    Args:
        name: Name of the check.
        how: What was changed, in words.
        survived: Number of episodes of the same variations that succeed with the change.
        successes: Number of episodes that succeeded without it; too few give no statistics.
    """
    share = survived / successes if successes >= FEWEST_SUCCESSES else None
    too_few = "; too few to tell luck from an exploit" if share is None else ""
    return PlausibilityCheck(
        name=name,
        passed=share is None or share >= SURVIVING,
        measured=share,
        limit=SURVIVING,
        bound="at least",
        message=f"{survived} episodes succeed {how}, {successes} without that{too_few}",
    )


def necessity_check(name: str, how: str, left: int, successes: int) -> PlausibilityCheck:
    """Check that success vanishes, except for a tenth, when a part of the robot is disabled.

    Args:
        name: Name of the check.
        how: What was changed, in words.
        left: Number of episodes that still succeed.
        successes: Number of episodes that had succeeded and were played again; too few give no statistics.
    """
    share = left / successes if successes >= FEWEST_SUCCESSES else None
    message = f"{left} of {successes} successful episodes succeed {how} too" if share is not None else _TOO_FEW
    return PlausibilityCheck(
        name=name,
        passed=share is None or share <= VANISHED,
        measured=share,
        limit=VANISHED,
        bound="at most",
        message=message,
    )


def nothing_to_check(name: str, why: str) -> PlausibilityCheck:
    """Return a passed check of survival for a robot without the part that would be disabled."""
    return PlausibilityCheck(name=name, passed=True, measured=None, limit=SURVIVING, bound="at least", message=why)
