"""Regular patterns of points: evenly spaced in a row or on a circle."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aidsr.core.formatting import format_vector

Array = NDArray[np.float64]

_TOLERANCE_M = 5e-5
"""Largest distance of a point from its pattern [m]: half of the last digit of positions in prompts, so that a smaller
distance is not visible there."""
_MAX_POSITIONS = 60
"""Maximum number of positions without a pattern that are listed; of more positions only the bounds are given. Our
choice: a design does not need the position of every stone in gravel."""
_MIN_IN_ROW = 3
_MIN_ON_CIRCLE = 6
"""Minimum number of points on a circle. Our choice: four or five positions are easier to read as a list, and any three
points are on some circle."""


@dataclass(frozen=True)
class Circle:
    """Points evenly spaced on a circle or an arc."""

    count: int
    centre_m: Array
    axis: Array
    """Unit vector; the points follow one another around it by the right-hand rule."""
    radius_m: float
    step_rad: float
    """Angle from one point to the next."""

    @property
    def closed(self) -> bool:
        """Whether the points fill the whole circle."""
        return bool(np.isclose(self.count * self.step_rad, 2 * np.pi, rtol=1e-3))


def row_length(points: Array) -> int:
    """Return how many points at the beginning are evenly spaced in a straight row; 0 if they are too few.

    Args:
        points: Positions in order, (n, 3) [m].
    """
    return _longest(lambda count: _is_row(points[:count]), _MIN_IN_ROW, len(points))


def fit_circle(points: Array) -> Circle | None:
    """Return the circle on which most points at the beginning are evenly spaced; None if they are too few.

    Args:
        points: Positions in order, (n, 3) [m].
    """
    count = _longest(lambda count: _fit_circle(points[:count]) is not None, _MIN_ON_CIRCLE, len(points))
    return _fit_circle(points[:count]) if count else None


def count_before_pattern(points: Array) -> int:
    """Return how many points come before the next row or circle, at least 1."""
    for start in range(1, len(points)):
        if row_length(points[start : start + _MIN_IN_ROW]) or fit_circle(points[start : start + _MIN_ON_CIRCLE]):
            return start
    return len(points)


def rotations(vector: Array, axis: Array, step_rad: float, count: int) -> Array:
    """Return a vector rotated about a unit axis by 0, 1, 2... steps, (count, 3), by Rodrigues' formula."""
    angles = (step_rad * np.arange(count))[:, None]
    along = axis * (axis @ vector)
    return np.asarray(along + np.cos(angles) * (vector - along) + np.sin(angles) * np.cross(axis, vector))


def _longest(holds: Callable[[int], bool], fewest: int, most: int) -> int:
    """Return the largest number of points at the beginning for which a pattern holds; 0 if it is below `fewest`.

    A pattern that holds for n points must also hold for fewer.
    """
    if most < fewest or not holds(fewest):
        return 0
    return fewest - 1 + bisect_left(range(fewest, most + 1), True, key=lambda count: not holds(count))


def _is_row(points: Array) -> bool:
    even = np.linspace(points[0], points[-1], len(points))
    return bool(np.linalg.norm(points[1] - points[0]) > _TOLERANCE_M and np.abs(points - even).max() < _TOLERANCE_M)


def _fit_circle(points: Array) -> Circle | None:
    if np.ptp(np.linalg.norm(np.diff(points, axis=0), axis=1)) > 2 * _TOLERANCE_M:
        return None
    middle = points.mean(axis=0)
    *_, (first, second, axis) = np.linalg.svd(points - middle, full_matrices=False)
    flat = (points - middle) @ np.column_stack([first, second])
    # least squares on |p|^2 = 2 c p + (r^2 - c^2), which is linear in the centre
    fit = np.linalg.lstsq(np.column_stack([2 * flat, np.ones(len(flat))]), (flat**2).sum(axis=1), rcond=None)[0]
    centre = middle + fit[0] * first + fit[1] * second
    spokes = points - centre
    radius = float(np.linalg.norm(spokes, axis=1).mean())
    if radius < _TOLERANCE_M or radius > 10 * float(np.ptp(points, axis=0).max()):
        return None  # all points at one position, or an arc so flat that it is a line
    if np.cross(spokes[0], spokes[1]) @ axis < 0:
        axis = -axis
    step = float(np.arctan2(np.cross(spokes[0], spokes[1]) @ axis, spokes[0] @ spokes[1]))
    even = rotations(spokes[0], axis, step, len(points))
    if step * len(points) > 2 * np.pi * 1.001 or np.abs(spokes - even).max() > _TOLERANCE_M:
        return None
    return Circle(len(points), centre, axis, radius, step)


def format_positions(positions: Sequence[Iterable[float]]) -> str:
    """Return positions without a pattern as text: as a list, or as bounds if there are too many."""
    if len(positions) <= _MAX_POSITIONS:
        return "at " + ", ".join(format_vector(position) for position in positions)
    columns = list(zip(*positions, strict=True))
    return f"in no order within {format_vector(map(min, columns))} to {format_vector(map(max, columns))}"
