"""What a motion is worth for a goal of one's own: progress that lasts, and nothing broken on the way."""

from __future__ import annotations

from collections import deque

import numpy as np

from aidsr.learn.episodes.batch import StepResult
from aidsr.learn.episodes.rollout import EpisodeOutcomes
from aidsr.tasks.goals import GoalTask
from aidsr.tasks.goals.limits import TOLERATED_S
from aidsr.tasks.readings import FloatArray

_BROKEN = 0.5
"""Share that is left of progress while something counts against the robot, and for good where it did for too long. Our
choice: as a failed episode is worth half."""


_SPENT = 0.1
"""Share that a motion loses that passed a limit for twice as long as is tolerated, and in step before. Our choice: less
than a stage, so that progress comes first; of motions that come equally far the one that leaves room goes on."""


class Holding:
    """Follows what lasts in n episodes; a callback for every control step.

    A motion that only passes its goal is worth less than one that stays nearby: the search needs to be told so, since
    success says nothing until all of the hold is there.

    Args:
        task: Of the goal.
        n: How many episodes.
    """

    def __init__(self, task: GoalTask, n: int) -> None:
        self._task = task
        self._window = deque[FloatArray](maxlen=max(1, round(task.hold_s / task.control_dt_s)))
        self._kept, self._best, self._against_s = np.zeros((3, n))

    def __call__(self, result: StepResult) -> None:
        """Take in one control step; rows of episodes that have ended are zero."""
        against = result.violation > 0.0
        self._against_s += self._task.control_dt_s * against
        broken = against | ((self._against_s > TOLERATED_S) & bool(self._task.goal.limits))
        clean = np.where(broken, _BROKEN, 1.0) * result.progress
        self._window.append(clean)
        self._best = np.maximum(self._best, clean)
        if len(self._window) == self._window.maxlen:
            self._kept = np.maximum(self._kept, np.min(self._window, axis=0))

    def fitness(self, outcomes: EpisodeOutcomes) -> FloatArray:
        """Return the fitness of motions, (n,): progress kept for the hold of the goal, and the best; plus success."""
        progress = (self._kept + self._best) / 2 * np.where(outcomes.failure, _BROKEN, 1.0)
        if self._task.goal.limits:
            progress *= 1.0 - _SPENT * np.clip(self._against_s / (2.0 * TOLERATED_S), 0.0, 1.0)
        return np.where(outcomes.diverged, -1.0, progress + outcomes.success)
