"""Whole episodes from their beginning to their end, without learning."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import EpisodeResult
from aidsr.learn.episodes.batch import Episodes, Moment
from aidsr.tasks.readings import BoolArray, FloatArray

__all__ = ["Actor", "Course", "play"]


class Actor(Protocol):
    """Anything that acts on what it sees."""

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return actions for observations, (n, n_observations) -> (n, n_actions), -1 to 1."""
        ...


@dataclass(frozen=True)
class Course:
    """How n episodes went, each (n,)."""

    succeeded: BoolArray
    failed: BoolArray
    diverged: BoolArray
    progress: FloatArray
    """At the end, 0 to 1."""
    best_progress: FloatArray
    """Largest at any time."""
    reward: FloatArray
    """Sum over the episode."""
    time_s: FloatArray
    """How long the episode lasted [s]."""

    def part(self, rows: slice) -> Self:
        """Return some of the episodes."""
        return type(self)(*(getattr(self, one.name)[rows] for one in fields(self)))

    def result(self, row: int, variation: int) -> EpisodeResult:
        """Return how one episode went.

        Args:
            row: Which.
            variation: Index of its variation, to be told with it.
        """
        ends = (("diverged", self.diverged), ("succeeded", self.succeeded), ("failed", self.failed))
        return EpisodeResult(
            variation=variation,
            ended=next((name for name, where in ends if where[row]), "out_of_time"),
            progress=float(self.progress[row]),
            best_progress=float(self.best_progress[row]),
            reward=float(self.reward[row]),
            time_s=float(np.round(self.time_s[row], 6)),
        )


def play(episodes: Episodes, actor: Actor, look: Callable[[Moment], None] = lambda _moment: None) -> Course:
    """Play the running episodes to their end.

    Args:
        episodes: Just begun.
        actor: Decides on the actions.
        look: Called after every control step.
    """
    n = episodes.n
    succeeded, failed, diverged = np.zeros((3, n), dtype=np.bool_)
    progress, best_progress, reward, time_s = np.zeros((4, n))
    while episodes.running.any():
        before = episodes.running
        moment = episodes.step(actor.act(episodes.observation))
        succeeded |= moment.succeeded
        failed |= moment.failed
        diverged |= moment.diverged
        reward += moment.reward
        progress, time_s = np.where(before, moment.progress, progress), np.where(before, moment.time_s, time_s)
        best_progress = np.maximum(best_progress, moment.progress)
        look(moment)
    return Course(succeeded, failed, diverged, progress, best_progress, reward, time_s)
