"""Result of a writer, and formatting of numbers and points."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Written:
    """A robot as its writer made it.

    Attributes:
        family: Kind of body.
        mjcf: MJCF of the robot.
    """

    family: str
    mjcf: str


Writer = Callable[[np.random.Generator], Written]
"""Writes one robot; the random generator decides all free choices."""


def number(value: float) -> str:
    """Return a number as text with at most six significant digits."""
    return f"{value:.6g}" if abs(value) > 1e-9 else "0"


def numbers(values: Sequence[float]) -> str:
    """Return several numbers as the value of an attribute."""
    return " ".join(map(number, values))


def around(count: int, radius_m: float, first_rad: float = 0.0) -> list[tuple[float, float]]:
    """Return points that are evenly spaced on a circle [m]."""
    angles = [first_rad + 2 * math.pi * index / count for index in range(count)]
    return [(radius_m * math.cos(angle), radius_m * math.sin(angle)) for angle in angles]
