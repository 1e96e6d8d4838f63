"""Selection of a winch for each cable: motor, spool, line and sheath.

The motors are the cheapest that can be commanded to a position, and that meet the tension, speed and stroke recorded in
the validator's tests. All winches of a robot have the same type of motor, unless that costs far more.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from aidsr.core.artifacts import Fault, ValidationReport
from aidsr.core.motors import Fit, catalogue, fastest_motor, fit
from aidsr.fabrication.anatomy import Anatomy
from aidsr.fabrication.materials import Line, Sheath, line_for, lines, sheath_for
from aidsr.fabrication.stations import SPARE_TURNS, Drum
from aidsr.mjcf.names import ROBOT_PREFIX

SHEATH_FRICTION = 0.1
"""Coefficient of friction of UHMWPE or steel in PTFE. Source: PTFE on polished steel 0.05 to 0.1; the upper end."""

SHEATH_BEND_RAD = math.pi / 2
"""Total bend angle of a sheath between winch and robot. Our choice: one quarter turn."""

SHEATH_MM, TETHER_MM = 300.0, 2000.0
"""Length of a sheath of a robot that is held, and of one that is free. Our choice: the winches stand on a board beside
the robot, and a free one drags its sheaths to a distance of about 2 m."""

_UNKNOWN_SPOOL_MM = 10.0
"""Spool radius assumed for the cut length where no motor can hold the cable. Our choice: a small spool."""

MOST_EXTRA = 2.0
"""Largest price of motors of one type / price of the cheapest motors for each cable. Our choice: one type needs one bus
and one power supply, and antagonists react alike, which is worth some motors but not the double price."""

_TIED_MM, _CUT_STEP_MM = 60.0, 10.0
"""Extra length for knots at both ends, and the step to which cut lengths are rounded up. Our choice."""


@dataclass(frozen=True)
class Demand:
    """Requirements on an actuator, as recorded in the validator's tests."""

    tension_n: float
    speed_m_s: float
    stroke_m: float

    @property
    def at_winch_n(self) -> float:
        """Tension required at the winch, with the friction of the sheath included [N].

        Source: capstan equation, T_winch = T exp(mu theta).
        """
        return self.tension_n * math.exp(SHEATH_FRICTION * SHEATH_BEND_RAD)


@dataclass(frozen=True)
class Winch:
    """The winch of one cable: motor, spool, line and sheath.

    Attributes:
        cable: Index of the cable in the anatomy.
        demand: Required tension, speed and stroke.
        fit: The motor and its spool; None where no motor with position control can hold the cable.
        line: Line from which the cable is cut; None where none is strong enough.
        sheath: Tube in which the cable runs from the winch to the robot.
        inside_mm: Length of the cable inside the robot, at rest.
        sheath_mm: Length of the sheath.
    """

    cable: int
    demand: Demand
    fit: Fit | None
    line: Line | None
    sheath: Sheath
    inside_mm: float
    sheath_mm: float

    @property
    def drum(self) -> Drum:
        """The drum of its spool."""
        reach_mm = 1000 * self.fit.spool_radius_m if self.fit else _UNKNOWN_SPOOL_MM
        return Drum(reach_mm, (self.line or lines()[-1]).diameter_mm)

    @property
    def cut_mm(self) -> float:
        """Length to cut [mm]: from the tied end to the spool, plus stroke, spare turns on the spool and knots."""
        spare = 2 * math.pi * self.drum.reach_mm * SPARE_TURNS
        way = self.inside_mm + self.sheath_mm + self.drum.free_run_mm
        return _up_to(way + 1000 * self.demand.stroke_m + spare + _TIED_MM, _CUT_STEP_MM)

    @property
    def fast_enough(self) -> bool:
        """Whether the motor reels in at least as fast as recorded in the tests."""
        return self.fit is not None and self.fit.speed_m_s >= self.demand.speed_m_s


