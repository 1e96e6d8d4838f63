"""Early stopping of motions in the search: when the variation is solved, or when progress has stalled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.openloop.motion import Motions

_MIN_GAIN = 0.005
"""Smallest change of progress that counts as a change. Our choice: a robot that needs the whole time limit of its task
gains several times as much within the waiting time."""
_SETTLING_S = 1.0
"""Time for a robot to come to rest after its motion, in addition to the task's hold time [s]. Our choice."""


class EarlyStop:
    """Callback for every control step that stops episodes early.

    Once a motion has solved a variation, the other episodes of that variation stop. A motion also stops when its ramp
    is over and progress has not changed for the task's hold time plus one second, plus one period if it swings.

    Args:
        episodes: Episodes that have just been reset; each plays one motion.
        motions: Motions that the episodes play.
        variations: Index of the variation that each motion is searched for, (n,).
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
        """Stop the episodes that have stalled or whose variation is solved."""
        changed = np.abs(result.progress - self._progress) > _MIN_GAIN
        self._progress = np.where(changed, result.progress, self._progress)
        self._changed_s = np.where(changed, np.maximum(result.time_s, self._changed_s), self._changed_s)
        stalled = result.time_s - self._changed_s > self._patience_s
        solved = np.isin(self._variations, self._variations[result.success])
        self._episodes.running = self._episodes.running & ~(stalled | solved)
