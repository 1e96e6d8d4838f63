"""Forces that a task allows only seldom: how long the robot touches, and how long it presses too hard."""

from __future__ import annotations

import numpy as np

from aidsr.tasks.readings import TOUCH_N, BoolArray, FloatArray
from aidsr.tasks.task import TaskState

SELDOM = 0.05
"""Share of the time in contact in which a force may be larger than its limit. Our choice: a knock when contact is made
and a few later."""


def untouched(n: int) -> TaskState:
    """Return the memory of n episodes before any contact."""
    return {"touching_s": np.zeros(n), "too_hard_s": np.zeros(n)}


def after_touch(state: TaskState, force_n: FloatArray, limit_n: float, dt_s: float) -> TaskState:
    """Return that memory after one more control step.

    Args:
        state: Before the step.
        force_n: Largest force of the step, (n,) [N].
        limit_n: Largest force that is allowed [N].
        dt_s: Duration of the step [s].
    """
    return {
        "touching_s": state["touching_s"] + dt_s * (force_n > TOUCH_N),
        "too_hard_s": state["too_hard_s"] + dt_s * (force_n > limit_n),
    }


def is_gentle(state: TaskState) -> BoolArray:
    """Return where the limit was passed in at most `SELDOM` of the time in contact, (n,)."""
    return np.asarray(state["too_hard_s"] <= SELDOM * state["touching_s"] + 1e-9)
