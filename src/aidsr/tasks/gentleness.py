"""Force limits that may be exceeded only rarely: time in contact, and time above the limit."""

from __future__ import annotations

import numpy as np

from aidsr.tasks.readings import TOUCH_N, BoolArray, FloatArray
from aidsr.tasks.task import TaskState

SELDOM = 0.05
"""Share of the time in contact in which a force may exceed its limit. Our choice: one impact when contact is made and a
few later."""


def untouched(n: int) -> TaskState:
    """Return the contact times of n episodes before any contact."""
    return {"touching_s": np.zeros(n), "too_hard_s": np.zeros(n)}


def after_touch(state: TaskState, force_n: FloatArray, limit_n: float, dt_s: float) -> TaskState:
    """Return the contact times after one more control step.

    Args:
        state: Contact times before the step.
        force_n: Largest force during the step, (n,) [N].
        limit_n: Largest allowed force [N].
        dt_s: Duration of the step [s].
    """
    return {
        "touching_s": state["touching_s"] + dt_s * (force_n > TOUCH_N),
        "too_hard_s": state["too_hard_s"] + dt_s * (force_n > limit_n),
    }


def is_gentle(state: TaskState) -> BoolArray:
    """Return whether the limit was exceeded in at most `SELDOM` of the time in contact, (n,)."""
    return np.asarray(state["too_hard_s"] <= SELDOM * state["touching_s"] + 1e-9)
