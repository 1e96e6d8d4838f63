"""Could it be bought and built: forces, speeds and powers against real motors, densities against real matter."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.core.motors import can_hold, cheapest_motor
from aidsr.validation.drive import Drive
from aidsr.validation.protocol import STANDARD_GRAVITY_M_S2
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.solids import volume_m3


@dataclass(frozen=True)
class Effort:
    """What the tests ask of one tendon actuator.

    Attributes:
        drive: The actuator.
        tension_n: Greatest pull in any test [N].
        speed_m_s: Fastest reeling in or out while commands ramp [m/s].
        stroke_m: Difference between the tendon's longest and shortest length in any test [m].
        power_w: Greatest mechanical power while commands ramp [W].
        sweep_power_w: The same in the random sweep [W].
    """

    drive: Drive
    tension_n: float
    speed_m_s: float
    stroke_m: float
    power_w: float
    sweep_power_w: float


def efforts(robot: RobotUnderTest) -> list[Effort]:
    """Return what the tests ask of every tendon actuator; nothing where the robot did not survive settling."""
    evidence, battery = robot.driven, robot.driven.battery
    if battery is None:
        return []
    sweep = np.array([test.kind == "sweep" for test in evidence.tests])
    found = []
    for drive in evidence.drives:
        if not drive.on_tendon:
            continue
        tendon = int(robot.model.actuator_trnid[drive.actuator, 0])
        pull = np.maximum(-robot.force_n(drive), 0.0)
        speed = np.where(pull > 0, np.abs(battery.fields["ten_velocity"][:, :, tendon]), 0.0)
        power = pull * np.maximum(-battery.fields["ten_velocity"][:, :, tendon], 0.0)
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


def actuator_overforce(robot: RobotUnderTest) -> Iterator[Fault]:
    """Cable tension stays within what servo winches give, and within reason for the robot's weight."""
    limits, weight_n = robot.limits, robot.structure.mass_kg * STANDARD_GRAVITY_M_S2
    allowed_n = min(limits.tension_n, max(limits.tension_noticed_n, limits.tension_to_weight * weight_n))
    strong = [effort for effort in efforts(robot) if effort.tension_n > allowed_n]
    if strong:
        yield _fault(
            robot,
            "actuator_overforce",
            strong,
            measured=max(effort.tension_n for effort in strong),
            limit=allowed_n,
            unit="N",
            message=f"cable tension of a robot whose moving parts weigh {weight_n:.3g} N",
            cure="Lower forcerange or ctrlrange, soften the backbone, or move the tendons away from it.",
        )


def actuator_power(robot: RobotUnderTest) -> Iterator[Fault]:
    """Mechanical power stays within what motors of this size give."""
    limits = robot.limits
    per_kg = max(limits.power_noticed_w, limits.power_w_kg * robot.structure.mass_kg)
    allowed_w = min(limits.power_w, per_kg)
    strong = [e for e in efforts(robot) if e.power_w > allowed_w or e.sweep_power_w > limits.sweep_power_w]
    if strong:
        worst = max(strong, key=lambda e: max(e.power_w / allowed_w, e.sweep_power_w / limits.sweep_power_w))
        ramped = worst.power_w > allowed_w
        yield _fault(
            robot,
            "actuator_power",
            strong,
            measured=worst.power_w if ramped else worst.sweep_power_w,
            limit=allowed_w if ramped else limits.sweep_power_w,
            unit="W",
            message="mechanical power " + ("while the command ramps" if ramped else "in the random sweep"),
            cure='Give the actuators a time constant (dyntype="filterexact" dynprm="0.05") or less force.',
        )


def actuator_speed(robot: RobotUnderTest) -> Iterator[Fault]:
    """Cables are not reeled faster than a winch can."""
    fast = [effort for effort in efforts(robot) if effort.speed_m_s > robot.limits.cable_speed_m_s]
    if fast:
        yield _fault(
            robot,
            "actuator_speed",
            fast,
            measured=max(effort.speed_m_s for effort in fast),
            limit=robot.limits.cable_speed_m_s,
            unit="m/s",
            message="cable speed while the command ramps",
            cure='Give the actuators a time constant (dyntype="filterexact" dynprm="0.05"), or more joint damping.',
        )


