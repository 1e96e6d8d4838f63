"""When a motion of the search is stopped: its variation is solved, or it makes no progress any more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.openloop.motion import Motions

_MIN_GAIN = 0.005
"""Change of progress that counts as any. Our choice: a body that needs the whole time of its task gains several times
as much in the time that is waited for."""
_SETTLING_S = 1.0
"""Time that a body has after its motion, and the hold of its task, to come to rest. Our choice."""


class EarlyStop:
    """Stops episodes early; a callback for every control step.

    A variation that a motion has solved needs no other motion: those still running in it stop. A motion stops when its
    ramp is over and progress has not changed for the hold of the task and a second, and one period longer if it swings.

    Args:
        episodes: Just reset; one motion is played in each.
        motions: Those motions.
        variations: Index of the variation that each is searched for, (n,).
    """

    def __init__(self, episodes: Episodes, motions: Motions, variations: NDArray[np.intp]) -> None:
        self._episodes, self._variations = episodes, variations
        swings, ramps = motions.amplitude.any(axis=1), motions.change.any(axis=1)
        self._patience_s = (
            episodes.task.hold_s + _SETTLING_S + np.where(swings, 1.0 / motions.frequency_hz.min(axis=1), 0.0)
        )
        self._changed_s = np.where(ramps, motions.begin_s + motions.ramp_s, 0.0)
        self._progress = np.zeros(episodes.n)

    def __call__(self, result: StepResult) -> None:
        """Stop the episodes that have solved their variation or stalled."""
        changed = np.abs(result.progress - self._progress) > _MIN_GAIN
        self._progress = np.where(changed, result.progress, self._progress)
        self._changed_s = np.where(changed, np.maximum(result.time_s, self._changed_s), self._changed_s)
        stalled = result.time_s - self._changed_s > self._patience_s
        solved = np.isin(self._variations, self._variations[result.success])
        self._episodes.running = self._episodes.running & ~(stalled | solved)
