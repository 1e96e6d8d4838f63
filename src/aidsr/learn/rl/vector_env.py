"""Episodes of a task as a vectorized environment of Stable-Baselines3 that resets itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.episodes.overlap_meter import OverlapMeter
from aidsr.learn.rl.spaces import action_space, observation_space
from aidsr.sim.deep_overlap import DEEP
from aidsr.tasks import Variation
from aidsr.tasks.readings import BoolArray, FloatArray

_TOLERATED = 0.8
"""Overlap that costs nothing, as a share of a deep one. Our choice: parts that press on each other overlap a little."""
_GAIN = 0.01
"""Smaller increases of progress do not count."""


class BatchedVecEnv(VecEnv):
    """Vectorized environment whose simulations all step in one native call.

    The infos of an episode's last step contain the entries of Stable-Baselines3 and its Monitor,
    "terminal_observation", "TimeLimit.truncated", "is_success" and "episode" (return "r", steps "l"), and in addition
    "progress" and "diverged". Where an action is held for several control steps, see `ActionMap.hold_steps`, these
    count as one step of this environment.

    Args:
        episodes: The simulations.
        next_variation: Returns the variation of the next episode.
        patience_s: Time without growing progress after which an episode is truncated [s].
        overlap_penalty: Reward taken for each control step in which parts overlap deeply, and less from 80 % of that
            depth on; with any penalty, an episode in which they overlap deeply is no success.
    """

    def __init__(
        self,
        episodes: Episodes,
        next_variation: Callable[[], Variation],
        *,
        patience_s: float = np.inf,
        overlap_penalty: float = 0.0,
    ) -> None:
        self.episodes = episodes
        self._next_variation = next_variation
        self._patience_s = max(patience_s, 2.0 * episodes.task.hold_s)
        self._overlap_penalty = overlap_penalty
        self._overlaps = OverlapMeter(episodes) if overlap_penalty else None
        self._best_progress = np.zeros(episodes.n)
        self._last_gain_s = np.zeros(episodes.n)
        self._actions: FloatArray = np.zeros((episodes.n, episodes.actions.size))
        self._return = np.zeros(episodes.n)
        self._length = np.zeros(episodes.n, dtype=np.int64)
        self.render_mode = None
        super().__init__(episodes.n, observation_space(episodes), action_space(episodes))

    def desynchronize(self, rng: np.random.Generator) -> None:
        """Truncate the present episodes at times spread over the task's time limit.

        Otherwise all episodes of a task without early ends would run in phase: one update of a policy would use only
        their beginnings, the next one only their middles.
        """
        episodes = self.episodes
        shares = rng.permutation(np.arange(1, episodes.n + 1) / episodes.n)
        episodes.time_limit_s = np.maximum(shares * episodes.task.time_limit_s, episodes.task.control_dt_s)

    def reset(self) -> VecEnvObs:
        """Reset every episode and return the observations."""
        return self._reset(np.arange(self.num_envs))

    def step_async(self, actions: np.ndarray) -> None:
        """Take the actions of the next step."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Advance all episodes by as many control steps as an action is held, and reset those that ended."""
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        reward, done = np.zeros(self.num_envs), np.zeros(self.num_envs, dtype=np.bool_)
        for _ in range(self.episodes.actions.hold_steps):
            running = self.episodes.running
            result = self.episodes.step(self._actions)
            reward += result.reward
            self._length += running
            if self._overlaps is not None:
                depth = self._overlaps.measure(running & ~result.diverged)
                reward -= self._overlap_penalty * np.clip((depth / DEEP - _TOLERATED) / (1.0 - _TOLERATED), 0.0, 1.0)
            done |= result.done
            for index in np.flatnonzero(result.done).tolist():
                self._return[index] += reward[index]
                infos[index] = self._terminal_info(result, index)
            self._truncate_stalled(result, running)
        self._return += np.where(done, 0.0, reward)
        observation = result.observation
        if done.any():
            observation = self._reset(np.flatnonzero(done))
        return observation, reward.astype(np.float32), done, infos

    def _truncate_stalled(self, result: StepResult, running: BoolArray) -> None:
        gained = running & (result.progress >= self._best_progress + _GAIN)
        self._best_progress = np.where(gained, result.progress, self._best_progress)
        self._last_gain_s = np.where(gained, result.time_s, self._last_gain_s)
        self.episodes.time_limit_s[running & (result.time_s - self._last_gain_s >= self._patience_s)] = 0.0

    def _reset(self, ids: np.ndarray) -> np.ndarray:
        self._return[ids], self._length[ids] = 0.0, 0
        self._best_progress[ids], self._last_gain_s[ids] = 0.0, 0.0
        observation = self.episodes.reset(ids, [self._next_variation() for _ in ids])
        if self._overlaps is not None:
            self._overlaps.reset(ids)
        return observation

    def _terminal_info(self, result: StepResult, index: int) -> dict[str, Any]:
        return {
            "terminal_observation": result.observation[index],
            "TimeLimit.truncated": bool(result.truncated[index]),
            "episode": {"r": float(self._return[index]), "l": int(self._length[index])},
            "is_success": bool(result.success[index]) and not (self._overlaps and self._overlaps.is_deep[index]),
            "progress": float(result.progress[index]),
            "diverged": bool(result.diverged[index]),
        }

    # --- the rest of the VecEnv interface: all simulations share these objects ---

    def close(self) -> None:
        """Do nothing: memory is freed with the object."""

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute, once for each of the selected simulations."""
        return [getattr(self, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Raise an error: the simulations share their attributes."""
        raise NotImplementedError(f"cannot set {attr_name}: simulations of a batch share their attributes")

    def env_method(self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any) -> list[Any]:
        """Raise an error: there are no single environments to call."""
        raise NotImplementedError(f"cannot call {method_name}: a batch has no single environments")

    def env_is_wrapped(self, wrapper_class: type[Any], indices: VecEnvIndices = None) -> list[bool]:
        """Return False for each of the selected simulations: none is wrapped."""
        del wrapper_class
        return [False] * len(list(self._get_indices(indices)))

    def seed(self, seed: int | None = None) -> Sequence[None]:
        """Do nothing: randomness comes from `next_variation`, which has its own seed."""
        del seed
        return [None] * self.num_envs
