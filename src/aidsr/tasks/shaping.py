"""Soft thresholds: how near is near, how much is too much. All functions work on arrays of any shape."""

from __future__ import annotations

import numpy as np

from aidsr.tasks.readings import FloatArray


def closeness(distance: FloatArray, *, within: float = 0.0, margin: float) -> FloatArray:
    """Return 1 up to `within`, then a smooth fall that never reaches 0, so that every step nearer is worth something.

    Args:
        distance: Distances of any shape, in the unit of `within` and `margin`.
        within: Distance that counts as arrived.
        margin: Distance beyond `within` at which 0.1 is left.

    Source: the idea of dm_control's `rewards.tolerance` (Tassa et al. 2018, section 3), with its "long_tail" shape
    1 / (1 + 9 x^2), which is 0.1 at x = 1.
    """
    beyond = np.maximum(distance - within, 0.0) / margin
    return np.asarray(1.0 / (1.0 + 9.0 * beyond**2))


def approach(distance_m: FloatArray, *, within: float = 0.0) -> FloatArray:
    """Return closeness that leads from afar to a small target: half of it on a wide scale, half on a narrow one.

    Args:
        distance_m: Distances of any shape [m].
        within: Distance that counts as arrived [m].

    Source: our choice, measured with PPO on button_pushing: with the wide scale alone policies stay beside the button,
    because the last centimetres are worth next to nothing.
    """
    return 0.5 * closeness(distance_m, within=within, margin=0.2) + 0.5 * closeness(
        distance_m, within=within, margin=0.04
    )


def share(value: FloatArray, goal: FloatArray | float) -> FloatArray:
    """Return the part of `goal` that `value` has reached, 0 to 1."""
    return np.clip(value / goal, 0.0, 1.0)


def excess(value: FloatArray, limit: float, *, full: float | None = None) -> FloatArray:
    """Return 0 up to `limit`, rising linearly to 1 at `full`.

    Args:
        value: Values of any shape, in the unit of `limit`.
        limit: Largest value that costs nothing.
        full: Value that costs all; twice the limit where it is not given (our choice).
    """
    return np.clip((value - limit) / ((2.0 * limit if full is None else full) - limit), 0.0, 1.0)
