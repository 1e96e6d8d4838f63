"""The one reward of all tasks, and success that must be held. Written once, for n simulations at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.task import Memory, Task

__all__ = ["Score", "Standing", "begin", "restart", "score"]

PROGRESS_WEIGHT = 10.0
SUCCESS_BONUS = 5.0
VIOLATION_WEIGHT = 1.0
ACTION_WEIGHT = 0.01
"""Weights of the reward.

Source: our choice. Progress over a whole episode is worth at most 10, reaching the goal half as much again, a second of
full violation at 25 Hz more than the goal, and the action's cost only decides between equally good motions.
"""


@dataclass(frozen=True)
class Standing:
    """Where n episodes stand between two control steps."""

    memory: Memory
    progress: FloatArray
    held_s: FloatArray
    """How long the goal has held without a break, (n,) [s]."""
    won: BoolArray
    """Whether it has been held long enough at any time, (n,)."""


@dataclass(frozen=True)
class Score:
    """What one control step brought, each (n,)."""

    reward: FloatArray
    progress: FloatArray
    violation: FloatArray
    succeeded: BoolArray
    """The goal has been held for `hold_s`, now or before."""
    failed: BoolArray
    """The episode is lost: the task's own rule. Divergence and the time limit are seen by who steps the simulation."""


def begin(task: Task, readings: Readings) -> Standing:
    """Return the standing of n fresh episodes at their first readings."""
    # readings may be views of a buffer that the simulation writes into again
    memory = {name: value.copy() for name, value in task.begin(readings).items()}
    return Standing(
        memory=memory,
        progress=task.progress(readings, memory),
        held_s=np.zeros(readings.n),
        won=np.zeros(readings.n, dtype=np.bool_),
    )


def restart(old: Standing, fresh: Standing, which: BoolArray) -> Standing:
    """Return the standing with some episodes replaced by fresh ones.

    Args:
        old: Standing of n episodes.
        fresh: Standing of n episodes as if all began now.
        which: Which of them did, (n,).
    """

    def choose(new: FloatArray, kept: FloatArray) -> FloatArray:
        return np.where(which.reshape(-1, *[1] * (kept.ndim - 1)), new, kept)

    return Standing(
        memory={name: choose(fresh.memory[name], kept) for name, kept in old.memory.items()},
        progress=choose(fresh.progress, old.progress),
        held_s=choose(fresh.held_s, old.held_s),
        won=np.where(which, fresh.won, old.won),
    )


def score(task: Task, standing: Standing, readings: Readings, action: FloatArray) -> tuple[Standing, Score]:
    """Return the standing after one control step and what it was worth.

    reward = 10 x gain in progress + 5 once on held success - violation - 0.01 x mean squared action

    Args:
        task: The task.
        standing: Standing before the step.
        readings: Readings after it.
        action: What the policy asked for, (n, n_actions), each -1 to 1.
    """
    memory = task.remember(readings, standing.memory)
    progress = task.progress(readings, memory)
    violation = task.violation(readings)
    failed = task.failed(readings, memory)
    held_s = np.where(task.succeeded(readings, memory) & ~failed, standing.held_s + task.control_dt_s, 0.0)
    # half a control step of slack, because a sum of many small times misses its round value by a rounding error
    won = standing.won | (held_s > max(0.0, task.hold_s - task.control_dt_s / 2))
    reward = (
        PROGRESS_WEIGHT * (progress - standing.progress)
        + SUCCESS_BONUS * (won & ~standing.won)
        - VIOLATION_WEIGHT * violation
        - ACTION_WEIGHT * np.mean(np.square(action), axis=1)
    )
    after = Standing(memory=memory, progress=progress, held_s=held_s, won=won)
    return after, Score(reward=reward, progress=progress, violation=violation, succeeded=won, failed=failed)
