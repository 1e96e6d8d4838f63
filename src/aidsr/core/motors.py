"""Selection of commercially available motors for the force, speed and stroke that the cables of a robot require.

The catalogue is `motors.toml` beside this file, with a source for every value. A motor drives a spool of radius r: the
cable force is F = T / r, the cable speed v = omega r, and the stroke r times the angle of rotation.
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
"""Duration of a load: "held" for an unlimited time, or "brief" as in the fast motions of an exploring policy."""

CONTINUOUS_SHARE = 0.2
"""Continuous torque of a geared servo / its stall torque, if no rated torque is published.

Source: ROBOTIS states the continuous torque of its servos as 20 % of the stall torque; Feetech rates the STS3215 and
STS3250 at 33 and 32 %, so this value is conservative.
"""

_BRIEF_SHARE = 0.5
"""Torque for a brief load / stall torque. Source: a DC motor has its maximum power at half of its stall torque; beyond
that, more current only produces heat."""

_SPOOL_RADII_M = tuple(step / 2000.0 for step in range(10, 61))
"""Available spool radii: 5 to 30 mm in steps of 0.5 mm. Our choice: larger diameters than 60 mm are impractical."""

_BENDS = 10.0
"""Least diameter of a drum / diameter of its cable. Our choice: a steel cable of 1 mm bends around a drum of 10 mm."""

MOST_TURNS = 10.0
"""Maximum turns of cable on a spool. Our choice: one layer of a 1 mm cable on a spool 10 mm wide, so that the radius
stays constant."""


class Motor(Artifact):
    """A motor of the catalogue; values that its manufacturer does not publish are None."""

    name: str
    voltage_v: float
    stall_torque_n_m: float | None = None
    no_load_speed_rpm: float | None = None
    rated_torque_n_m: float | None = None
    rated_speed_rpm: float | None = None
    peak_torque_n_m: float | None = None
    mass_kg: float | None = None
    travel_deg: float | None = None
    """Range of rotation [deg]; None if it is unlimited."""
    position_turns: float | None = None
    """Turns from its zero, in each direction, to which its own controller can be commanded and which it reports; None
    for a motor without a controller, and for a servo that reports no angle."""
    price_usd: float | None = None
    """Approximate price of one piece on `price_date`."""
    price_date: str = ""
    source: str

    def torque_n_m(self, load: Load) -> float:
        """Return the torque that the motor may provide under a load of this kind [N m]."""
        if load == "held" and self.rated_torque_n_m is not None:
            return self.rated_torque_n_m
        limit = math.inf if self.peak_torque_n_m is None else self.peak_torque_n_m
        if self.stall_torque_n_m is None:
            return limit
        return min(limit, self.stall_torque_n_m * (CONTINUOUS_SHARE if load == "held" else _BRIEF_SHARE))

    def speed_rad_s(self, torque_n_m: float) -> float:
        """Return the speed that the motor reaches against a torque [rad/s].

        Source: linear torque-speed curve of a permanent-magnet DC motor, omega = omega_0 (1 - T / T_stall). A motor of
        which only the rated point is known gets the rated speed up to the rated torque, and 0 above it.
        """
        if self.no_load_speed_rpm is not None and self.stall_torque_n_m is not None:
            return self.no_load_speed_rpm * math.pi / 30.0 * max(0.0, 1.0 - torque_n_m / self.stall_torque_n_m)
        if self.rated_speed_rpm is not None and torque_n_m <= (self.rated_torque_n_m or 0.0):
            return self.rated_speed_rpm * math.pi / 30.0
        return 0.0


class Fit(Artifact):
    """A motor with a spool that meets the requirements of a cable."""

    motor: Motor
    spool_radius_m: float
    """Distance from the axis of the shaft to the centre of the cable on the drum [m]."""
    torque_n_m: float
    """Torque that the required force needs at this spool [N m]."""
    torque_share: float
    """That torque / the torque that the motor may provide under this load."""
    speed_m_s: float
    """Cable speed that the motor reaches against the required force [m/s]."""
    turns: float
    """Turns of the spool for the required stroke."""
    power_w: float
    """Mechanical power at the required force and that speed [W]."""

    def __str__(self) -> str:
        """Return a description of the motor and the spool."""
        price = f", about {self.motor.price_usd:.0f} USD ({self.motor.price_date})" if self.motor.price_usd else ""
        return f"{self.motor.name}{price}, spool radius {self.spool_radius_m * 1000:.1f} mm"


@cache
def catalogue() -> tuple[Motor, ...]:
    """Return all motors, the cheapest first; motors without a known price come last, the lightest first."""
    text = files("aidsr.core").joinpath("motors.toml").read_text(encoding="utf-8")
    return tuple(sorted(map(Motor.model_validate, tomllib.loads(text)["motor"]), key=_by_price))


def cheapest_motor(
    force_n: float, speed_m_s: float, stroke_m: float, *, cable_m: float = 0.0, load: Load = "held"
) -> Fit | None:
    """Return the cheapest motor of the catalogue that meets the requirements of a cable, with its spool, or None.

    Args:
        force_n: Tension of the cable [N].
        speed_m_s: Speed at which the cable must be reeled in against that tension [m/s].
        stroke_m: Length of cable that must be taken up [m].
        cable_m: Diameter of the cable [m]; its bending radius limits the radius of the spool.
        load: Duration of the load.
    """
    fits = (fit(motor, force_n, speed_m_s, stroke_m, cable_m=cable_m, load=load) for motor in catalogue())
    return next((found for found in fits if found), None)


def fastest_motor(
    force_n: float,
    stroke_m: float = 0.0,
    *,
    cable_m: float = 0.0,
    load: Load = "held",
    by_position: bool = False,
) -> Fit | None:
    """Return the motor that reels in fastest against a force, to report how far a required speed is out of reach.

    The arguments are those of `fit`.
    """
    fits = [found for motor in catalogue() for found in _spools(motor, force_n, stroke_m, cable_m, load, by_position)]
    return max(fits, key=lambda found: found.speed_m_s, default=None)


def can_hold(force_n: float, stroke_m: float) -> bool:
    """Return whether any motor of the catalogue can hold a force and take up a stroke, at any speed."""
    return any(True for motor in catalogue() for _ in _spools(motor, force_n, stroke_m, 0.0, "held", False))


def fit(
    motor: Motor,
    force_n: float,
    speed_m_s: float,
    stroke_m: float,
    *,
    cable_m: float = 0.0,
    load: Load = "held",
    by_position: bool = False,
) -> Fit | None:
    """Return a motor with the smallest spool that meets the requirements, or None.

    The smallest spool needs the least torque, so that the motor stays coolest.

    Args:
        motor: The motor.
        force_n: Tension of the cable [N].
        speed_m_s: Speed at which the cable must be reeled in against that tension [m/s].
        stroke_m: Length of cable that must be taken up [m].
        cable_m: Diameter of the cable [m]; its bending radius limits the radius of the spool.
        load: Duration of the load.
        by_position: Whether the motor's own controller must turn the spool to commanded positions.
    """
    spools = _spools(motor, force_n, stroke_m, cable_m, load, by_position)
    return next((found for found in spools if found.speed_m_s >= speed_m_s), None)


def _spools(
    motor: Motor, force_n: float, stroke_m: float, cable_m: float, load: Load, by_position: bool
) -> Iterator[Fit]:
    """Yield the spools with which a motor can hold the force and take up the stroke of a cable, the smallest first."""
    allowed = motor.torque_n_m(load)
    most_turns = MOST_TURNS if motor.travel_deg is None else motor.travel_deg / 360.0
    if by_position:
        if motor.position_turns is None:
            return
        most_turns = min(most_turns, motor.position_turns)
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