def no_motor_fits(robot: RobotUnderTest) -> Iterator[Fault]:
    """Some motor of the catalogue can hold the tension and take up the stroke.

    A tension that no motor holds over any stroke is `actuator_overforce`; the stroke is looked at as if it were cured.
    """
    most_n = robot.limits.tension_n
    asked = [replace(effort, tension_n=min(effort.tension_n, most_n)) for effort in efforts(robot)]
    most = [max((getattr(effort, name) for effort in asked), default=0.0) for name in ("tension_n", "stroke_m")]
    # one motor that can do the most of everything can do all
    if not asked or can_hold(*most):
        return
    out_of_reach = [effort for effort in asked if not can_hold(effort.tension_n, effort.stroke_m)]
    if out_of_reach:
        worst = max(out_of_reach, key=lambda effort: effort.tension_n * effort.stroke_m)
        yield _fault(
            robot,
            "cable_stroke",
            out_of_reach,
            measured=worst.stroke_m,
            limit=_reach_m(worst),
            unit="m",
            message=f"no motor of the catalogue holds {worst.tension_n:.3g} N over this stroke of its cable",
            cure="Lower the tension, or bring the tendons nearer to the backbone to shorten their stroke.",
        )


def _reach_m(effort: Effort) -> float:
    """Longest stroke for which a motor holds the tension, to a millimetre [m]."""
    low, high = 0.0, effort.stroke_m
    while high - low > 1e-3:
        middle = (low + high) / 2
        low, high = (middle, high) if can_hold(effort.tension_n, middle) else (low, middle)
    return low


def implausible_density(robot: RobotUnderTest) -> Iterator[Fault]:
    """Every body that moves is made of something: denser than foam, lighter than osmium."""
    model, limits = robot.model, robot.limits
    odd: dict[str, float] = {}
    for body in robot.structure.bodies:
        geoms = [geom for geom in robot.structure.geoms if int(model.geom_bodyid[geom]) == body]
        volumes = [volume for geom in geoms if (volume := volume_m3(model, geom)) is not None]
        if not volumes or len(volumes) < len(geoms) or model.body_mass[body] == 0:
            continue
        density = float(model.body_mass[body]) / sum(volumes)
        if not limits.density_low_kg_m3 <= density <= limits.density_high_kg_m3:
            odd[robot.body(body)] = density
    if odd:
        worst = max(odd.values(), key=lambda density: max(density, 1 / density))
        heavy = worst > limits.density_high_kg_m3
        yield Fault(
            code="implausible_density",
            layer="realizability",
            severity="error",
            names=tuple(odd),
            measured=worst,
            limit=limits.density_high_kg_m3 if heavy else limits.density_low_kg_m3,
            unit="kg/m3",
            message="mass / volume of its geoms is " + ("more than" if heavy else "less than") + " any solid has",
            cure="Give geoms a density (printed plastic 1,200, silicone 1,100, aluminium 2,700) instead of a mass.",
        )


def motor_measurements(robot: RobotUnderTest) -> dict[str, dict[str, float | str]]:
    """Return what each tendon actuator was asked for, and the cheapest motor that gives it, "" for none."""
    asked: dict[str, dict[str, float | str]] = {}
    motors: dict[tuple[float, ...], str] = {}
    for effort in efforts(robot):
        speed_m_s = min(effort.speed_m_s, robot.limits.cable_speed_m_s)
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
    """The next number of two digits, so that tendons that ask for the same get the same motor."""
    if value <= 0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / step) * step


def _fault(
    robot: RobotUnderTest,
    code: str,
    found: list[Effort],
    *,
    measured: float,
    limit: float,
    unit: str,
    message: str,
    cure: str,
) -> Fault:
    return Fault(
        code=code,
        layer="realizability",
        severity="error",
        names=tuple(robot.actuator(effort.drive.actuator) for effort in found),
        measured=measured,
        limit=limit,
        unit=unit,
        message=message,
        cure=cure,
    )
