"""Behavior cloning: a policy first learns to imitate an open-loop motion, and PPO continues from there.

The motion is played with noise, so that the policy also learns to act in states away from the motion's path. The
network's mean action and value are fitted to the demonstrations and their returns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop import Motion, ProbeReport, probe_scene
from aidsr.learn.openloop.motion import Motions
from aidsr.learn.openloop.probe_scene import MAX_STEPS
from aidsr.tasks.readings import BoolArray, FloatArray

if TYPE_CHECKING:
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecNormalize

_NOISE = 0.5
"""Standard deviation of the noise on demonstrated actions, and of the policy when PPO takes over, as a share of PPO's
usual initial value. Our choice, not tuned: PPO has less to find from there."""
DEMONSTRATION_S = 10.0
"""Maximum duration of the demonstrations in each simulation [s]. Our choice: a whole grasp; the probe searches 8 s."""
_UPDATES = 500
_BATCH = 512
_LEARNING_RATE = 1e-3


def clone_probe_motion(
    scene: TaskScene, model: PPO, env: VecNormalize, *, steps: int, seed: int, threads: int
) -> tuple[ProbeReport, int]:
    """Search for a motion that succeeds, and train a policy to imitate it if there is one.

    Motions that do not succeed are not imitated, because most of them swing with time, which a policy does not observe.
    A motion that never succeeds with noise is not imitated either.

    Args:
        scene: Scene to search in.
        model: PPO with an untrained policy.
        env: Simulations of the model; their statistics of observations and rewards start here.
        steps: Budget of the whole training, control steps over all simulations. The probe may use a quarter of it, but
            plays a first few motions even if that is too small; demonstrations may use another quarter.
        seed: Seed of the search and of the noise.
        threads: Native threads; 0 takes all processors.

    Returns:
        The probe's report, and the number of control steps used by probe and demonstrations.
    """
    control_dt_s, quarter = scene.task.control_dt_s, steps // 4
    substeps = round(control_dt_s / scene.model.opt.timestep)
    report = probe_scene(scene, max_steps=min(MAX_STEPS, max(quarter * substeps, 1)), seed=seed, threads=threads)
    taken = round(report.simulated_s / control_dt_s)
    motions = [one.motion for one in report.variations if one.episode.ended == "succeeded"]
    length = min(round(DEMONSTRATION_S / control_dt_s), quarter // env.num_envs)
    if not motions or length == 0:
        return report, taken
    rng, noise_std = np.random.default_rng(seed), _NOISE * float(np.exp(model.policy.log_std.mean().item()))
    demonstrations = _demonstrate(env, motions, control_dt_s, length, noise_std, rng).of_best_motion()
    if demonstrations.success.any():
        observation = np.asarray(env.normalize_obs(demonstrations.observation))
        _fit(model, observation, demonstrations.action, demonstrations.returns(model.gamma), noise_std, rng)
    return report, taken + length * env.num_envs


@dataclass(frozen=True)
class _Demonstrations:
    """Observations, actions and rewards of n simulations in t control steps."""

    motion: NDArray[np.intp]
    """Index of the motion that each simulation played, (n,)."""
    observation: FloatArray
    """Observations, not normalised, (t, n, o)."""
    action: FloatArray
    """Action of the motion, without the noise, (t, n, k)."""
    reward: FloatArray
    """Rewards, normalised, (t, n)."""
    ended: BoolArray
    """Whether the episode ended in each step, (t, n)."""
    success: BoolArray
    """Whether the episode succeeded in each step, (t, n)."""

    def of_best_motion(self) -> _Demonstrations:
        """Return the demonstrations of the motion that succeeded most often with noise."""
        wins = np.bincount(self.motion, self.success.sum(axis=0)) / np.bincount(self.motion)
        mine = self.motion == wins.argmax()
        return _Demonstrations(
            self.motion[mine],
            self.observation[:, mine],
            self.action[:, mine],
            self.reward[:, mine],
            self.ended[:, mine],
            self.success[:, mine],
        )

    def returns(self, gamma: float) -> FloatArray:
        """Return the discounted sum of rewards from each step to the episode's end, (t, n)."""
        returns, following = np.empty_like(self.reward), np.zeros(self.reward.shape[1])
        for step in range(len(returns) - 1, -1, -1):
            returns[step] = following = self.reward[step] + gamma * following * ~self.ended[step]
        return returns


def _demonstrate(
    env: VecNormalize,
    motions: Sequence[Motion],
    control_dt_s: float,
    length: int,
    noise_std: float,
    rng: np.random.Generator,
) -> _Demonstrations:
    """Play motions with noise for some control steps, each motion in an equal share of the simulations."""
    which = np.arange(env.num_envs) % len(motions)
    played, time_s = Motions.of([motions[number] for number in which.tolist()]), np.zeros(env.num_envs)
    steps = []
    env.reset()
    for _ in range(length):
        observation, action = np.array(env.get_original_obs()), played.at(time_s)
        noisy = np.clip(action + rng.normal(0.0, noise_std, action.shape), -1.0, 1.0)
        _, reward, ended, infos = env.step(noisy.astype(np.float32))
        success = np.array([info.get("is_success", False) for info in infos])
        steps.append((observation, action, reward, ended, success))
        time_s = np.where(ended, 0.0, time_s + control_dt_s)
    return _Demonstrations(which, *(np.array(part) for part in zip(*steps, strict=True)))


def _fit(
    model: PPO,
    observation: FloatArray,
    action: FloatArray,
    returns: FloatArray,
    noise_std: float,
    rng: np.random.Generator,
) -> None:
    """Fit a policy's mean action and its value by least squares, and set its noise."""
    import torch

    from aidsr.learn.rl.fused_adam import FusedAdam

    policy = model.policy
    adam = FusedAdam(policy.parameters(), lr=_LEARNING_RATE)
    policy.set_training_mode(True)
    for _ in range(_UPDATES):
        batch = tuple(rng.integers(size, size=_BATCH) for size in returns.shape)
        seen, goal, worth = (torch.as_tensor(of[batch], dtype=torch.float32) for of in (observation, action, returns))
        mean, value = policy.get_distribution(seen).mode(), policy.predict_values(seen).flatten()
        loss = ((mean - goal) ** 2).mean() + 0.5 * ((value - worth) ** 2).mean()
        adam.zero_grad()
        torch.autograd.backward(loss)
        adam.step()
    with torch.no_grad():
        policy.log_std.fill_(float(np.log(noise_std)))
