"""Soft actor-critic of Stable-Baselines3 with faster updates and with noise-free simulations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import SAC
from stable_baselines3.common.noise import ActionNoise
from stable_baselines3.common.policies import ContinuousCritic
from stable_baselines3.common.type_aliases import ReplayBufferSamples
from stable_baselines3.common.vec_env import VecNormalize
from stable_baselines3.sac.policies import Actor

from aidsr.learn.rl.fused_adam import FusedAdam
from aidsr.learn.rl.policy import network_options
from aidsr.learn.rl.recipe import Recipe

_MOST_TRANSITIONS = 100_000
"""Maximum size of the replay buffer; it holds every transition of the default budget. Our choice; each takes about 600
bytes."""
_EPSILON = 1e-6
"""Small number that keeps the log-likelihood of an action finite at its limits. Source: Stable-Baselines3."""
_KEPT = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
"""Arrays of a replay buffer, (n_steps, n_simulations, ...)."""


class SoftActorCritic(SAC):
    """SAC that acts without noise in its first simulations, once the random actions at the start are over.

    Noise-free episodes show the policy's real performance: exploration noise shakes soft bodies loose.
    """

    noiseless = 0
    """Number of simulations without noise."""
    corrects = False
    """Whether the policy corrects a script: then the noise-free simulations have no random actions and begin with the
    script."""

    @classmethod
    def of(cls, recipe: Recipe, env: VecNormalize, steps: int, seed: int, tensorboard: str | None) -> SoftActorCritic:
        """Return an untrained model.

        Args:
            recipe: Hyperparameters.
            env: Environment in which the policy acts.
            steps: Budget of control steps.
            seed: Seed of networks, actions and replay sampling.
            tensorboard: Folder of TensorBoard logs, None for no logs.
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
            ent_coef=recipe.entropy_weight,
            policy_kwargs=network_options(recipe),
            tensorboard_log=tensorboard,
            seed=seed,
            device="cpu",
        )
        model.noiseless = recipe.noiseless_simulations
        model.corrects = bool(recipe.script)
        if model.corrects:
            model._zero_actor_output()
        return model

    def _zero_actor_output(self) -> None:
        """Set the actor's mean to 0 for every observation, so that it plays the script unchanged."""
        mean = self.actor.mu
        assert isinstance(mean, torch.nn.Linear)
        with torch.no_grad():
            mean.weight.zero_()
            mean.bias.zero_()

    def _sample_action(
        self, learning_starts: int, action_noise: ActionNoise | None = None, n_envs: int = 1
    ) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        action, stored = super()._sample_action(learning_starts, action_noise, n_envs)
        if self.noiseless and (self.corrects or self.num_timesteps >= learning_starts):
            assert isinstance(self._last_obs, np.ndarray)  # observations are a single array
            shown, _ = self.predict(self._last_obs[: self.noiseless], deterministic=True)
            action[: self.noiseless] = stored[: self.noiseless] = shown
        return action, stored

    def _setup_model(self) -> None:
        """Create the networks, and make the entropy weight a learned parameter, as "auto" does in Stable-Baselines3."""
        super()._setup_model()
        self.log_ent_coef = torch.log(torch.tensor([float(self.ent_coef)])).requires_grad_()
        self.ent_coef_optimizer = FusedAdam([self.log_ent_coef], self.lr_schedule(1))  # type: ignore[assignment]

    def train(self, gradient_steps: int, batch_size: int = 64) -> None:
        """Update the networks as Stable-Baselines3 does, up to rounding errors, in less time.

        For networks this small, Stable-Baselines3 spends most of its time on distribution classes, on unused gradients
        (of the critics, in the actor's loss), and on updates of one parameter after the other.
        """
        self.policy.set_training_mode(True)
        assert self.ent_coef_optimizer is not None  # the weight of the entropy is learned
        self._update_learning_rate([self.actor.optimizer, self.critic.optimizer, self.ent_coef_optimizer])
        assert self.replay_buffer is not None
        losses = [
            self._update(self.replay_buffer.sample(batch_size, env=self._vec_normalize_env))
            for _ in range(gradient_steps)
        ]
        self._n_updates += gradient_steps
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        for name, value in zip(("critic_loss", "actor_loss", "ent_coef"), np.mean(losses, axis=0), strict=True):
            self.logger.record(f"train/{name}", float(value))

    def _update(self, drawn: ReplayBufferSamples) -> tuple[float, float, float]:
        """Take one step of critics, actor and entropy weight; return both losses and the entropy weight.

        Source: Haarnoja et al. 2018, "Soft Actor-Critic Algorithms and Applications", algorithm 1.
        """
        log_weight, target = self.log_ent_coef, self.critic_target
        assert log_weight is not None
        assert isinstance(self.target_entropy, float)
        actor_parameters, parameters = tuple(self.actor.parameters()), tuple(self.critic.parameters())
        action, log_likelihood = _sampled(self.actor, drawn.observations)
        weight = log_weight.detach().exp()
        _step(self.ent_coef_optimizer, [log_weight], [-(log_likelihood.detach() + self.target_entropy).mean()[None]])

        with torch.no_grad():
            next_action, next_log_likelihood = _sampled(self.actor, drawn.next_observations)
            value = _min_q(target, drawn.next_observations, next_action) - weight * next_log_likelihood
            wanted = drawn.rewards + (1 - drawn.dones) * self.gamma * value
        values = self.critic(drawn.observations, drawn.actions)
        critic_loss = 0.5 * sum((torch.nn.functional.mse_loss(each, wanted) for each in values), torch.zeros(()))
        _step(self.critic.optimizer, parameters, torch.autograd.grad(critic_loss, parameters))

        actor_loss = (weight * log_likelihood - _min_q(self.critic, drawn.observations, action)).mean()
        _step(self.actor.optimizer, actor_parameters, torch.autograd.grad(actor_loss, actor_parameters))
        with torch.no_grad():
            torch._foreach_lerp_(tuple(target.parameters()), parameters, self.tau)
        return critic_loss.item(), actor_loss.item(), weight.item()

    def save_replay_buffer_to(self, folder: Path) -> None:
        """Write the replay buffer and the entropy weight into a folder, for `load_replay_buffer_from`.

        Stable-Baselines3's own `save_replay_buffer` writes a pickle, which must not be loaded from foreign files.
        """
        folder.mkdir()
        buffer, log_weight = self.replay_buffer, self.log_ent_coef
        assert buffer is not None
        assert log_weight is not None
        rows = buffer.buffer_size if buffer.full else buffer.pos
        for name in _KEPT:
            np.save(folder / f"{name}.npy", getattr(buffer, name)[:rows], allow_pickle=False)
        np.save(folder / "log_entropy_weight.npy", log_weight.detach().numpy(), allow_pickle=False)
        np.save(folder / "position.npy", np.array(buffer.pos), allow_pickle=False)

    def load_replay_buffer_from(self, folder: Path) -> None:
        """Restore the replay buffer and the entropy weight that `save_replay_buffer_to` wrote."""
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


def _sampled(actor: Actor, observations: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Return a sampled action for each observation, (n, n_actions), and its log-likelihood, (n, 1)."""
    mean, log_std, _ = actor.get_action_dist_params(observations)
    noise = torch.normal(torch.zeros_like(mean), torch.ones_like(mean))
    action = torch.tanh(mean + log_std.exp() * noise)
    normal = -0.5 * noise**2 - log_std - 0.5 * math.log(2 * math.pi)
    return action, (normal - torch.log(1 - action**2 + _EPSILON)).sum(dim=1, keepdim=True)


def _min_q(critic: ContinuousCritic, observations: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
    """Return the smaller of both critics' values for each action, (n, 1)."""
    first, second = critic(observations, actions)
    return torch.minimum(first, second)


def _step(optimizer: Any, parameters: Sequence[torch.Tensor], gradients: Sequence[torch.Tensor]) -> None:
    """Update parameters with an optimizer, which reads the gradients from them."""
    for parameter, gradient in zip(parameters, gradients, strict=True):
        parameter.grad = gradient
    optimizer.step()
