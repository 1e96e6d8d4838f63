"""Rules for actuators that do not move the robot, by cause: limits, surroundings, mass, weak actuators, stiffness."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.core.formatting import format_number
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2
from aidsr.validation.counterfactuals import (
    mass_ratio,
    softer,
    without_contacts_of,
    without_limits,
    without_outlier_mass,
)
from aidsr.validation.curves import (
    MAX_CURVES,
    OF_LENGTH,
    Array,
    battery_of,
    find_drives,
    make_signal,
    moved_over_length,
)
from aidsr.validation.registry import is_explained
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.signals import Signal
from aidsr.validation.thresholds import MAX_MASS_RATIO

MIN_EFFECT = 0.05
"""Smallest effect / L of the actuators of a working robot; a task cannot distinguish less from no motion. Our choice.
"""
MIN_SINGLE_EFFECT = 0.02
"""The same for a single actuator of a robot that other actuators do move: a leg that presses on the ground moves
little. Our choice."""
_GROUNDS = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
_MOST_NAMED = 4
_LIMIT_GAIN = 3.0
"""Effect without an obstacle (limits, surroundings, outlier mass, stiffness) / effect with it, above which the obstacle
is the cause. Our choice."""
WEAK_SHARE = 0.5
"""Largest actuator force / weight of the moving parts; less cannot lift the robot. Our choice."""
SOFTER_FACTOR = 0.02
"""Factor on stiffness and damping in the counterfactual of a stiff robot. Our choice."""
_ELASTIC_SHARE = 0.4
"""Gain of the effect in this counterfactual / gain if only springs held the robot, above which springs are the cause.
Our choice."""


def _find_no_effect(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find actuators that do not move the robot, and the cause by counterfactual simulations.

    It is an error if no constant command moves the robot, even if changing commands jolt it, and a warning if only
    single actuators have no effect.
    """
    evidence = robot.driven
    if evidence.battery is None or not evidence.drives or is_explained("tendon_against_limit", robot.found):
        return
    known = set(robot.known_tests).intersection(robot.sound_tests)
    held = [row for row in sorted(known) if evidence.tests[row].kind in ("single", "released", "all")]
    whole = max((robot.effect_in(row) for row in held), default=0.0) < MIN_EFFECT
    if whole and _travels(robot, held):
        return
    least = MIN_EFFECT if whole else MIN_SINGLE_EFFECT
    weak = [index for index in measured_drives(robot) if robot.effect_of(index) < least]
    if not weak:
        return
    tests = robot.single_tests(weak)
    freed = robot.effects_if("without limits", without_limits, tests)
    if held := improved_drives(robot, weak, freed, _LIMIT_GAIN):
        yield effect_fault(
            robot,
            TENDON_AGAINST_LIMIT,
            held,
            freed,
            message="joint or tendon limits hold the robot",
            instead="without limits",
            likely_cause="a limited joint or tendon is already at the end of its range",
            limit=least,
            whole=whole,
        )
        return
    if around := _touched_surroundings(robot):
        clear = robot.effects_if("without surroundings", without_contacts_of(around), tests)
        if wedged := improved_drives(robot, weak, clear, _LIMIT_GAIN):
            yield effect_fault(
                robot,
                WEDGED,
                wedged,
                clear,
                message="what stands around holds the robot",
                instead="where it passes through what stands around it",
                likely_cause=f"it is wedged between {_named(robot, around)}",
                limit=least,
                whole=whole,
            )
            return
    ratio = mass_ratio(robot.model, robot.structure)
    if ratio > MAX_MASS_RATIO:
        light = robot.effects_if("without outlier mass", without_outlier_mass(robot.structure), tests)
        if heavy := improved_drives(robot, weak, light, _LIMIT_GAIN):
            yield _mass_fault(robot, heavy, ratio, whole)
            return
    yield _strength_fault(robot, weak, tests, whole, least)


