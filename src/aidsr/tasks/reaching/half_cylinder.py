"""The surface of `surface_adapting`: half a cylinder, smooth or with waves, that looks at the robot from the side."""

from __future__ import annotations

import numpy as np

from aidsr.tasks.readings import FloatArray, Readings
from aidsr.tasks.variation import Change

__all__ = ["HALF_WIDTH_M", "WAVE_M", "gaps_m", "half_cylinder"]

HALF_WIDTH_M = 0.12
WAVE_M = 0.008
"""Height of the waves, less than the gap that still counts as lying on the surface."""
_RODS_DEG = np.arange(-80.0, 81.0, 20.0)
_ROD_M = 0.02


def half_cylinder(place_m: tuple[float, float, float], radius_m: float, *, waves: bool) -> tuple[Change, ...]:
    """Return the changes that put the surface somewhere, of some radius.

    Args:
        place_m: The cylinder's axis, level along y; it looks towards x = 0, downwards at 45 degrees [m].
        radius_m: Radius to the tops of its waves [m].
        waves: Whether it has any.
    """
    half = np.deg2rad(45.0) / 2
    turn = (np.cos(half), 0.0, -np.sin(half), 0.0) if place_m[0] > 0 else (0.0, np.sin(half), 0.0, np.cos(half))
    rods_m = radius_m - (1 if waves else 2) * _ROD_M
    angles = np.deg2rad(_RODS_DEG)
    rods = np.column_stack([-rods_m * np.cos(angles), np.zeros_like(angles), rods_m * np.sin(angles)])
    return (
        Change("body_pos", "surface", place_m),
        Change("body_quat", "surface", turn),
        Change("geom_size", "surface_round", (radius_m - WAVE_M * waves, HALF_WIDTH_M, 0.0)),
        # a millimetre narrower, because two faces in one plane flicker in pictures
        Change("geom_size", "surface_block", (radius_m / 2, HALF_WIDTH_M - 0.001, radius_m)),
        Change("geom_pos", "surface_block", (radius_m / 2, 0.0, 0.0)),
        *(Change("geom_pos", f"ripple_{number}", tuple(rod)) for number, rod in enumerate(rods, start=1)),
    )


def gaps_m(readings: Readings) -> FloatArray:
    """Return how far each ball of the robot's outline is from the surface, (n, p) [m]; 1 m where it is beside it."""
    outline, back = readings.body, readings["surface_back"]
    from_axis = outline.center_m - readings["surface_position"][:, None]
    across = np.stack([-back[:, 2], np.zeros(readings.n), back[:, 0]], axis=-1)
    behind = np.einsum("npk,nk->np", from_axis, back)
    distance = np.hypot(behind, np.einsum("npk,nk->np", from_axis, across))
    gaps = np.maximum(distance - readings.parameters["radius_m"] - outline.radius_m, 0.0)
    return np.where((behind > 0.0) | (np.abs(from_axis[:, :, 1]) > HALF_WIDTH_M), 1.0, gaps)
