"""Rules that compare the tension, speed, power and stroke of the cables with motors that can be bought."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.core.motors import can_hold, cheapest_motor
from aidsr.sim.drive import Drive
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2
from aidsr.validation.curves import Array, actuator_signal, battery_of
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.signals import Signal

TENSION_N = 500.0
TENSION_TO_WEIGHT = 50.0
TENSION_NOTICED_N = 30.0
"""Limits of the cable tension: of the largest servo winches; relative to the weight of the moving parts; and the
tension up to which the relative limit does not apply. Our choice."""
POWER_W = 300.0
SWEEP_POWER_W = 1500.0
POWER_W_KG = 200.0
POWER_NOTICED_W = 50.0
"""Limits of the mechanical power of one actuator: while commands ramp; in the random sweep; per kg of moving parts
(geared servos give 50 to 200 W/kg); and the power up to which the limit per kg does not apply. Our choice."""
CABLE_SPEED_M_S = 0.5
"""Largest cable speed; winches with the forces used here reel in 0.1 to 0.25 m/s. Our choice."""


@dataclass(frozen=True)
class Effort:
    """The load on one tendon actuator in the tests.

    Attributes:
        drive: The actuator.
        tension_n: Largest tension in any test [N].
        speed_m_s: Largest cable speed in or out under tension, in all tests except the random sweep [m/s].
        stroke_m: Difference between the tendon's longest and shortest length over all tests [m].
        power_w: Largest mechanical power in all tests except the random sweep [W].
        sweep_power_w: Largest mechanical power in the random sweep [W].
    """

    drive: Drive
    tension_n: float
    speed_m_s: float
    stroke_m: float
    power_w: float
    sweep_power_w: float


def efforts(robot: RobotUnderTest) -> list[Effort]:
    """Return the load on every tendon actuator in the tests; empty if the simulation of settling failed."""
    evidence, battery = robot.driven, robot.driven.battery
    if battery is None:
        return []
    sweep = np.array([test.kind == "sweep" for test in evidence.tests])
    found = []
    for drive in evidence.drives:
        if not drive.on_tendon:
            continue
        tendon = int(robot.model.actuator_trnid[drive.actuator, 0])
        pull, speed = _pull_n(robot, drive), _speed_under_tension_m_s(robot, drive)
        power = pull * _reeling_m_s(robot, drive)
        found.append(
            Effort(
                drive=drive,
                tension_n=float(pull.max()),
                speed_m_s=float(speed[~sweep].max(initial=0.0)),
                stroke_m=float(np.ptp(battery.fields["ten_length"][:, :, tendon])),
                power_w=float(power[~sweep].max(initial=0.0)),
                sweep_power_w=float(power[sweep].max(initial=0.0)),
            )
        )
    return found


def _pull_n(robot: RobotUnderTest, drive: Drive) -> Array:
    """Return the tension from an actuator, 0 while it pushes, (n_tests, n_frames) [N]."""
    return np.maximum(-robot.force_n(drive), 0.0)


def _speed_under_tension_m_s(robot: RobotUnderTest, drive: Drive) -> Array:
    """Return the speed of an actuator's tendon in or out, 0 while it is not pulled, (n_tests, n_frames) [m/s]."""
    tendon = int(robot.model.actuator_trnid[drive.actuator, 0])
    speed = np.abs(battery_of(robot).fields["ten_velocity"][:, :, tendon])
    return np.where(_pull_n(robot, drive) > 0, speed, 0.0)


def _reeling_m_s(robot: RobotUnderTest, drive: Drive) -> Array:
    """Return the speed at which an actuator reels its tendon in, 0 while it reels out, (n_tests, n_frames) [m/s]."""
    tendon = int(robot.model.actuator_trnid[drive.actuator, 0])
    return np.maximum(-drive.side * battery_of(robot).fields["ten_velocity"][:, :, tendon], 0.0)


def most_tension_n(weight_n: float) -> float:
    """Return the largest allowed cable tension [N] for moving parts of a weight [N]; see `actuator_overforce`."""
    return min(TENSION_N, max(TENSION_NOTICED_N, TENSION_TO_WEIGHT * weight_n))


