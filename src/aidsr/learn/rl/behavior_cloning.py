"""A head start: a policy first learns to do what an open-loop motion does, and PPO goes on from there.

Behaviour cloning: the motion is played with noise, so that the policy also learns what to do beside the motion's own
path, and network and value are fitted to what was played and what came of it.
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

__all__ = ["start_from_probe"]

_NOISE = 0.5
"""Of the actions shown, and of the policy when PPO takes over, as a share of what PPO begins with otherwise. Our
choice, not tuned: PPO has less to find from there."""
SHOWN_S = 10.0
"""How long every simulation plays at most. Our choice: a whole grasp; the probe looks at 8 s."""
_UPDATES = 500
_BATCH = 512
_LEARNING_RATE = 1e-3


def start_from_probe(
    scene: TaskScene, model: PPO, env: VecNormalize, *, steps: int, seed: int, threads: int
) -> tuple[ProbeReport, int]:
    """Look for a motion that succeeds, and teach it to a policy where there is one.

    Motions that do not succeed are not taught: most of them swing, and what swings by the clock a policy, which sees
    none, can hardly learn. Nor is one taught that never wins with noise.

    Args:
        scene: Where to look.
        model: PPO with a policy that knows nothing yet.
        env: Its simulations; their statistics of observations and rewards begin here.
        steps: Budget of the whole training, control steps over all simulations. The probe may take a quarter of it,
            but plays a first few motions however small that is, and showing another quarter.
        seed: Of the motions tried, and of the noise.
        threads: Native threads; 0 takes all processors.

    Returns:
        What the probe found, and the control steps that it and the teaching took.
    """
    control_dt_s, quarter = scene.task.control_dt_s, steps // 4
    substeps = round(control_dt_s / scene.model.opt.timestep)
    report = probe_scene(scene, max_steps=min(MAX_STEPS, max(quarter * substeps, 1)), seed=seed, threads=threads)
    taken = round(report.simulated_s / control_dt_s)
    motions = [one.motion for one in report.variations if one.episode.ended == "succeeded"]
    length = min(round(SHOWN_S / control_dt_s), quarter // env.num_envs)
    if not motions or length == 0:
        return report, taken
    rng, noise_std = np.random.default_rng(seed), _NOISE * float(np.exp(model.policy.log_std.mean().item()))
    shown = _show(env, motions, control_dt_s, length, noise_std, rng).of_the_best()
    if shown.won.any():
        _fit(model, np.asarray(env.normalize_obs(shown.seen)), shown.done, shown.worth(model.gamma), noise_std, rng)
    return report, taken + length * env.num_envs


@dataclass(frozen=True)
class _Shown:
    """What n simulations saw and did in t control steps, and what came of it."""

    motion: NDArray[np.intp]
    """Which motion each played, (n,)."""
    seen: FloatArray
    """Observations as they are, (t, n, o)."""
    done: FloatArray
    """Actions of the motion, without the noise, (t, n, k)."""
    reward: FloatArray
    """Normalised, (t, n)."""
    ended: BoolArray
    """(t, n)."""
    won: BoolArray
    """(t, n)."""

    def of_the_best(self) -> _Shown:
        """Return the part of the motion that won most often, noise and all."""
        wins = np.bincount(self.motion, self.won.sum(axis=0)) / np.bincount(self.motion)
        mine = self.motion == wins.argmax()
        return _Shown(
            self.motion[mine],
            self.seen[:, mine],
            self.done[:, mine],
            self.reward[:, mine],
            self.ended[:, mine],
            self.won[:, mine],
        )

    def worth(self, gamma: float) -> FloatArray:
        """Return the discounted sum of rewards from each step to the episode's end, (t, n)."""
        worth, following = np.empty_like(self.reward), np.zeros(self.reward.shape[1])
        for step in range(len(worth) - 1, -1, -1):
            worth[step] = following = self.reward[step] + gamma * following * ~self.ended[step]
        return worth


def _show(
    env: VecNormalize,
    motions: Sequence[Motion],
    control_dt_s: float,
    length: int,
    noise_std: float,
    rng: np.random.Generator,
) -> _Shown:
    """Play motions with noise for some control steps, each motion in its share of the simulations."""
    which = np.arange(env.num_envs) % len(motions)
    played, time_s = Motions.of([motions[number] for number in which.tolist()]), np.zeros(env.num_envs)
    steps = []
    env.reset()
    for _ in range(length):
        seen, action = np.array(env.get_original_obs()), played.at(time_s)
        noisy = np.clip(action + rng.normal(0.0, noise_std, action.shape), -1.0, 1.0)
        _, reward, ended, infos = env.step(noisy.astype(np.float32))
        won = np.array([info.get("is_success", False) for info in infos])
        steps.append((seen, action, reward, ended, won))
        time_s = np.where(ended, 0.0, time_s + control_dt_s)
    return _Shown(which, *(np.array(part) for part in zip(*steps, strict=True)))


def _fit(
    model: PPO, seen: FloatArray, done: FloatArray, worth: FloatArray, noise_std: float, rng: np.random.Generator
) -> None:
    """Fit a policy's mean action and its value by least squares, and set its noise."""
    import torch

    policy = model.policy
    adam = torch.optim.Adam(policy.parameters(), lr=_LEARNING_RATE)
    policy.set_training_mode(True)
    for _ in range(_UPDATES):
        batch = tuple(rng.integers(size, size=_BATCH) for size in worth.shape)
        shown, goal, came = (torch.as_tensor(part[batch], dtype=torch.float32) for part in (seen, done, worth))
        mean, value = policy.get_distribution(shown).mode(), policy.predict_values(shown).flatten()
        loss = ((mean - goal) ** 2).mean() + 0.5 * ((value - came) ** 2).mean()
        adam.zero_grad()
        torch.autograd.backward(loss)
        adam.step()
    with torch.no_grad():
        policy.log_std.fill_(float(np.log(noise_std)))
