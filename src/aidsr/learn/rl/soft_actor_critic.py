"""Soft actor-critic of Stable-Baselines3, some of whose simulations show the policy without noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import SAC
from stable_baselines3.common.noise import ActionNoise
from stable_baselines3.common.vec_env import VecNormalize

from aidsr.learn.rl.policy import network_options
from aidsr.learn.rl.recipe import Recipe

_MOST_TRANSITIONS = 100_000
"""That are kept to learn from: all of the default budget. Our choice; each takes some 600 bytes."""
_KEPT = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
"""Arrays of a replay buffer, (n_steps, n_simulations, ...)."""


class SoftActorCritic(SAC):
    """Acts without noise in its first simulations, once its first actions, which are random, are over.

    Only there can be seen what the policy is worth: soft bodies are shaken loose by noise.
    """

    noiseless = 0
    """Simulations without noise."""

    @classmethod
    def of(cls, recipe: Recipe, env: VecNormalize, steps: int, seed: int, tensorboard: str | None) -> SoftActorCritic:
        """Return an untrained one.

        Args:
            recipe: Its numbers.
            env: What it acts in.
            steps: Budget of control steps.
            seed: Of networks, actions and what is drawn to learn from.
            tensorboard: Folder of logs.
        """
        decisions = max(steps // recipe.hold_steps, recipe.simulations)
        model = cls(
            "MlpPolicy",
            env,
            learning_rate=recipe.learning_rate_when,
            buffer_size=min(decisions + recipe.simulations, _MOST_TRANSITIONS),
            learning_starts=min(recipe.random_steps, steps // 8) // recipe.hold_steps,
            batch_size=recipe.batch_size,
            tau=recipe.target_rate,
            gamma=recipe.gamma,
            train_freq=1,
            gradient_steps=recipe.updates,
            ent_coef=f"auto_{recipe.entropy_weight}",
            policy_kwargs=network_options(recipe),
            tensorboard_log=tensorboard,
            seed=seed,
            device="cpu",
        )
        model.noiseless = recipe.noiseless_simulations
        return model

    def _sample_action(
        self, learning_starts: int, action_noise: ActionNoise | None = None, n_envs: int = 1
    ) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        action, stored = super()._sample_action(learning_starts, action_noise, n_envs)
        if self.num_timesteps >= learning_starts and self.noiseless:
            assert isinstance(self._last_obs, np.ndarray)  # one box
            shown, _ = self.predict(self._last_obs[: self.noiseless], deterministic=True)
            action[: self.noiseless] = stored[: self.noiseless] = shown
        return action, stored

    def save_memory(self, folder: Path) -> None:
        """Write what `load_memory` reads: all transitions that were seen, and the weight of the entropy."""
        folder.mkdir()
        buffer, log_weight = self.replay_buffer, self.log_ent_coef
        assert buffer is not None
        assert log_weight is not None
        rows = buffer.buffer_size if buffer.full else buffer.pos
        for name in _KEPT:
            np.save(folder / f"{name}.npy", getattr(buffer, name)[:rows], allow_pickle=False)
        np.save(folder / "log_entropy_weight.npy", log_weight.detach().numpy(), allow_pickle=False)
        np.save(folder / "position.npy", np.array(buffer.pos), allow_pickle=False)

    def load_memory(self, folder: Path) -> None:
        """Go on with what `save_memory` wrote."""
        read = {path.stem: np.load(path, allow_pickle=False) for path in folder.iterdir()}
        buffer, log_weight = self.replay_buffer, self.log_ent_coef
        assert buffer is not None
        assert log_weight is not None
        rows = len(read["rewards"])
        for name in _KEPT:
            getattr(buffer, name)[:rows] = read[name]
        buffer.pos, buffer.full = int(read["position"]), rows == buffer.buffer_size
        with torch.no_grad():
            log_weight.copy_(torch.as_tensor(read["log_entropy_weight"]))