def demands(anatomy: Anatomy, reports: Iterable[ValidationReport]) -> dict[str, Demand]:
    """Return the largest tension, speed and stroke in any of the reports, for each actuator that drives a cable.

    Reports of a scene add the prefix "robot/" to the actuators' names; both forms are accepted.
    """
    most: dict[str, Demand] = {}
    names = {cable.actuator for cable in anatomy.cables if cable.actuator}
    for report in reports:
        for name, motor in report.measurements.get("motors", {}).items():
            own = name.removeprefix(ROBOT_PREFIX)
            if own not in names:
                continue
            known = most.get(own, Demand(0.0, 0.0, 0.0))
            most[own] = Demand(
                max(known.tension_n, motor["tension_n"]),
                max(known.speed_m_s, motor["speed_m_s"]),
                max(known.stroke_m, motor["stroke_m"]),
            )
    return most


def choose_winches(
    anatomy: Anatomy, demands_by_actuator: dict[str, Demand], entries_mm: dict[int, float]
) -> tuple[Winch, ...]:
    """Return a winch for each driven cable.

    Args:
        anatomy: The robot.
        demands_by_actuator: Required tension, speed and stroke of each actuator.
        entries_mm: Length of each cable between the end of its sheath and its first guide, by the cable's index.
    """
    driven = {
        index: demands_by_actuator[cable.actuator]
        for index, cable in enumerate(anatomy.cables)
        if cable.actuator in demands_by_actuator
    }
    used = {index: line_for(demand.at_winch_n) for index, demand in driven.items()}
    fits = _motors([(demand, (used[index] or lines()[-1]).diameter_mm / 1000) for index, demand in driven.items()])
    winches, sheath_mm = [], SHEATH_MM if any(part.held for part in anatomy.parts) else TETHER_MM
    for (index, demand), chosen in zip(driven.items(), fits, strict=True):
        inside = anatomy.cables[index].length_mm + entries_mm.get(index, 0.0)
        sheath = sheath_for(used[index] or lines()[-1])
        winches.append(Winch(index, demand, chosen, used[index], sheath, inside, sheath_mm))
    return _with_common_spools(winches)


def _motors(loads: list[tuple[Demand, float]]) -> list[Fit | None]:
    """Return a motor with its spool for each cable, of one type unless that costs more than `MOST_EXTRA` times as much.

    Args:
        loads: Demand and diameter of each cable [m].

    Returns:
        The motors in the order of `loads`; the fastest where none is fast enough, None where none can hold the cable.
    """
    suitable = [_suitable(demand, cable_m) for demand, cable_m in loads]
    cheapest = [next(iter(found.values()), None) for found in suitable]
    needed = [found for found in suitable if found]
    common = next((name for name in (needed[0] if needed else ()) if all(name in found for found in needed)), None)
    if common is None:
        return cheapest
    same = [found.get(common) for found in suitable]
    return same if _price(same) <= MOST_EXTRA * _price(cheapest) else cheapest


def _suitable(demand: Demand, cable_m: float) -> dict[str, Fit]:
    """Return the motors that can be commanded to a position and meet a demand, by name, the cheapest first.

    If none is fast enough, the demanded speed is replaced by that of the fastest.
    """
    force_n, stroke_m = demand.at_winch_n, demand.stroke_m
    fastest = fastest_motor(force_n, stroke_m, cable_m=cable_m, by_position=True)
    if fastest is None:
        return {}
    speed_m_s = min(demand.speed_m_s, fastest.speed_m_s)
    fits = (fit(motor, force_n, speed_m_s, stroke_m, cable_m=cable_m, by_position=True) for motor in catalogue())
    return {found.motor.name: found for found in fits if found is not None}


def _price(fits: Sequence[Fit | None]) -> float:
    """Return the price of motors [USD]; infinite if the price of one is unknown."""
    return sum(found.motor.price_usd or math.inf for found in fits if found is not None)


def _with_common_spools(winches: list[Winch]) -> tuple[Winch, ...]:
    """Give all winches with the same motor the largest of their spools, where each still meets its demand with it."""
    radii: dict[str, float] = {}
    for winch in winches:
        if winch.fit is not None:
            name = winch.fit.motor.name
            radii[name] = max(radii.get(name, 0.0), winch.fit.spool_radius_m)
    return tuple(
        replace(winch, fit=_with_spool(winch.fit, winch.demand, radii[winch.fit.motor.name])) if winch.fit else winch
        for winch in winches
    )


