"""The three drawers of `drawer_opening`, and which of them is wanted."""

from __future__ import annotations

import numpy as np

from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import approach, share
from aidsr.tasks.task import Memory

__all__ = [
    "ALL_STAGES",
    "DRAWERS",
    "OPEN_M",
    "SHUT_M",
    "STAGES",
    "nearness",
    "openings_m",
    "staged",
    "to_be_shut",
    "wanted",
]

DRAWERS = ("drawer_1", "drawer_2", "drawer_3")
STAGES = 4
"""Of each drawer: approach, hold, pull, push back."""
ALL_STAGES = STAGES * len(DRAWERS)
OPEN_M = 0.06
SHUT_M = 0.01
FULLY_OPEN_M = 0.10
"""Where the environment's joints end."""
NEAR_SHARE = 0.3
"""Of pulling and pushing. Our choice."""
BEHIND_M = np.array([0.012, 0.0, 0.0])
"""From the middle of a handle's bar to where it is pulled from, into the cabinet [m]. Our choice: policies that pulled
had their functional part 7 to 10 mm behind the bar's middle."""


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


def to_be_shut(memory: Memory) -> BoolArray:
    """Return whether the wanted drawer has to be shut, or kept shut, and not opened, (n,)."""
    return np.asarray((memory["stage"] % STAGES == STAGES - 1) | (memory["stage"] >= ALL_STAGES))


def nearness(memory: Memory, to_handle: FloatArray) -> FloatArray:
    """Return how near the functional part is to where it is wanted, 0 to 1, (n,): at the handle; to pull, behind it.

    Args:
        memory: Holds the stage.
        to_handle: From the functional part to the wanted handle, (n, 3) [m].
    """
    to_be_pulled = (memory["stage"] % STAGES == STAGES - 2) & (memory["stage"] < ALL_STAGES)
    return approach(np.linalg.norm(to_handle + to_be_pulled[:, None] * BEHIND_M, axis=1))


def staged(memory: Memory, near: FloatArray, opening_m: FloatArray, widest_m: FloatArray) -> FloatArray:
    """Return the share of all stages that is done, the present one in part, 0 to 1, (n,).

    Args:
        memory: Holds the stage.
        near: See `nearness`, (n,).
        opening_m: Opening of the wanted drawer, (n,).
        widest_m: Opening of the drawer that is farthest open, (n,).
    """
    stage, last = memory["stage"], ALL_STAGES - 1
    shares = (near, near, _begun(near, share(opening_m, OPEN_M)), _begun(near, _shut(opening_m)))
    present = np.choose((stage % STAGES).astype(np.intp), shares)
    return np.asarray(np.where(stage > last, last + _shut(widest_m), stage + present) / ALL_STAGES)


def _begun(near: FloatArray, way: FloatArray) -> FloatArray:
    """Return how far a drawer is moved; being near its handle is worth `NEAR_SHARE`, until as much is done."""
    return np.asarray(NEAR_SHARE * np.maximum(near, way) + (1.0 - NEAR_SHARE) * way)


def _shut(opening_m: FloatArray) -> FloatArray:
    """Return how far drawers are shut, counted from where they end: what was pulled too far earns from the first mm."""
    return 1.0 - share(opening_m - SHUT_M, FULLY_OPEN_M - SHUT_M)
