"""The reward of all tasks, and the test that success is held, for n simulations at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.task import Task, TaskState

PROGRESS_WEIGHT = 10.0
SUCCESS_BONUS = 5.0
VIOLATION_WEIGHT = 1.0
ACTION_WEIGHT = 0.01
"""Weights of the reward.

Source: our choice. Progress over a whole episode is worth at most 10 and held success half as much. One second of full
violation at 25 Hz costs more than both together. The action cost only decides between equally good motions.
"""


@dataclass(frozen=True)
class EpisodeState:
    """State of n episodes between two control steps."""

    task_state: TaskState
    progress: FloatArray
    held_s: FloatArray
    """Time for which the goal has been met without interruption, (n,) [s]."""
    success: BoolArray
    """Whether the goal has been held long enough, now or before, (n,)."""


@dataclass(frozen=True)
class Score:
    """Result of one control step, each (n,)."""

    reward: FloatArray
    progress: FloatArray
    violation: FloatArray
    success: BoolArray
    """Whether the goal has been held for `hold_s`, now or before."""
    failure: BoolArray
    """Whether the task's own rule ends the episode; the caller checks divergence and the time limit."""


def reset(task: Task, readings: Readings) -> EpisodeState:
    """Return the state of n new episodes at their first readings."""
    # readings may be views of a buffer that the simulation overwrites
    task_state = {name: value.copy() for name, value in task.reset_state(readings).items()}
    return EpisodeState(
        task_state=task_state,
        progress=task.progress(readings, task_state),
        held_s=np.zeros(readings.n),
        success=np.zeros(readings.n, dtype=np.bool_),
    )


def merge(old: EpisodeState, new: EpisodeState, mask: BoolArray) -> EpisodeState:
    """Return the state of n episodes: `new` where the mask is set, `old` elsewhere.

    Args:
        old: State of n episodes.
        new: State of n episodes.
        mask: Whether each episode takes its new state, (n,).
    """

    def choose(theirs: FloatArray, ours: FloatArray) -> FloatArray:
        return np.where(mask.reshape(-1, *[1] * (ours.ndim - 1)), theirs, ours)

    return EpisodeState(
        task_state={name: choose(new.task_state[name], value) for name, value in old.task_state.items()},
        progress=choose(new.progress, old.progress),
        held_s=choose(new.held_s, old.held_s),
        success=np.where(mask, new.success, old.success),
    )


def score(task: Task, state: EpisodeState, readings: Readings, action: FloatArray) -> tuple[EpisodeState, Score]:
    """Return the state after one control step and the score of the step.

    reward = 10 x gain in progress + 5 once on held success - violation - 0.01 x mean squared action

    Args:
        task: The task.
        state: State before the step.
        readings: Readings after the step.
        action: Action of the policy, (n, n_actions), each value -1 to 1.
    """
    task_state = task.update_state(readings, state.task_state)
    progress = task.progress(readings, task_state)
    violation = task.violation(readings)
    failure = task.is_failure(readings, task_state)
    held_s = np.where(task.is_success(readings, task_state) & ~failure, state.held_s + task.control_dt_s, 0.0)
    # half a control step of tolerance, because the sum of many time steps has a rounding error
    success = state.success | (held_s > max(0.0, task.hold_s - task.control_dt_s / 2))
    reward = (
        PROGRESS_WEIGHT * (progress - state.progress)
        + SUCCESS_BONUS * (success & ~state.success)
        - VIOLATION_WEIGHT * violation
        - ACTION_WEIGHT * np.mean(np.square(action), axis=1)
    )
    after = EpisodeState(task_state=task_state, progress=progress, held_s=held_s, success=success)
    return after, Score(reward=reward, progress=progress, violation=violation, success=success, failure=failure)