def _with_spool(fit: Fit, demand: Demand, radius_m: float) -> Fit:
    """Return a motor with a larger spool, or unchanged where it would be overloaded or too slow with it."""
    torque = demand.at_winch_n * radius_m
    share = torque / fit.motor.torque_n_m("held")
    speed = fit.motor.speed_rad_s(torque) * radius_m
    if share > 1 or speed < min(demand.speed_m_s, fit.speed_m_s):
        return fit
    changed = {
        "spool_radius_m": radius_m,
        "torque_n_m": torque,
        "torque_share": share,
        "speed_m_s": speed,
        "turns": demand.stroke_m / (2 * math.pi * radius_m),
        "power_w": demand.at_winch_n * speed,
    }
    return fit.model_copy(update=changed)


def winch_faults(anatomy: Anatomy, winches: tuple[Winch, ...]) -> Iterator[Fault]:
    """Yield the demands that the catalogue cannot meet, with the fault codes of the validator's realizability layer."""
    names = {winch.cable: anatomy.cables[winch.cable].actuator for winch in winches}
    none = [winch for winch in winches if winch.fit is None]
    if none:
        worst = max(none, key=lambda winch: winch.demand.tension_n)
        yield Fault(
            code="cable_stroke",
            layer="realizability",
            severity="error",
            names=tuple(names[winch.cable] for winch in none),
            measured=worst.demand.stroke_m,
            unit="m",
            message=f"no motor with position control holds {worst.demand.at_winch_n:.3g} N over this stroke, sheath "
            "included",
            cure="Lower the tension, or bring the tendons nearer to the backbone to shorten their stroke.",
        )
    slow = [winch for winch in winches if winch.fit is not None and not winch.fast_enough]
    if slow:
        worst = min(slow, key=lambda winch: (winch.fit.speed_m_s if winch.fit else 0) / winch.demand.speed_m_s)
        yield Fault(
            code="actuator_speed",
            layer="realizability",
            severity="warning",
            names=tuple(names[winch.cable] for winch in slow),
            measured=worst.demand.speed_m_s,
            limit=worst.fit.speed_m_s if worst.fit else 0.0,
            unit="m/s",
            message="was reeled faster in simulation than the fastest motor with position control that holds it can",
            cure='Lower the force, give the actuators a time constant (dyntype="filterexact" dynprm="0.05"), or the '
            "joints more damping.",
        )
    weak = [winch for winch in winches if winch.line is None]
    if weak:
        worst = max(weak, key=lambda winch: winch.demand.tension_n)
        yield Fault(
            code="cable_strength",
            layer="realizability",
            severity="error",
            names=tuple(names[winch.cable] for winch in weak),
            measured=worst.demand.tension_n,
            unit="N",
            message="no line of the table holds this four times over",
            cure="Lower the tension: lower forcerange or ctrlrange, soften the backbone, or move the tendons away "
            "from it.",
        )
    untested = tuple(c.actuator for c in anatomy.cables if c.actuator and c.actuator not in names.values())
    if untested:
        yield Fault(
            code="cable_stroke",
            layer="realizability",
            severity="error",
            names=untested,
            message="was not driven by the validator, so that nothing says which motor it needs",
            cure="Correct the errors that the validator reports: it records tensions only of a robot without errors.",
        )
    idle = tuple(cable.tendon for cable in anatomy.cables if not cable.actuator and not cable.wraps)
    if idle:
        yield Fault(
            code="cable_idle",
            layer="realizability",
            severity="warning",
            names=idle,
            message="is driven by nothing; its duct is printed, no cable is cut",
            cure="Give the tendon an actuator, or remove the tendon.",
        )


def _up_to(length_mm: float, step_mm: float) -> float:
    return math.ceil(length_mm / step_mm) * step_mm
