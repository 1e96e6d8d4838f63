"""Types and checks of numbers in goal files."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


def three_numbers(value: tuple[float, ...]) -> tuple[float, ...]:
    """Return the value, which must have three numbers.

    Raises:
        ValueError: The value has more or fewer than three numbers.
    """
    if len(value) != 3:
        raise ValueError(f"{len(value)} numbers instead of three, for x, y and z")
    return value


def a_direction(value: tuple[float, ...]) -> tuple[float, ...]:
    """Return the value, which must be a direction: three finite numbers that are not all 0.

    Raises:
        ValueError: The value is not a direction.
    """
    if not 1e-6 < math.hypot(*three_numbers(value)) < math.inf:
        raise ValueError(f"no direction: {list(value)}; use a finite one other than zero")
    return value
