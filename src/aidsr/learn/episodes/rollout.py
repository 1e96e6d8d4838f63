"""Rollouts of whole episodes from reset to end, without learning."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import EpisodeResult
from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.tasks.readings import BoolArray, FloatArray


class Policy(Protocol):
    """Anything that returns actions for observations."""

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return actions for observations, (n, n_observations) -> (n, n_actions), -1 to 1."""
        ...


@dataclass(frozen=True)
class Constant:
    """Policy with a constant action, (k,); with the action at rest, the robot is idle."""

    action: FloatArray

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return the action for each observation, (n, k)."""
        return np.tile(self.action, (len(observation), 1))


@dataclass(frozen=True)
class EpisodeOutcomes:
    """Outcomes of n episodes, each array (n,)."""

    success: BoolArray
    failure: BoolArray
    diverged: BoolArray
    progress: FloatArray
    """Progress at the end, 0 to 1."""
    best_progress: FloatArray
    """Largest progress at any time, 0 to 1."""
    reward: FloatArray
    """Sum of the rewards."""
    time_s: FloatArray
    """Duration of the episode [s]."""
    held_s: FloatArray
    """Longest time for which the goal held without a break [s]."""
    reached: NDArray[np.object_]
    """Stage of the task that the episode reached, in words."""
    exceeded_limits: NDArray[np.object_]
    """Limits that the episode violated, a tuple of `ExceededLimit` each."""
    penalized_s: FloatArray
    """Time in which the task's penalty applied [s]."""

    def result(self, row: int, variation: int) -> EpisodeResult:
        """Return the outcome of one episode.

        Args:
            row: Row of the episode.
            variation: Index of its variation, stored in the result.
        """
        ends = (("diverged", self.diverged), ("succeeded", self.success), ("failed", self.failure))
        return EpisodeResult(
            variation=variation,
            ended=next((name for name, where in ends if where[row]), "out_of_time"),
            progress=float(self.progress[row]),
            best_progress=float(self.best_progress[row]),
            reward=float(self.reward[row]),
            time_s=float(np.round(self.time_s[row], 6)),
            reached=self.reached[row],
            held_s=float(np.round(self.held_s[row], 6)),
            exceeded_limits=self.exceeded_limits[row],
            penalized_s=float(np.round(self.penalized_s[row], 6)),
        )


def rollout(
    episodes: Episodes, policy: Policy, callback: Callable[[StepResult], None] = lambda _result: None
) -> EpisodeOutcomes:
    """Step all running episodes to their ends.

    Args:
        episodes: Episodes that have just been reset.
        policy: Policy that chooses the actions.
        callback: Called after every control step.
    """
    n = episodes.n
    success, failure, diverged = np.zeros((3, n), dtype=np.bool_)
    progress, best_progress, reward, time_s, held_s, penalized_s = np.zeros((6, n))
    while episodes.running.any():
        before = episodes.running
        result = episodes.step(policy.act(episodes.observation))
        success |= result.success
        failure |= result.failure
        diverged |= result.diverged
        reward += result.reward
        progress, time_s = np.where(before, result.progress, progress), np.where(before, result.time_s, time_s)
        best_progress = np.maximum(best_progress, result.progress)
        held_s = np.maximum(held_s, episodes.held_s)
        penalized_s += episodes.task.control_dt_s * (result.violation > 0.0)
        callback(result)
    reached, exceeded = np.empty((2, n), dtype=np.object_)
    for row in range(n):
        reached[row] = episodes.task.stage_reached(
            float(best_progress[row]), success=bool(success[row]), met=bool(held_s[row] > 0.0)
        )
        exceeded[row] = episodes.exceeded_limits(row)
    ends = (success, failure, diverged, progress, best_progress, reward, time_s)
    return EpisodeOutcomes(*ends, held_s, reached, exceeded, penalized_s)