def _touched_surroundings(robot: RobotUnderTest) -> list[int]:
    """Return the geoms of the surroundings, except the ground, that touch the robot after settling or after a test."""
    model, evidence, found = robot.model, robot.driven, set[int]()
    battery, data = battery_of(robot), mujoco.MjData(robot.model)
    for state in (evidence.settle.states[0], *battery.states):
        mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        for pair in np.asarray(data.contact.geom).reshape(-1, 2).tolist():
            outside = [geom for geom in pair if geom not in robot.structure.geoms]
            if len(outside) == 1 and int(model.geom_type[outside[0]]) not in _GROUNDS:
                found.add(outside[0])
    return sorted(found)


def _named(robot: RobotUnderTest, geoms: Sequence[int]) -> str:
    names = [robot.geom(geom) for geom in geoms[:_MOST_NAMED]]
    more = f" and {len(geoms) - len(names)} more" if len(geoms) > len(names) else ""
    return ", ".join(names) + more


def _travels(robot: RobotUnderTest, rows: Sequence[int]) -> bool:
    """Return whether a root with joints moves away from its path in the reference test, as on spinning wheels."""
    roots = [root for root in robot.structure.roots if root in robot.structure.moving]
    places_m = battery_of(robot).fields["xipos"][:, :, roots]
    displacements_m = np.linalg.norm(places_m[list(rows)] - places_m[0], axis=-1)
    return bool(displacements_m.max(initial=0.0) > MIN_EFFECT * robot.length_m)


def _mass_fault(robot: RobotUnderTest, drives: list[int], ratio: float, whole: bool) -> Fault:
    heaviest = max(robot.structure.moving, key=lambda body: float(robot.model.body_mass[body]))
    heaviest_kg = float(robot.model.body_mass[heaviest])
    moved_mm = 1000 * robot.largest_effect(drives) * robot.length_m
    return MASS_RATIO.fault(
        severity="error" if whole else "warning",
        names=(robot.body(heaviest),),
        measured=ratio,
        limit=MAX_MASS_RATIO,
        whole=heaviest_kg / ratio,
        whole_unit="kg",
        message=f"too heavy to be moved: the actuators move the robot by {format_number(moved_mm)} mm, "
        "and far more with the median's mass",
        likely_cause="its mass or density is far above that of the others",
    )


def _strength_fault(robot: RobotUnderTest, weak: list[int], tests: list[int], whole: bool, least: float) -> Fault:
    """Return the fault of weak actuators, of a stiff robot, or of an unknown cause."""
    evidence = robot.driven
    ranged = [drive for drive in evidence.drives if drive.ranged]
    tension_n = max(max(abs(drive.force_low_n), abs(drive.force_high_n)) for drive in ranged)
    weight_n = robot.structure.mass_kg * STANDARD_GRAVITY_M_S2
    if whole and tension_n < WEAK_SHARE * weight_n:
        return ACTUATOR_TOO_WEAK.fault(
            names=tuple(robot.actuator(evidence.drives[index].actuator) for index in weak),
            measured=tension_n / weight_n,
            limit=WEAK_SHARE,
            whole=weight_n,
            whole_unit="N",
            message="no test moves the robot; greatest actuator force",
            likely_cause="force limits, gain or control range are too small",
        )
    soft = robot.effects_if("softer", softer(SOFTER_FACTOR), tests)
    # if a robot is far too stiff, its effect stays below `MIN_EFFECT` but is still proportional to 1 / stiffness
    stiff = improved_drives(robot, weak, soft, _LIMIT_GAIN) or improved_drives(
        robot, weak, soft, _ELASTIC_SHARE / SOFTER_FACTOR, visible=0.0
    )
    return effect_fault(
        robot,
        TOO_STIFF if stiff else NO_EFFECT,
        stiff or weak,
        soft,
        message="the actuators hardly move the robot",
        instead=f"with joints and tendons {1 / SOFTER_FACTOR:.0f} times softer",
        likely_cause="joints or tendon springs are too stiff for the forces" if stiff else "",
        limit=least,
        whole=whole,
    )


def measured_drives(robot: RobotUnderTest) -> list[int]:
    """Return the indices in `Evidence.drives` of actuators with a control range whose single tests do not diverge."""
    sound, drives = set(robot.sound_tests), robot.driven.drives
    return [
        index for index, drive in enumerate(drives) if drive.ranged and sound.issuperset(robot.single_tests([index]))
    ]


