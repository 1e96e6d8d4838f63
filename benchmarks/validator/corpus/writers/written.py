"""What a writer hands over, and how it writes numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Written:
    """A robot fresh from its writer.

    Attributes:
        family: What kind of body it is.
        mjcf: The document.
    """

    family: str
    mjcf: str


Writer = Callable[[np.random.Generator], Written]
"""Writes one robot; the generator decides everything that is left open."""


def number(value: float) -> str:
    """Return a number as people write it, six digits."""
    return f"{value:.6g}" if abs(value) > 1e-9 else "0"


def numbers(values: Sequence[float]) -> str:
    """Return several numbers as an attribute."""
    return " ".join(map(number, values))


def around(count: int, radius_m: float, first_rad: float = 0.0) -> list[tuple[float, float]]:
    """Return points evenly spaced on a circle."""
    angles = [first_rad + 2 * math.pi * index / count for index in range(count)]
    return [(radius_m * math.cos(angle), radius_m * math.sin(angle)) for angle in angles]
