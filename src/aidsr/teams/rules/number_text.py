"""Numbers as an engineer reads them, for the texts of concepts."""

from __future__ import annotations

import math

from aidsr.sim import beam

SPRING_STEEL_PA = 200e9
"""Young's modulus of spring steel. Source: EN 10270-1 wire, 206 GPa; rounded down for the effect of fittings."""

_NUMERALS = ("no", "one", "two", "three", "four", "five", "six")


def mm(length_m: float) -> str:
    """Return a length as "376 mm", short ones with a decimal."""
    length_mm = 1000.0 * length_m
    return f"{length_mm:.0f} mm" if length_mm >= 20 else f"{length_mm:.1f} mm"


def deg(angle_rad: float) -> str:
    """Return an angle as "132 deg"."""
    return f"{math.degrees(angle_rad):.0f} deg"


def rod(bending_stiffness_n_m2: float) -> str:
    """Return the spring-steel rod of this bending stiffness as "a spring-steel rod of 1.2 mm"."""
    return f"a spring-steel rod of {1000.0 * beam.rod_diameter(bending_stiffness_n_m2, SPRING_STEEL_PA):.1f} mm"


def numeral(number: int) -> str:
    """Return a small number as a word."""
    return _NUMERALS[number] if number < len(_NUMERALS) else str(number)
