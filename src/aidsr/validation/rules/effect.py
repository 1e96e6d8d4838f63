"""Does driving the robot do anything, and if not, what holds it: obstacles, weakness, stiffness."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.core.formatting import written
from aidsr.sim.structure import joined_bodies
from aidsr.validation.causes import is_explained
from aidsr.validation.counterfactuals import (
    mass_ratio,
    softer,
    without_limits,
    without_outlier_mass,
    without_self_contact,
)
from aidsr.validation.protocol import STANDARD_GRAVITY_M_S2
from aidsr.validation.robot_under_test import RobotUnderTest


def self_collision_lock(robot: RobotUnderTest) -> Iterator[Fault]:
    """The robot does not hold itself by its own contacts. Looked at only where an actuator makes its parts touch.

    Parts next to each other touch at the end of their joint's way, as at a stop, and so do those that an equality joins
    where a chain is closed to a ring.
    """
    if is_explained("self_collision_lock", robot.found):
        return
    weak = list(_touching_itself(robot, _hindered(robot)))
    if not weak:
        return
    tests = robot.single_tests(weak)
    freed = robot.effects_if("without self-contact", without_self_contact(robot.structure), tests)
    locked = _improved(robot, weak, freed, 1 / robot.limits.lock_share)
    if locked:
        yield _effect_fault(
            robot,
            "self_collision_lock",
            locked,
            freed,
            message="the robot's own contacts hold it",
            instead="where its parts may pass through each other",
            cause="segments overlap or touch before they can bend",
            cure="Leave gaps between segments, or exclude contacts between neighbours with <contact><exclude>.",
            limit=robot.limits.lock_share * _freed(robot, locked, freed),
        )


def antagonist_lock(robot: RobotUnderTest) -> Iterator[Fault]:
    """Pulling one tendon bends the robot while the others are told to let go.

    Source: a position servo lets go only if its range reaches beyond the length the tendon needs.
    """
    evidence, limits = robot.driven, robot.limits
    locked = []
    for row in robot.sound_tests:
        test = evidence.tests[row]
        alone, together = robot.effect_of(test.drive), robot.effect_in(row)
        if test.kind == "released" and alone >= limits.effect and together < limits.lock_share * alone:
            locked.append((together / alone, alone, evidence.drives[test.drive].actuator))
    if locked:
        share, alone, _ = min(locked)
        yield Fault(
            code="antagonist_lock",
            layer="simulate",
            severity="error",
            names=tuple(robot.actuator(actuator) for _, _, actuator in locked),
            measured=share,
            limit=limits.lock_share,
            unit="of the effect with the others slack",
            whole=alone * robot.length_m,
            whole_unit="m",
            message="the other tendons hold the robot although they are told to let go",
            likely_cause="no command in their control ranges lets the opposite tendons grow long enough",
            cure="Let the upper end of each servo's ctrlrange exceed the tendon's rest length by its stroke, or allow "
            'pulling only with forcerange="-F 0".',
        )


def no_effect(robot: RobotUnderTest) -> Iterator[Fault]:
    """The actuators move the robot. Where they do not, changing one thing after the other tells what is in the way.

    An error where no command that is held moves the robot, whatever jolts it when commands change; a warning where
    single actuators have no effect.
    """
    evidence, limits = robot.driven, robot.limits
    if evidence.battery is None or not evidence.drives or is_explained("tendon_against_limit", robot.found):
        return
    held = [row for row in robot.sound_tests if evidence.tests[row].kind in ("single", "released", "all")]
    whole = max((robot.effect_in(row) for row in held), default=0.0) < limits.effect
    least = limits.effect if whole else limits.single_effect
    weak = [index for index in _measured(robot) if robot.effect_of(index) < least]
    if not weak:
        return
    tests = robot.single_tests(weak)
    freed = robot.effects_if("without limits", without_limits, tests)
    if held := _improved(robot, weak, freed, limits.limit_gain):
        yield _effect_fault(
            robot,
            "tendon_against_limit",
            held,
            freed,
            message="joint or tendon limits hold the robot",
            instead="without limits",
            cause="a limited joint or tendon is already at the end of its range",
            cure="Widen the ranges of joints and tendons in the direction the tendon pulls.",
            limit=least,
            whole=whole,
        )
        return
    ratio = mass_ratio(robot.model, robot.structure)
    if ratio > limits.mass_ratio:
        light = robot.effects_if("without outlier mass", without_outlier_mass(robot.structure), tests)
        if heavy := _improved(robot, weak, light, limits.limit_gain):
            yield _mass_fault(robot, heavy, ratio, whole)
            return
    yield _strength_fault(robot, weak, tests, whole, least)


def _mass_fault(robot: RobotUnderTest, drives: list[int], ratio: float, whole: bool) -> Fault:
    heaviest = max(robot.structure.moving, key=lambda body: float(robot.model.body_mass[body]))
    heaviest_kg = float(robot.model.body_mass[heaviest])
    return Fault(
        code="mass_ratio",
        layer="simulate",
        severity="error" if whole else "warning",
        names=(robot.body(heaviest),),
        measured=ratio,
        limit=robot.limits.mass_ratio,
        unit="times the median segment",
        whole=heaviest_kg / ratio,
        whole_unit="kg",
        message="too heavy to be moved: the actuators move the robot by "
        f"{written(1000 * robot.largest_effect(drives) * robot.length_m)} mm, and far more with the median's mass",
        likely_cause="its mass or density is far above that of the others",
        cure="Bring the mass of that body near the others'.",
    )


def _strength_fault(robot: RobotUnderTest, weak: list[int], tests: list[int], whole: bool, least: float) -> Fault:
    """Too weak, too stiff, or without a cause that another trial shows."""
    evidence, limits = robot.driven, robot.limits
    tension_n = max(max(abs(drive.force_low_n), abs(drive.force_high_n)) for drive in evidence.drives)
    weight_n = robot.structure.mass_kg * STANDARD_GRAVITY_M_S2
    if whole and tension_n < limits.weak_share * weight_n:
        return Fault(
            code="actuator_too_weak",
            layer="simulate",
            severity="error",
            names=tuple(robot.actuator(evidence.drives[index].actuator) for index in weak),
            measured=tension_n / weight_n,
            limit=limits.weak_share,
            unit="of the robot's weight",
            whole=weight_n,
            whole_unit="N",
            message="no test moves the robot; greatest actuator force",
            likely_cause="force limits, gain or control range are too small",
            cure="Raise forcerange, kp or ctrlrange; bending takes about the limb's weight x length / tendon offset.",
        )
    soft = robot.effects_if("softer", softer(limits.softer), tests)
    # of a robot that is far too stiff the effect stays small, and still goes with 1 / stiffness
    stiff = _improved(robot, weak, soft, limits.limit_gain) or _improved(
        robot, weak, soft, limits.elastic_share / limits.softer, visible=0.0
    )
    return _effect_fault(
        robot,
        "too_stiff" if stiff else "no_effect",
        stiff or weak,
        soft,
        message="the actuators hardly move the robot",
        instead=f"with joints and tendons {1 / limits.softer:.0f} times softer",
        cause="joints or tendon springs are too stiff for the forces" if stiff else "",
        cure="Lower the joint stiffness, raise the tendon force, or move the tendons away from the backbone.",
        limit=least,
        whole=whole,
    )


def _measured(robot: RobotUnderTest) -> list[int]:
    """Actuators whose own tests do not diverge, so that their effect is known."""
    sound = set(robot.sound_tests)
    return [index for index in range(len(robot.driven.drives)) if sound.issuperset(robot.single_tests([index]))]


def _hindered(robot: RobotUnderTest) -> list[int]:
    """Actuators that an obstacle might hold: their effect is a small share of L, about the effect of a free limb."""
    return [index for index in _measured(robot) if robot.effect_of(index) < robot.limits.lock_share]


def _touching_itself(robot: RobotUnderTest, drives: Sequence[int]) -> Iterator[int]:
    """Actuators after whose tests, or after settling, parts that nothing joins touch each other."""
    evidence, data = robot.driven, mujoco.MjData(robot.model)
    # Source: MuJoCo documentation, Modeling, "Collision detection": only parent and child are left out of collisions.
    joined = joined_bodies(robot.model)
    if evidence.battery is None or not drives:
        return
    if _touch(robot, data, evidence.settle.states[0], joined):
        yield from drives
        return
    for drive in drives:
        if any(_touch(robot, data, state, joined) for state in evidence.battery.states[robot.single_tests([drive])]):
            yield drive


def _touch(robot: RobotUnderTest, data: mujoco.MjData, state: NDArray[np.float64], joined: set[frozenset[int]]) -> bool:
    """Whether parts of the robot that nothing joins touch each other in a state."""
    model = robot.model
    mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    geoms = np.asarray(data.contact.geom).reshape(-1, 2)
    bodies = model.geom_bodyid[geoms[np.isin(geoms, robot.structure.geoms).all(axis=1)]]
    return any(frozenset(pair) not in joined for pair in bodies.tolist())


def _improved(
    robot: RobotUnderTest, drives: Sequence[int], effects: dict[int, float], factor: float, visible: float | None = None
) -> list[int]:
    """Actuators whose effect becomes visible, and `factor` times as large, when something is changed."""
    least = robot.limits.effect if visible is None else visible
    return [
        index
        for index in drives
        if (freed := _freed(robot, [index], effects)) >= least and freed > factor * robot.effect_of(index)
    ]


def _freed(robot: RobotUnderTest, drives: Sequence[int], effects: dict[int, float]) -> float:
    """Largest effect of some actuators, each alone, in a changed model."""
    return max((effects[test] for test in robot.single_tests(drives)), default=0.0)


def _effect_fault(
    robot: RobotUnderTest,
    code: str,
    drives: Sequence[int],
    effects: dict[int, float],
    *,
    message: str,
    instead: str,
    cause: str,
    cure: str,
    limit: float,
    whole: bool = True,
) -> Fault:
    evidence = robot.driven
    freed_mm = written(1000 * _freed(robot, drives, effects) * robot.length_m)
    return Fault(
        code=code,
        layer="simulate",
        severity="error" if whole else "warning",
        names=tuple(robot.actuator(evidence.drives[index].actuator) for index in drives),
        measured=robot.largest_effect(drives),
        limit=limit,
        unit="of the robot's length",
        whole=robot.length_m,
        whole_unit="m",
        message=f"{message}: largest displacement by these actuators ({freed_mm} mm {instead})",
        likely_cause=cause,
        cure=cure,
    )
