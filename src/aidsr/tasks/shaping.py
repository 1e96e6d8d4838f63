"""Smooth measures of nearness, share and excess. All functions work on arrays of any shape."""

from __future__ import annotations

import numpy as np

from aidsr.tasks.readings import FloatArray


def closeness(distance: FloatArray, *, within: float = 0.0, margin: float) -> FloatArray:
    """Return 1 up to `within`, then a smooth decrease that never reaches 0, so that coming nearer always pays.

    Args:
        distance: Distances of any shape, in the unit of `within` and `margin`.
        within: Distance up to which the result is 1.
        margin: Distance beyond `within` at which the result is 0.1.

    Source: the idea of dm_control's `rewards.tolerance` (Tassa et al. 2018, section 3), with its "long_tail" shape
    1 / (1 + 9 x^2), which is 0.1 at x = 1.
    """
    beyond = np.maximum(distance - within, 0.0) / margin
    return np.asarray(1.0 / (1.0 + 9.0 * beyond**2))


def approach(distance_m: FloatArray, *, within: float = 0.0) -> FloatArray:
    """Return closeness that guides from far away to a small target: the mean of a wide scale and a narrow scale.

    Args:
        distance_m: Distances of any shape [m].
        within: Distance up to which the result is 1 [m].

    Source: our choice, measured with PPO on button_pushing: with the wide scale alone policies stay beside the button,
    because the last centimetres gain almost nothing.
    """
    return 0.5 * closeness(distance_m, within=within, margin=0.2) + 0.5 * closeness(
        distance_m, within=within, margin=0.04
    )


def share(value: FloatArray, goal: FloatArray | float) -> FloatArray:
    """Return `value` as a share of `goal`, clipped to 0 to 1."""
    return np.clip(value / goal, 0.0, 1.0)


def excess(value: FloatArray, limit: float, *, full: float | None = None) -> FloatArray:
    """Return 0 up to `limit`, rising linearly to 1 at `full`.

    Args:
        value: Values of any shape, in the unit of `limit`.
        limit: Largest value for which the result is 0.
        full: Value from which the result is 1; twice the limit if not given (our choice).
    """
    return np.clip((value - limit) / ((2.0 * limit if full is None else full) - limit), 0.0, 1.0)
