"""Depth of the overlap between the parts of robots in parallel episodes, which a valid policy avoids."""

from __future__ import annotations

import copy
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.episodes.rollout import EpisodeOutcomes, Policy, rollout
from aidsr.sim.deep_overlap import DEEP, OverlapProbe
from aidsr.tasks.readings import BoolArray, FloatArray
from aidsr.tasks.variation import apply_to_simulation


class OverlapMeter:
    """Measures how deep the robots of parallel episodes overlap themselves or anything else.

    The evaluation of a policy checks the same in `plausibility.penetration_check`.

    Args:
        episodes: Running episodes.
    """

    def __init__(self, episodes: Episodes) -> None:
        self._episodes = episodes
        self._data = mujoco.MjData(episodes.model)
        self._probes = [OverlapProbe(episodes.model, episodes.structure)] * episodes.n
        self.deepest: FloatArray = np.zeros(episodes.n)
        """Deepest overlap of each episode since its reset, (n,), as a share of half the thinner geom's thickness."""
        self.reset(np.arange(episodes.n))

    def reset(self, ids: NDArray[np.intp]) -> None:
        """Take over the shapes of episodes that have just been reset.

        Args:
            ids: Indices of the episodes.
        """
        for index in ids.tolist():
            model = copy.copy(self._episodes.model)
            apply_to_simulation(self._episodes.variations[index], model, self._data)
            self._probes[index] = OverlapProbe(model, self._episodes.structure)
        self.deepest[ids] = 0.0

    def measure(self, which: BoolArray) -> FloatArray:
        """Return the present depth of the overlap, (n,), as a share of half the thinner geom's thickness.

        Args:
            which: Episodes to measure, (n,); the others get 0.
        """
        depth = np.zeros(self._episodes.n)
        qpos = self._episodes.batch.bind("qpos")
        for index in np.flatnonzero(which).tolist():
            overlap = self._probes[index].look(self._data, qpos[index])
            depth[index] = overlap.share if overlap else 0.0
        self.deepest = np.maximum(self.deepest, depth)
        return depth

    def after(self, result: StepResult) -> None:
        """Measure after a control step, as the callback of a rollout."""
        self.measure((result.time_s > 0.0) & ~result.diverged)

    @property
    def is_deep(self) -> BoolArray:
        """Whether an episode has overlapped deeply since its reset, (n,)."""
        return self.deepest > DEEP


def rollout_without_overlap(episodes: Episodes, policy: Policy) -> EpisodeOutcomes:
    """Step all running episodes to their ends; one in which parts overlap deeply is no success.

    Args:
        episodes: Episodes that have just been reset.
        policy: Policy that chooses the actions.
    """
    meter = OverlapMeter(episodes)
    outcomes = rollout(episodes, policy, meter.after)
    return replace(outcomes, success=outcomes.success & ~meter.is_deep)
