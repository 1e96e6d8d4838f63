"""A wall divided into cells that are brushed row by row from the top, to and fro."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import share
from aidsr.tasks.task import Memory

__all__ = ["STEADY", "WALL_M", "brushed", "cell_of", "done", "in_band", "in_order", "steady", "to_wanted_m"]

WALL_M = 0.30
"""Width and height of the wall."""
BAND_N = (0.3, 1.0)
STEADY = 0.6
"""Share of the time in contact in which the force has to be in the band."""
STROKE_S = 0.1
"""A cell is brushed when the force has been in the band on it for this long."""


def in_band(force_n: FloatArray) -> BoolArray:
    """Return whether forces are strong enough to brush and too weak to scratch."""
    return (force_n >= BAND_N[0]) & (force_n <= BAND_N[1])


def brushed(memory: Memory) -> BoolArray:
    """Return which cells are brushed, (n, cells)."""
    return memory["cells_s"] >= STROKE_S


def in_order(memory: Memory) -> FloatArray:
    """Return how many cells are brushed before the first one that is not, (n,)."""
    return np.asarray(np.cumprod(brushed(memory), axis=1).sum(axis=1), dtype=np.float64)


def done(memory: Memory, coverage: float) -> FloatArray:
    """Return the share of the cells asked for that are brushed in order, 1 where enough are in any order, (n,).

    Cells out of order count when their turn comes: otherwise policies brush what lies next to where they begin and are
    left in a corner.
    """
    enough = brushed(memory).mean(axis=1) >= coverage
    return np.where(enough, 1.0, share(in_order(memory), coverage * brushed(memory).shape[1]))


def steady(memory: Memory) -> FloatArray:
    """Return the share of the contact time in which the force was in the band, 0 before any contact, (n,)."""
    return memory["band_s"] / np.maximum(memory["contact_s"], 1e-9)


def cell_of(readings: Readings, point_m: FloatArray, a_side: int) -> NDArray[np.intp]:
    """Return the number, in the order of brushing, of the cell that a world point lies on or beside, (n,)."""
    from_middle = point_m - readings["wall_position"]
    right_m = np.einsum("nk,nk->n", from_middle, readings["wall_right"])
    down_m = -np.einsum("nk,nk->n", from_middle, readings["wall_up"])
    column, row = (_index(way_m, a_side) for way_m in (right_m, down_m))
    return row * a_side + np.where(row % 2 == 0, column, a_side - 1 - column)


def _cell_center_m(readings: Readings, number: NDArray[np.intp], a_side: int) -> FloatArray:
    """Return the world positions of the middles of cells, (n, 3) [m]."""
    row, place = number // a_side, number % a_side
    column = np.where(row % 2 == 0, place, a_side - 1 - place)
    right_m, down_m = ((index + 0.5) * WALL_M / a_side - WALL_M / 2 for index in (column, row))
    across = right_m[:, None] * readings["wall_right"] - down_m[:, None] * readings["wall_up"]
    return np.asarray(readings["wall_position"] + across)


def to_wanted_m(readings: Readings, memory: Memory, a_side: int) -> FloatArray:
    """Return the way from the functional part to the first cell that is not brushed, (n, 3) [m]."""
    return _cell_center_m(readings, np.argmin(brushed(memory), axis=1), a_side) - readings["tip_position"]


def _index(way_m: FloatArray, a_side: int) -> NDArray[np.intp]:
    """Return the column or row at a distance from the middle."""
    return np.clip(np.floor((way_m / WALL_M + 0.5) * a_side), 0, a_side - 1).astype(np.intp)
