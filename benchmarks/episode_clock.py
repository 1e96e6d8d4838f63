"""Time of the episodes that a scripted policy plays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aidsr.tasks import Task


class EpisodeClock:
    """Tells a scripted policy when its episodes begin, and the time since then.

    A policy gets nothing but observations, and an evaluation plays the same policy several times, in changed models. A
    reset simulates nothing, so the episodes of a replay begin with the very observations of the first ones.

    Args:
        task: Task of the episodes.
    """

    def __init__(self, task: Task) -> None:
        self._dt_s, self._limit_s = task.control_dt_s, task.time_limit_s
        self._first: NDArray[np.floating] | None = None
        self._at_first = False
        self._steps = -1

    @property
    def time_s(self) -> float:
        """Time since the episodes began [s]."""
        return self._steps * self._dt_s

    def tick(self, observation: NDArray[np.floating]) -> bool:
        """Advance by a control step, and return whether the episodes begin with these observations.

        Raises:
            RuntimeError: The time exceeds the task's limit: other episodes began, which were not recognized.
        """
        if self._first is None:
            self._first = observation.copy()
        was_at_first, self._at_first = self._at_first, np.array_equal(observation, self._first)
        begins = self._at_first and not was_at_first
        self._steps = 0 if begins else self._steps + 1
        if self.time_s > self._limit_s + 1.5 * self._dt_s:
            raise RuntimeError("a replay began with other observations; use a new policy for other episodes")
        return begins
