"""Evaluation of a trained policy: held-out variations, no noise, and checks whether its behavior is plausible."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aidsr.core.artifacts import Evaluation, MeanAction
from aidsr.core.config import LEAST_EPISODES, VERDICT_EPISODES
from aidsr.core.errors import UserError
from aidsr.core.provenance import commit, processor, versions_of
from aidsr.learn.episodes.plausibility import training_check
from aidsr.learn.episodes.policy_checks import (
    EvaluationPoint,
    EvaluationRollout,
    Replays,
    body_checks,
    motion_checks,
    rollout_with_stats,
    scene_checks,
    spread,
)
from aidsr.learn.episodes.rollout import Constant, Policy
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.policy import TrainedPolicy
from aidsr.learn.rl.training import DEVELOPMENT
from aidsr.learn.rl.training_folder import TrainingResult
from aidsr.tasks import BENCHMARK_VERSION, Split

_PACKAGES = ("aidsr", "mujoco", "numpy", "torch", "stable-baselines3")


def evaluate(
    scene: TaskScene,
    policy: Policy,
    *,
    episodes: int = VERDICT_EPISODES,
    threads: int = 0,
    smoothing: float = 0.0,
    training: TrainingResult | None = None,
    split: Split = "held_out",
    listen: Callable[[EvaluationPoint], None] = lambda _point: None,
) -> tuple[Evaluation, EvaluationRollout]:
    """Evaluate a policy on variations that it has never seen.

    Args:
        scene: Scene in which the policy acts.
        policy: The policy, without noise.
        episodes: Number of variations, at least 20; a verdict has 100.
        threads: Native threads; 0 takes all processors.
        smoothing: Smoothing of actions with which the policy was trained.
        training: Result of its training, for the check that the simulation was stable during training.
        split: "held_out" for a score. "development" for a verdict that designers read, so that no design is made for
            the variations that score it; these development variations are never sampled in training.
        listen: Called after every control step of the episodes; the checks that follow take about as long again.

    Returns:
        The verdict, and the episodes behind it.
    """
    if episodes < LEAST_EPISODES:
        raise UserError(f"too few episodes: {episodes}; an evaluation needs at least {LEAST_EPISODES}")
    first = 0 if split == "held_out" else DEVELOPMENT
    indices = range(first, first + episodes)
    rolled = rollout_with_stats(
        scene, policy, indices, threads=threads, smoothing=smoothing, split=split, listen=listen
    )
    checks = scene_checks(scene)
    if training is not None:
        checks.append(training_check(training.episodes, training.diverged_episodes))
    checks += motion_checks(scene, policy, rolled, indices, threads=threads, smoothing=smoothing)
    checks += body_checks(scene, policy, rolled, threads=threads, smoothing=smoothing)
    results = tuple(rolled.outcomes.result(row, index) for row, index in enumerate(indices))
    evaluation = Evaluation(
        task=scene.task.name,
        level=scene.task.level,
        benchmark_version=BENCHMARK_VERSION,
        episodes=results,
        checks=tuple(checks),
        hold_s=scene.task.hold_s,
        split=split,
        mean_action=_mean_action(scene, rolled, threads),
        versions=versions_of(_PACKAGES),
        commit=commit(),
        processor=processor(),
        scene_sha256=scene.fingerprint,
        policy_sha256=policy.fingerprint if isinstance(policy, TrainedPolicy) else "",
    )
    return evaluation, rolled


def _mean_action(scene: TaskScene, rolled: EvaluationRollout, threads: int) -> MeanAction | None:
    """Replay successful episodes with the constant mean of the actions that succeeded in them."""
    won = np.flatnonzero(rolled.outcomes.success)
    if not won.size:
        return None
    action, some = rolled.mean_actions[won].mean(axis=0), spread(won)
    replays = Replays(scene.with_base(None), Constant(action), rolled.variations, threads)
    succeeded = int(replays.play(scene.model, some).success.sum())
    return MeanAction(action=tuple(np.round(action, 3).tolist()), succeeded=succeeded, of=len(some))