def improved_drives(
    robot: RobotUnderTest, drives: Sequence[int], effects: dict[int, float], factor: float, visible: float | None = None
) -> list[int]:
    """Return the actuators whose effect becomes visible and more than `factor` times as large in a changed model.

    Args:
        robot: The tested robot.
        drives: Indices of the actuators in `Evidence.drives`.
        effects: Effects / L in the changed model, by row of the battery.
        factor: Smallest gain.
        visible: Smallest effect / L that is visible; `MIN_EFFECT` if None.
    """
    least = MIN_EFFECT if visible is None else visible
    return [
        index
        for index in drives
        if (freed := largest_effect_if(robot, [index], effects)) >= least and freed > factor * robot.effect_of(index)
    ]


def largest_effect_if(robot: RobotUnderTest, drives: Sequence[int], effects: dict[int, float]) -> float:
    """Return the largest effect / L of some actuators, each driven alone, in a changed model."""
    return max((effects[test] for test in robot.single_tests(drives)), default=0.0)


def effect_fault(
    robot: RobotUnderTest,
    rule: Rule,
    drives: Sequence[int],
    effects: dict[int, float],
    *,
    message: str,
    instead: str,
    likely_cause: str,
    limit: float,
    whole: bool = True,
    parts: Sequence[str] = (),
) -> Fault:
    """Return a fault of actuators with too small an effect, with their effect in a changed model.

    Args:
        robot: The tested robot.
        rule: Rule of the fault.
        drives: Indices of the actuators in `Evidence.drives`.
        effects: Effects / L in the changed model, by row of the battery.
        message: Beginning of the message.
        instead: Description of the changed model, for example "without limits".
        likely_cause: Likely cause of the fault.
        limit: Smallest effect / L without a fault.
        whole: Whether no actuator moves the robot, which is an error; else the fault is a warning.
        parts: Names of what stops the actuators, which the fault names after them.
    """
    evidence = robot.driven
    freed_mm = format_number(1000 * largest_effect_if(robot, drives, effects) * robot.length_m)
    return rule.fault(
        severity="error" if whole else "warning",
        names=(*(robot.actuator(evidence.drives[index].actuator) for index in drives), *parts),
        measured=robot.largest_effect(drives),
        limit=limit,
        whole=robot.length_m,
        whole_unit="m",
        message=f"{message}: largest displacement by these actuators ({freed_mm} mm {instead})",
        likely_cause=likely_cause,
    )


def effect_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    """Return the displacement by each actuator of a fault in its own test, or by all actuators if it names none."""
    moved = moved_over_length(robot)
    curves: dict[str, Array] = {}
    for drive in find_drives(robot, fault.names) or range(len(robot.driven.drives)):
        rows = robot.single_tests([drive])
        if rows and len(curves) < MAX_CURVES:
            best = max(rows, key=robot.effect_in)
            curves[robot.actuator(robot.driven.drives[drive].actuator)] = moved[best]
    test = "a test of each actuator alone, the others slack"
    return make_signal("largest displacement", OF_LENGTH, test, battery_of(robot).frame_s, curves, (MIN_EFFECT,))


_LIMIT = (
    f"largest effect of all tests whose command is held / the robot's length: at least {MIN_EFFECT:g}, or the same way "
    f"of a root through the world; a warning where one actuator stays below {MIN_SINGLE_EFFECT:g}"
)
_CURE_STIFF = "Lower the joint stiffness, raise the tendon force, or move the tendons away from the backbone."

TENDON_AGAINST_LIMIT = Rule(
    code="tendon_against_limit",
    stage=Stage.EFFECT,
    finds="Joint or tendon limits keep the actuators from moving the robot.",
    why="A joint or tendon is already at the end of its range, so every pull goes into the stop.",
    limit=f"{_LIMIT}; and {_LIMIT_GAIN:g} times the effect without limits",
    check=_find_no_effect,
    unit=OF_LENGTH,
    cure="Widen the ranges of joints and tendons in the direction the tendon pulls.",
    explains=("sensor_constant",),
    signal=effect_signal,
    example=Example(
        (
            ('<spatial name="front">', '<spatial name="front" range="0.1372 0.2" solreflimit="0.004 1">'),
            ('<spatial name="back">', '<spatial name="back" range="0.1372 0.2" solreflimit="0.004 1">'),
        )
    ),
)

