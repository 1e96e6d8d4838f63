"""Which motor that can be bought pulls a cable as hard, as fast and as far as a robot asks.

The catalogue is `motors.toml` beside this file, every value with its source. A motor drives a spool of radius r: the
cable's force is F = T / r, its speed v = omega r, its stroke r times the angle turned.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from typing import Literal

from aidsr.core.artifacts import Artifact

Load = Literal["held", "brief"]
"""Whether a force is held for as long as the robot likes, or for moments, as in an exploring policy's swings."""

CONTINUOUS_SHARE = 0.2
"""Torque a geared servo can give all the time / its stall torque, where no rated torque is published.

Source: ROBOTIS states the continuous torque of its servos as 20 % of stall; Feetech rates the STS3215 and STS3250 at
33 and 32 %, so this is on the safe side.
"""

_BRIEF_SHARE = 0.5
"""Torque for moments / stall torque. Source: a DC motor gives its greatest power at half of its stall torque; beyond it
more current only makes heat."""

_SPOOL_RADII_M = tuple(step / 2000.0 for step in range(10, 61))
"""5 to 30 mm in steps of half a millimetre. Our choice: a larger spool than 60 mm across is a wheel."""

_BENDS = 10.0
"""Diameter of a drum / that of its cable, at least. Our choice: a steel cable of 1 mm bends around a centimetre."""

MOST_TURNS = 10.0
"""Turns of cable on a spool. Our choice: one layer of a 1 mm cable on a spool a centimetre wide, so that its radius
stays what it is."""


class Motor(Artifact):
    """A motor of the catalogue; what its maker does not publish is None."""

    name: str
    voltage_v: float
    stall_torque_n_m: float | None = None
    no_load_speed_rpm: float | None = None
    rated_torque_n_m: float | None = None
    rated_speed_rpm: float | None = None
    peak_torque_n_m: float | None = None
    mass_kg: float | None = None
    travel_deg: float | None = None
    """How far it turns; None when it turns endlessly."""
    price_usd: float | None = None
    """Approximate price of one piece on `price_date`."""
    price_date: str = ""
    source: str

    def torque_n_m(self, load: Load) -> float:
        """Torque it may give under a load of this kind [N m]."""
        if load == "held" and self.rated_torque_n_m is not None:
            return self.rated_torque_n_m
        limit = math.inf if self.peak_torque_n_m is None else self.peak_torque_n_m
        if self.stall_torque_n_m is None:
            return limit
        return min(limit, self.stall_torque_n_m * (CONTINUOUS_SHARE if load == "held" else _BRIEF_SHARE))

    def speed_rad_s(self, torque_n_m: float) -> float:
        """Speed it reaches against a torque [rad/s].

        Source: straight torque-speed line of a permanent-magnet DC motor, omega = omega_0 (1 - T / T_stall). A drive
        known at its rated point only is counted on for the rated speed up to the rated torque, and for nothing beyond.
        """
        if self.no_load_speed_rpm is not None and self.stall_torque_n_m is not None:
            return self.no_load_speed_rpm * math.pi / 30.0 * max(0.0, 1.0 - torque_n_m / self.stall_torque_n_m)
        if self.rated_speed_rpm is not None and torque_n_m <= (self.rated_torque_n_m or 0.0):
            return self.rated_speed_rpm * math.pi / 30.0
        return 0.0


class Fit(Artifact):
    """A motor with a spool that does what is asked."""

    motor: Motor
    spool_radius_m: float
    """From the shaft to the middle of the cable on its drum."""
    torque_n_m: float
    """What the asked force needs at this spool."""
    torque_share: float
    """That torque / what the motor may give under this load."""
    speed_m_s: float
    """Speed of the cable the motor reaches against the asked force."""
    turns: float
    """Turns of the spool for the asked stroke."""
    power_w: float
    """Mechanical power at the asked force and that speed."""

    def __str__(self) -> str:
        """Return the motor and the spool in words."""
        price = f", about {self.motor.price_usd:.0f} USD ({self.motor.price_date})" if self.motor.price_usd else ""
        return f"{self.motor.name}{price}, spool radius {self.spool_radius_m * 1000:.1f} mm"


@cache
def catalogue() -> tuple[Motor, ...]:
    """Return all motors, cheapest first; those without a known price last, lightest first."""
    text = files("aidsr.core").joinpath("motors.toml").read_text(encoding="utf-8")
    return tuple(sorted(map(Motor.model_validate, tomllib.loads(text)["motor"]), key=_by_price))


def cheapest_motor(
    force_n: float, speed_m_s: float, stroke_m: float, *, cable_m: float = 0.0, load: Load = "held"
) -> Fit | None:
    """Return the cheapest motor of the catalogue, with its spool, that pulls a cable as asked, or None.

    Args:
        force_n: Tension of the cable [N].
        speed_m_s: Speed at which it must reel in against that tension [m/s].
        stroke_m: Length of cable it must take up [m].
        cable_m: Diameter of the cable, whose bending limits the spool [m].
        load: Whether the force is held or given for moments.
    """
    fits = (fit(motor, force_n, speed_m_s, stroke_m, cable_m=cable_m, load=load) for motor in catalogue())
    return next((found for found in fits if found), None)


def fastest_motor(force_n: float, stroke_m: float = 0.0, *, cable_m: float = 0.0, load: Load = "held") -> Fit | None:
    """Return the motor that reels in fastest against a force, to show by how much a speed is out of reach."""
    fits = [found for motor in catalogue() for found in _spools(motor, force_n, stroke_m, cable_m, load)]
    return max(fits, key=lambda found: found.speed_m_s, default=None)


def can_hold(force_n: float, stroke_m: float) -> bool:
    """Return whether any motor of the catalogue holds a force and takes up a stroke, however slowly."""
    return any(True for motor in catalogue() for _ in _spools(motor, force_n, stroke_m, 0.0, "held"))


def fit(
    motor: Motor, force_n: float, speed_m_s: float, stroke_m: float, *, cable_m: float = 0.0, load: Load = "held"
) -> Fit | None:
    """Return one motor with the smallest spool that does what is asked, or None.

    The smallest spool asks for the least torque, so the motor stays coolest.
    """
    spools = _spools(motor, force_n, stroke_m, cable_m, load)
    return next((found for found in spools if found.speed_m_s >= speed_m_s), None)


def _spools(motor: Motor, force_n: float, stroke_m: float, cable_m: float, load: Load) -> Iterator[Fit]:
    """Yield the spools, smallest first, with which a motor can hold the force and take up the stroke of a cable."""
    allowed = motor.torque_n_m(load)
    most_turns = MOST_TURNS if motor.travel_deg is None else motor.travel_deg / 360.0
    for radius in _SPOOL_RADII_M:
        torque, turns = force_n * radius, stroke_m / (2.0 * math.pi * radius)
        if 2.0 * radius >= (_BENDS + 1.0) * cable_m and torque <= allowed and turns <= most_turns:
            speed = motor.speed_rad_s(torque) * radius
            yield Fit(
                motor=motor,
                spool_radius_m=radius,
                torque_n_m=torque,
                torque_share=torque / allowed,
                speed_m_s=speed,
                turns=turns,
                power_w=force_n * speed,
            )


def _by_price(motor: Motor) -> tuple[float, float, str]:
    unknown = math.inf
    return (motor.price_usd or unknown, motor.mass_kg or unknown, motor.name)