def _find_overforce(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find cable tensions above those of servo winches, or unreasonably large for the robot's weight."""
    weight_n = robot.structure.mass_kg * STANDARD_GRAVITY_M_S2
    allowed_n = most_tension_n(weight_n)
    strong = [effort for effort in efforts(robot) if effort.tension_n > allowed_n]
    if strong:
        yield _fault(
            robot,
            ACTUATOR_OVERFORCE,
            strong,
            measured=max(effort.tension_n for effort in strong),
            limit=allowed_n,
            message=f"cable tension of a robot whose moving parts weigh {weight_n:.3g} N",
        )


def _find_overpower(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find actuators with more mechanical power than motors of this size have."""
    per_kg = max(POWER_NOTICED_W, POWER_W_KG * robot.structure.mass_kg)
    allowed_w = min(POWER_W, per_kg)
    strong = [e for e in efforts(robot) if e.power_w > allowed_w or e.sweep_power_w > SWEEP_POWER_W]
    if strong:
        worst = max(strong, key=lambda e: max(e.power_w / allowed_w, e.sweep_power_w / SWEEP_POWER_W))
        ramped = worst.power_w > allowed_w
        yield _fault(
            robot,
            ACTUATOR_POWER,
            strong,
            measured=worst.power_w if ramped else worst.sweep_power_w,
            limit=allowed_w if ramped else SWEEP_POWER_W,
            message="mechanical power " + ("while the command ramps" if ramped else "in the random sweep"),
        )


def _find_overspeed(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find cables reeled faster than a winch can."""
    fast = [effort for effort in efforts(robot) if effort.speed_m_s > CABLE_SPEED_M_S]
    if fast:
        yield _fault(
            robot,
            ACTUATOR_SPEED,
            fast,
            measured=max(effort.speed_m_s for effort in fast),
            limit=CABLE_SPEED_M_S,
            message="cable speed while the command ramps",
        )


def _find_long_strokes(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find cables whose tension and stroke together exceed every motor of the catalogue.

    Tensions above `TENSION_N` are faults of `actuator_overforce`; they count as `TENSION_N` here.
    """
    asked = [replace(effort, tension_n=min(effort.tension_n, TENSION_N)) for effort in efforts(robot)]
    most = [max((getattr(effort, name) for effort in asked), default=0.0) for name in ("tension_n", "stroke_m")]
    # a motor for the largest tension and the largest stroke together is sufficient for every cable
    if not asked or can_hold(*most):
        return
    out_of_reach = [effort for effort in asked if not can_hold(effort.tension_n, effort.stroke_m)]
    if out_of_reach:
        worst = max(out_of_reach, key=lambda effort: effort.tension_n * effort.stroke_m)
        yield _fault(
            robot,
            CABLE_STROKE,
            out_of_reach,
            measured=worst.stroke_m,
            limit=_reach_m(worst),
            message=f"no motor of the catalogue holds {worst.tension_n:.3g} N over this stroke of its cable",
        )


def _reach_m(effort: Effort) -> float:
    """Return the longest stroke for which a motor holds the tension [m], accurate to a millimetre."""
    low, high = 0.0, effort.stroke_m
    while high - low > 1e-3:
        middle = (low + high) / 2
        low, high = (middle, high) if can_hold(effort.tension_n, middle) else (low, middle)
    return low


def motor_measurements(robot: RobotUnderTest) -> dict[str, dict[str, float | str]]:
    """Return the load on each tendon actuator and the cheapest motor for it ("" if none exists), by actuator name."""
    asked: dict[str, dict[str, float | str]] = {}
    motors: dict[tuple[float, ...], str] = {}
    for effort in efforts(robot):
        speed_m_s = min(effort.speed_m_s, CABLE_SPEED_M_S)
        demand = tuple(_rounded_up(value) for value in (effort.tension_n, speed_m_s, effort.stroke_m))
        if demand not in motors:
            motors[demand] = str(cheapest_motor(*demand) or "")
        asked[robot.actuator(effort.drive.actuator)] = {
            "tension_n": round(effort.tension_n, 4),
            "speed_m_s": round(effort.speed_m_s, 4),
            "stroke_m": round(effort.stroke_m, 5),
            "power_w": round(effort.power_w, 4),
            "sweep_power_w": round(effort.sweep_power_w, 4),
            "cheapest_motor": motors[demand],
        }
    return asked


def _rounded_up(value: float) -> float:
    """Round a value up to two significant digits, so that tendons with equal loads get the same motor."""
    if value <= 0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / step) * step


def _fault(
    robot: RobotUnderTest, rule: Rule, found: list[Effort], *, measured: float, limit: float, message: str
) -> Fault:
    names = tuple(robot.actuator(effort.drive.actuator) for effort in found)
    return rule.fault(message, names=names, measured=measured, limit=limit)


def _tension_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    def tension(drive: int, _tendon: int) -> Array:
        return -robot.force_n(robot.driven.drives[drive])

    return actuator_signal(robot, fault, "tension", fault.unit, tension)


def _power_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    def power(index: int, _tendon: int) -> Array:
        drive = robot.driven.drives[index]
        return _pull_n(robot, drive) * _reeling_m_s(robot, drive)

    return actuator_signal(robot, fault, "mechanical power", fault.unit, power)


def _speed_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    def speed(index: int, _tendon: int) -> Array:
        sweep = np.array([test.kind == "sweep" for test in robot.driven.tests])[:, None]
        return np.where(sweep, 0.0, _speed_under_tension_m_s(robot, robot.driven.drives[index]))

    return actuator_signal(robot, fault, "cable speed", fault.unit, speed)


ACTUATOR_OVERFORCE = Rule(
    code="actuator_overforce",
    stage=Stage.BUILDING,
    finds="A cable is pulled harder than a winch can pull, or than the robot's weight gives reason for.",
    why="What pulls a light limb with hundreds of newtons breaks it, and no servo winch of its size does.",
    limit=f"tension: at most {TENSION_N:g} N, and at most {TENSION_TO_WEIGHT:g} times the weight of the moving "
    "parts from "
    f"{TENSION_NOTICED_N:g} N up",
    check=_find_overforce,
    unit="N",
    cure="Lower forcerange or ctrlrange, soften the backbone, or move the tendons away from it.",
    signal=_tension_signal,
    example=Example((('ctrlrange="0 20"', 'ctrlrange="0 60"'),)),
)

ACTUATOR_POWER = Rule(
    code="actuator_power",
    stage=Stage.BUILDING,
    finds="An actuator gives more mechanical power than a motor of its size.",
    why="Force and speed are each to be had, and not both at once: geared servos give 50 to 200 W/kg.",
    limit=f"mechanical power while commands ramp: at most {POWER_W:g} W, and at most {POWER_W_KG:g} W per kg of "
    "moving parts "
    f"from {POWER_NOTICED_W:g} W up; in the random sweep: at most {SWEEP_POWER_W:,.0f} W",
    check=_find_overpower,
    unit="W",
    cure='Give the actuators a time constant (dyntype="filterexact" dynprm="0.05") or less force.',
    signal=_power_signal,
    example=Example((('ctrlrange="0 20"', 'ctrlrange="0 200"'),)),
)

ACTUATOR_SPEED = Rule(
    code="actuator_speed",
    stage=Stage.BUILDING,
    finds="A cable is reeled faster than a winch can.",
    why="Winches with the forces used here reel in 0.1 to 0.25 m/s; a policy that relies on more fails on the "
    "built robot.",
    limit=f"cable speed while commands ramp: at most {CABLE_SPEED_M_S:g} m/s",
    check=_find_overspeed,
    unit="m/s",
    cure='Lower the force, give the actuators a time constant (dyntype="filterexact" dynprm="0.05"), or the joints '
    "more damping.",
    signal=_speed_signal,
    example=Example((('ctrlrange="0 20"', 'ctrlrange="0 150"'),)),
)

CABLE_STROKE = Rule(
    code="cable_stroke",
    stage=Stage.BUILDING,
    finds="No motor of the catalogue takes up so much cable at such a tension.",
    why="A spool of a motor that can be bought holds only so much, and a larger one halves the pull.",
    limit=f"stroke: what any motor of the catalogue takes up at that tension, of {TENSION_N:g} N at most",
    check=_find_long_strokes,
    unit="m",
    cure="Lower the tension, or bring the tendons nearer to the backbone to shorten their stroke.",
    example=Example(
        (
            ('pos="0 0 0.025"', 'pos="0 0 0.1"'),
            ('size="0.011 0.012" pos="0 0 0.0125" mass="0.01"', 'size="0.04 0.048" pos="0 0 0.05" mass="0.3"'),
            (' 0.0125"/>', ' 0.05"/>'),
            ('size="0.022 0.01"', 'size="0.05 0.01"'),
            ('pos="0.009 0 ', 'pos="0.15 0 '),
            ('pos="-0.009 0 ', 'pos="-0.15 0 '),
            ('stiffness="1" damping="0.05"', 'stiffness="60" damping="60"'),
            ('ctrlrange="0 20"', 'ctrlrange="0 250"'),
        )
    ),
)
