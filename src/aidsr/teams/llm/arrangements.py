"""How many alike things lie: in a row, on a circle, or each for itself."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "Circle", "before_a_pattern", "circle", "row_length", "turned"]

Array = NDArray[np.float64]

_CLOSE_M = 5e-5
"""Half of the last digit that is told of a position: what lies nearer to a pattern reads as if it lay on it."""
_FEWEST_IN_A_ROW = 3
_FEWEST_ON_A_CIRCLE = 6
"""Our choice: four or five places are easier to read as places; any three lie on some circle."""


@dataclass(frozen=True)
class Circle:
    """Where things lie that follow each other on a circle, evenly."""

    count: int
    centre_m: Array
    axis: Array
    """Unit vector about which they follow each other, by the rule of the right hand."""
    radius_m: float
    step_rad: float
    """Angle from one to the next."""

    @property
    def closed(self) -> bool:
        """Whether they go all the way round."""
        return bool(np.isclose(self.count * self.step_rad, 2 * np.pi, rtol=1e-3))


def row_length(points: Array) -> int:
    """Return how many of the first points lie evenly in a straight row; 0 when they are too few for one.

    Args:
        points: Places in their order, (n, 3) [m].
    """
    return _longest(lambda count: _in_a_row(points[:count]), _FEWEST_IN_A_ROW, len(points))


def circle(points: Array) -> Circle | None:
    """Return the circle on which as many as possible of the first points lie evenly; None when they are too few.

    Args:
        points: Places in their order, (n, 3) [m].
    """
    count = _longest(lambda count: _on_a_circle(points[:count]) is not None, _FEWEST_ON_A_CIRCLE, len(points))
    return _on_a_circle(points[:count]) if count else None


def before_a_pattern(points: Array) -> int:
    """Return how many points stand before the next row or circle; the first point stands before any."""
    for start in range(1, len(points)):
        if row_length(points[start : start + _FEWEST_IN_A_ROW]) or circle(points[start : start + _FEWEST_ON_A_CIRCLE]):
            return start
    return len(points)


def turned(vector: Array, axis: Array, step_rad: float, count: int) -> Array:
    """Return a vector turned about a unit axis by 0, 1, 2... steps, (count, 3), by Rodrigues' formula."""
    angles = (step_rad * np.arange(count))[:, None]
    along = axis * (axis @ vector)
    return np.asarray(along + np.cos(angles) * (vector - along) + np.sin(angles) * np.cross(axis, vector))


def _longest(holds: Callable[[int], bool], fewest: int, most: int) -> int:
    """Return how many of the first points a pattern holds for; what holds for some holds for fewer."""
    if most < fewest or not holds(fewest):
        return 0
    return fewest - 1 + bisect_left(range(fewest, most + 1), True, key=lambda count: not holds(count))


def _in_a_row(points: Array) -> bool:
    even = np.linspace(points[0], points[-1], len(points))
    return bool(np.linalg.norm(points[1] - points[0]) > _CLOSE_M and np.abs(points - even).max() < _CLOSE_M)


def _on_a_circle(points: Array) -> Circle | None:
    if np.ptp(np.linalg.norm(np.diff(points, axis=0), axis=1)) > 2 * _CLOSE_M:
        return None
    middle = points.mean(axis=0)
    *_, (first, second, axis) = np.linalg.svd(points - middle, full_matrices=False)
    flat = (points - middle) @ np.column_stack([first, second])
    # least squares on |p|^2 = 2 c p + (r^2 - c^2), which is linear in the centre
    fit = np.linalg.lstsq(np.column_stack([2 * flat, np.ones(len(flat))]), (flat**2).sum(axis=1), rcond=None)[0]
    centre = middle + fit[0] * first + fit[1] * second
    spokes = points - centre
    radius = float(np.linalg.norm(spokes, axis=1).mean())
    if radius < _CLOSE_M or radius > 10 * float(np.ptp(points, axis=0).max()):
        return None  # all in one place, or so flat an arc that it is a line
    if np.cross(spokes[0], spokes[1]) @ axis < 0:
        axis = -axis
    step = float(np.arctan2(np.cross(spokes[0], spokes[1]) @ axis, spokes[0] @ spokes[1]))
    even = turned(spokes[0], axis, step, len(points))
    if step * len(points) > 2 * np.pi * 1.001 or np.abs(spokes - even).max() > _CLOSE_M:
        return None
    return Circle(len(points), centre, axis, radius, step)
