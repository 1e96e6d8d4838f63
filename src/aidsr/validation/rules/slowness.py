"""Rules for robots that are too slow to arrive within a test, because of damping, armature or actuator filters."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.core.formatting import format_number
from aidsr.validation.curves import OF_LENGTH, battery_of, moved_over_length
from aidsr.validation.protocol import Variant
from aidsr.validation.registry import is_explained
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.rules.effect import (
    MIN_EFFECT,
    effect_signal,
    improved_drives,
    largest_effect_if,
    measured_drives,
)

STILL_MOVING = 0.2
"""Displacement in the last quarter of a test / displacement in the whole test, above which an actuator's effect is
still growing. Our choice: a first-order lag of half the test's length."""
QUICKER = 3.0
"""Effect without the cause / effect with it, above which the cause is confirmed. Our choice: an oscillation overshoots
by less than 2."""
_FASTER = 0.02
"""Factor on damping or time constants in the counterfactual. Our choice."""
_FILTERS = (int(mujoco.mjtDyn.mjDYN_FILTER), int(mujoco.mjtDyn.mjDYN_FILTEREXACT), int(mujoco.mjtDyn.mjDYN_MUSCLE))


def _less_damping(model: mujoco.MjModel) -> None:
    model.dof_damping[:] *= _FASTER
    model.tendon_damping[:] *= _FASTER


def _no_armature(model: mujoco.MjModel) -> None:
    model.dof_armature[:] = 0
    model.tendon_armature[:] = 0
    mujoco.mj_setConst(model, mujoco.MjData(model))


def _quicker_filters(model: mujoco.MjModel) -> None:
    filtered = np.isin(model.actuator_dyntype, _FILTERS)
    model.actuator_dynprm[filtered, :2] *= _FASTER


def _find_slowness(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find slow actuators and the cause by counterfactual simulations."""
    if robot.driven.battery is None or is_explained("no_effect", robot.found):
        return
    slow = list(_still_moving(robot))
    if not slow:
        return
    tests = robot.single_tests(slow)
    variants: tuple[tuple[Rule, str, Variant], ...] = (
        (OVERDAMPED, "without most of the damping", _less_damping),
        (ARMATURE_LARGE, "without armature", _no_armature),
        (FILTER_SLOW, "without most of the filters' time", _quicker_filters),
    )
    found = []
    for rule, instead, variant in variants:
        effects = robot.effects_if(instead, variant, tests)
        if held := improved_drives(robot, slow, effects, QUICKER):
            found.append((largest_effect_if(robot, held, effects), rule, instead, held))
    if not found:
        return
    # removing a minor cause often helps a little too, so the cause with the largest effect is reported
    freed, rule, instead, held = max(found, key=lambda each: each[0])
    quick = [drive for drive in measured_drives(robot) if drive not in held and robot.effect_of(drive) >= MIN_EFFECT]
    yield rule.fault(
        f"still moving when a test of {format_number(_test_s(robot))} s ends; displacement by these actuators "
        f"({format_number(1000 * freed * robot.length_m)} mm {instead})",
        names=(robot.actuator(robot.driven.drives[index].actuator) for index in held),
        severity="warning" if quick else "error",
        measured=robot.largest_effect(held),
        limit=freed / QUICKER,
        whole=robot.length_m,
        whole_unit="m",
    )


def _still_moving(robot: RobotUnderTest) -> Iterator[int]:
    """Yield the indices in `Evidence.drives` of actuators whose displacement still grows when their test ends."""
    moved = moved_over_length(robot)
    late = moved.shape[1] - moved.shape[1] // 4
    for drive in measured_drives(robot):
        for row in robot.single_tests([drive]):
            if moved[row, -1] - moved[row, late] > STILL_MOVING * moved[row, -1] > 0:
                yield drive
                break


def _test_s(robot: RobotUnderTest) -> float:
    battery = battery_of(robot)
    return float(battery.frame_s * next(iter(battery.fields.values())).shape[1])


_LIMIT = (
    f"displacement by an actuator that grows by more than {100 * STILL_MOVING:g} % in the last quarter of its test / "
    f"the same {{}}: at least 1 / {QUICKER:g}; a warning where another actuator moves the robot in time"
)
_CONSEQUENCES = ("mass_ratio", "actuator_too_weak", "too_stiff", "no_effect", "sensor_constant")

OVERDAMPED = Rule(
    code="overdamped",
    stage=Stage.EFFECT,
    finds="Damping makes the robot so slow that it does not arrive within a test.",
    why="Damping / stiffness is a time: at 10 s a policy waits half a minute for every motion.",
    limit=_LIMIT.format("with a fiftieth of the damping"),
    check=_find_slowness,
    unit=OF_LENGTH,
    cure="Lower the damping of joints and tendons to about a twentieth of their stiffness, in N m s/rad and N m/rad.",
    explains=_CONSEQUENCES,
    signal=effect_signal,
    example=Example((('stiffness="1" damping="0.05"', 'stiffness="1" damping="20"'),)),
)

ARMATURE_LARGE = Rule(
    code="armature_large",
    stage=Stage.EFFECT,
    finds="The armature of joints is so large that the actuators hardly accelerate them.",
    why="Armature is a motor's inertia seen at its joint. Joints pulled by cables have next to none.",
    limit=_LIMIT.format("without armature"),
    check=_find_slowness,
    unit=OF_LENGTH,
    cure="Lower the armature to about 1e-5 kg m2, or leave it out.",
    explains=_CONSEQUENCES,
    signal=effect_signal,
    example=Example((('armature="1e-5"', 'armature="1000"'),)),
)

FILTER_SLOW = Rule(
    code="filter_slow",
    stage=Stage.EFFECT,
    finds="The activation of actuators is so slow that their force does not arrive within a test.",
    why="The time constant of a motor with its drive is 0.01 to 0.1 s.",
    limit=_LIMIT.format("with a fiftieth of the actuators' time constants"),
    check=_find_slowness,
    unit=OF_LENGTH,
    cure="Lower timeconst or dynprm to at most 0.1 s.",
    explains=_CONSEQUENCES,
    signal=effect_signal,
    example=Example(
        (
            (
                '<motor name="pull_front" tendon="front" gear="-1"',
                '<general name="pull_front" tendon="front" gear="-1" dyntype="filter" dynprm="30"',
            ),
            (
                '<motor name="pull_back" tendon="back" gear="-1"',
                '<general name="pull_back" tendon="back" gear="-1" dyntype="filter" dynprm="30"',
            ),
        )
    ),
)