WEDGED = Rule(
    code="wedged",
    stage=Stage.EFFECT,
    finds="What stands around the robot keeps the actuators from moving it.",
    why="Softer joints or stronger cables would only press it harder against a wall.",
    limit=f"{_LIMIT}; and {_LIMIT_GAIN:g} times the effect where it passes through what it touches, the ground apart",
    check=_find_no_effect,
    unit=OF_LENGTH,
    cure="Place the robot where it has room to bend, or move what it is wedged between.",
    explains=("too_stiff", "no_effect", "actuator_too_weak", "sensor_constant"),
    blame="integrator",
    signal=effect_signal,
    example=Example(
        (
            (
                "<worldbody>",
                '<worldbody>\n    <geom name="wall" type="box" size="0.05 0.05 0.08" pos="0.0615 0 0.08"/>\n'
                '    <geom name="cupboard" type="box" size="0.05 0.05 0.08" pos="-0.0615 0 0.08"/>',
            ),
            ('size="0.022 0.01"', 'size="0.011 0.01"'),
        )
    ),
)

MASS_RATIO = Rule(
    code="mass_ratio",
    stage=Stage.EFFECT,
    finds="One body is so heavy that the actuators hardly move the robot.",
    why="Beyond such a ratio the contacts and joints of the light parts lose precision too; mostly a density or a "
    "unit is "
    "wrong.",
    limit=f"{_LIMIT}; and a body of more than {MAX_MASS_RATIO:g} times the median's mass, without which the effect is "
    f"{_LIMIT_GAIN:g} times as large",
    check=_find_no_effect,
    unit="times the median segment",
    cure="Bring the mass of that body near the others'.",
    explains=("underdamped", "chatter", "limit_overrun", "sensor_constant", "implausible_density"),
    signal=effect_signal,
    example=Example(
        (
            ('<geom name="g6"/>', '<geom name="g6" mass="20"/>'),
            ('<body name="base">', '<body name="base" euler="180 0 0">'),
        )
    ),
)

ACTUATOR_TOO_WEAK = Rule(
    code="actuator_too_weak",
    stage=Stage.EFFECT,
    finds="No test moves the robot, and its strongest actuator pulls with less than half of its weight.",
    why="Such an actuator cannot lift what it drives.",
    limit=f"{_LIMIT}; and the greatest force / weight of what moves below {WEAK_SHARE:g}",
    check=_find_no_effect,
    unit="of the robot's weight",
    cure="Raise forcerange, kp or ctrlrange; bending takes about the limb's weight x length / tendon offset.",
    explains=("sensor_constant",),
    signal=effect_signal,
    example=Example((('ctrlrange="0 20"', 'ctrlrange="0 0.2"'),)),
)

TOO_STIFF = Rule(
    code="too_stiff",
    stage=Stage.EFFECT,
    finds="The actuators hardly move the robot, because its joints or tendon springs are too stiff for them.",
    why="All their force goes into springs.",
    limit=f"{_LIMIT}; and {_LIMIT_GAIN:g} times the effect with {100 * SOFTER_FACTOR:g} % of the stiffness",
    check=_find_no_effect,
    unit=OF_LENGTH,
    cure=_CURE_STIFF,
    explains=("sensor_constant",),
    signal=effect_signal,
    example=Example((('stiffness="1" damping="0.05"', 'stiffness="50" damping="2.5"'),)),
)

NO_EFFECT = Rule(
    code="no_effect",
    stage=Stage.EFFECT,
    finds="The actuators hardly move the robot, and none of the usual causes is why.",
    why="A policy can change nothing. Neither limits nor a heavy body, weak actuators or stiff joints explain it.",
    limit=_LIMIT,
    check=_find_no_effect,
    unit=OF_LENGTH,
    cure=_CURE_STIFF,
    explains=("sensor_constant",),
    signal=effect_signal,
    example=Example((('timestep="0.002"', 'timestep="0.002" viscosity="1e5"'),)),
)
