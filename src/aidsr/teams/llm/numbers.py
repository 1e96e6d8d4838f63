"""Numbers of an environment as they stand in prompts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

__all__ = ["at", "direction", "number", "vector"]

_MOST_PLACES = 60
"""Of more places in no order only the bounds are told. Our choice: nobody calculates with each stone of gravel."""


def at(places: Sequence[Iterable[float]]) -> str:
    """Return where several things are that lie in no pattern."""
    if len(places) <= _MOST_PLACES:
        return "at " + ", ".join(vector(place) for place in places)
    columns = list(zip(*places, strict=True))
    return f"in no order within {vector(map(min, columns))} to {vector(map(max, columns))}"


def vector(values: Iterable[float]) -> str:
    """Return numbers with spaces between them."""
    return " ".join(number(value) for value in values)


def direction(axis: Iterable[float]) -> str:
    """Return a unit vector to four digits."""
    return " ".join(f"{round(float(value), 4) + 0.0:g}" for value in axis)  # + 0.0 turns -0.0 into 0.0


def number(value: float) -> str:
    """Return a number to a tenth of a millimetre, smaller ones to four digits, without a negative zero."""
    if abs(value) < 0.001:
        return f"{value if abs(value) > 1e-9 else 0.0:.4g}"
    return f"{round(value, 4):.6g}"
