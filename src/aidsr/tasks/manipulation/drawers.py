"""The three drawers of `drawer_opening`, and which of them is wanted."""

from __future__ import annotations

import numpy as np

from aidsr.tasks.readings import FloatArray, Readings
from aidsr.tasks.task import Memory

__all__ = ["ALL_STAGES", "DRAWERS", "STAGES", "openings_m", "wanted"]

DRAWERS = ("drawer_1", "drawer_2", "drawer_3")
STAGES = 4
"""Of each drawer: approach, hold, pull, push back."""
ALL_STAGES = STAGES * len(DRAWERS)


def openings_m(readings: Readings) -> FloatArray:
    """Return how far the drawers are open, (n, 3) [m]."""
    return np.column_stack([readings[f"{drawer}_opening"] for drawer in DRAWERS])


def wanted(readings: Readings, memory: Memory) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return, of the drawer in turn, functional part to handle (n, 3), opening (n,) and force on the handle (n,).

    After the last stage it is the one that is farthest open, because all have to be shut.
    """
    row, opened_m = np.arange(readings.n), openings_m(readings)
    turn = np.minimum(memory["stage"] // STAGES, len(DRAWERS) - 1).astype(np.intp)
    in_turn = readings.parameters["order"][row, turn].astype(np.intp)
    drawer = np.where(memory["stage"] >= ALL_STAGES, opened_m.argmax(axis=1), in_turn)
    handles_m = np.stack([readings[f"{name}_position"] for name in DRAWERS], axis=1)
    forces_n = np.column_stack([readings.force_n(f"{name}_force") for name in DRAWERS])
    return handles_m[row, drawer] - readings["tip_position"], opened_m[row, drawer], forces_n[row, drawer]
