"""Fitness of motions: progress and success; for a user-defined goal, progress that lasts without breaking rules."""

from __future__ import annotations

from collections import deque

import numpy as np

from aidsr.learn.episodes.batch import StepResult
from aidsr.learn.episodes.rollout import EpisodeOutcomes
from aidsr.tasks.goals import GoalTask
from aidsr.tasks.goals.limits import TOLERATED_S
from aidsr.tasks.readings import FloatArray

_BROKEN = 0.5
"""Factor on the progress of a failed episode; with a goal, also while something counts against the robot, and
permanently once that lasted for too long. Our choice."""
_SPENT = 0.1
"""Share of its fitness that a motion loses when it violates limits for twice the tolerated time or longer, and
proportionally less below that. Our choice: less than one stage, so that progress comes first; of motions with equal
progress, the search continues with the one that leaves more margin."""


def fitness_of(outcomes: EpisodeOutcomes) -> FloatArray:
    """Return the fitness of motions, (n,): mean of last and best progress, halved by failure; plus 1 for success.

    A motion that diverges has a fitness of -1.
    """
    return _fitness(outcomes, outcomes.progress, outcomes.best_progress)


def _fitness(
    outcomes: EpisodeOutcomes, progress: FloatArray, best_progress: FloatArray, margin: FloatArray | float = 1.0
) -> FloatArray:
    progress = (progress + best_progress) / 2 * np.where(outcomes.failure, _BROKEN, 1.0) * margin
    return np.where(outcomes.diverged, -1.0, progress + outcomes.success)


class SustainedProgress:
    """Callback for every control step that measures how long the progress of n episodes lasts.

    A motion that only passes its goal is worth less than one that stays near it. Success does not show this to the
    search, because it stays False until the goal has held for the whole hold time.

    Args:
        task: Task with a goal.
        n: Number of episodes.
    """

    def __init__(self, task: GoalTask, n: int) -> None:
        self._task = task
        self._window = deque[FloatArray](maxlen=max(1, round(task.hold_s / task.control_dt_s)))
        self._kept, self._best, self._against_s = np.zeros((3, n))

    def __call__(self, result: StepResult) -> None:
        """Add one control step; rows of episodes that have ended are zero."""
        against = result.violation > 0.0
        self._against_s += self._task.control_dt_s * against
        broken = against | ((self._against_s > TOLERATED_S) & bool(self._task.goal.limits))
        clean = np.where(broken, _BROKEN, 1.0) * result.progress
        self._window.append(clean)
        self._best = np.maximum(self._best, clean)
        if len(self._window) == self._window.maxlen:
            self._kept = np.maximum(self._kept, np.min(self._window, axis=0))

    def fitness(self, outcomes: EpisodeOutcomes) -> FloatArray:
        """Return the fitness of the motions, (n,): as `fitness_of`, with kept instead of last progress.

        Kept progress is the largest that lasted for the goal's hold time.
        """
        spent = _SPENT * np.clip(self._against_s / (2.0 * TOLERATED_S), 0.0, 1.0) if self._task.goal.limits else 0.0
        return _fitness(outcomes, self._kept, self._best, 1.0 - spent)
