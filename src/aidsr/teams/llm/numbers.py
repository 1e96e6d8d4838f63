"""Numbers of an environment as prompts have them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

_MAX_POSITIONS = 60
"""Of more positions without a pattern only the bounds are given. Our choice: nobody needs each stone of gravel."""


def format_positions(positions: Sequence[Iterable[float]]) -> str:
    """Return positions without a pattern."""
    if len(positions) <= _MAX_POSITIONS:
        return "at " + ", ".join(format_vector(position) for position in positions)
    columns = list(zip(*positions, strict=True))
    return f"in no order within {format_vector(map(min, columns))} to {format_vector(map(max, columns))}"


def format_vector(values: Iterable[float]) -> str:
    """Return numbers separated by spaces."""
    return " ".join(format_number(value) for value in values)


def format_direction(axis: Iterable[float]) -> str:
    """Return a unit vector to four digits."""
    return " ".join(f"{round(float(value), 4) + 0.0:g}" for value in axis)  # + 0.0 turns -0.0 into 0.0


def format_number(value: float) -> str:
    """Return a number to a tenth of a millimetre, smaller ones to four digits, without a negative zero."""
    if abs(value) < 0.001:
        return f"{value if abs(value) > 1e-9 else 0.0:.4g}"
    return f"{round(value, 4):.6g}"
