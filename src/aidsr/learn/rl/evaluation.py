"""The verdict on a trained policy: held-out variations, no noise, and whether to believe what it does."""

from __future__ import annotations

import copy
from dataclasses import dataclass

import mujoco

from aidsr.core.artifacts import Evaluation, PlausibilityCheck
from aidsr.core.errors import UserError
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import EpisodeOutcomes, Policy, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.episode_stats import RECORDED, EpisodeStats, StatsRecorder
from aidsr.learn.rl.plausibility import (
    behavior_checks,
    exploit_check,
    penetration_check,
    structure_check,
    training_check,
)
from aidsr.learn.rl.training import DEVELOPMENT
from aidsr.learn.rl.training_folder import TrainingResult
from aidsr.tasks import BENCHMARK_VERSION, Split, Variation

LEAST_EPISODES = 20
"""Source: docs/tasks.md, evaluation of one design."""


@dataclass(frozen=True)
class EvaluationRollout:
    """Episodes of an evaluation, and their statistics."""

    variations: tuple[Variation, ...]
    outcomes: EpisodeOutcomes
    stats: EpisodeStats
    models: tuple[mujoco.MjModel, ...]
    """The scene as varied for each episode."""


def evaluate(
    scene: TaskScene,
    policy: Policy,
    *,
    episodes: int = LEAST_EPISODES,
    threads: int = 0,
    smoothing: float = 0.0,
    training: TrainingResult | None = None,
    split: Split = "held_out",
) -> tuple[Evaluation, EvaluationRollout]:
    """Judge a policy on variations it has never seen.

    Args:
        scene: What it acts in.
        policy: The policy, without noise.
        episodes: How many variations, at least 20.
        threads: Native threads; 0 takes all processors.
        smoothing: What the policy was trained with.
        training: How it was trained, for the check that the simulation held meanwhile.
        split: "held_out" for a score. "development" for a verdict that goes to designers, so that no design is made
            for the variations that score it; training samples none of these.

    Returns:
        The verdict, and the episodes behind it.
    """
    if episodes < LEAST_EPISODES:
        raise UserError(f"too few episodes: {episodes}; an evaluation needs at least {LEAST_EPISODES}")
    first = 0 if split == "held_out" else DEVELOPMENT
    indices = range(first, first + episodes)
    rolled = rollout_with_stats(scene, policy, indices, threads=threads, smoothing=smoothing, split=split)
    structure = Episodes(scene.model, scene.task, scene.actions, rolled.variations[:1], threads=1).structure
    checks = [structure_check(structure)]
    if training is not None:
        checks.append(training_check(training.episodes, training.diverged_episodes))
    checks += behavior_checks(rolled.outcomes, rolled.stats, structure)
    checks.append(penetration_check(rolled.models, rolled.stats, structure))
    checks += _exploit_checks(scene, policy, rolled, threads, smoothing)
    results = tuple(rolled.outcomes.result(row, index) for row, index in enumerate(indices))
    facts = {"task": scene.task.name, "level": scene.task.level, "benchmark_version": BENCHMARK_VERSION}
    versions = {"mujoco": mujoco.__version__}
    return Evaluation(episodes=results, checks=tuple(checks), versions=versions, split=split, **facts), rolled


def rollout_with_stats(
    scene: TaskScene,
    policy: Policy,
    indices: range,
    *,
    threads: int = 0,
    smoothing: float = 0.0,
    split: Split = "held_out",
) -> EvaluationRollout:
    """Play variations and record statistics."""
    model = copy.copy(scene.model)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    variations = tuple(scene.task.variation(split, index) for index in indices)
    episodes = Episodes(
        model, scene.task, scene.actions, variations, threads=threads, smoothing=smoothing, record=RECORDED
    )
    recorder = StatsRecorder(episodes)
    outcomes = rollout(episodes, policy, recorder.update)
    models = tuple(episodes.batch.get_model(index) for index in range(episodes.n))
    return EvaluationRollout(variations, outcomes, recorder.stats(), models)


def _exploit_checks(
    scene: TaskScene, policy: Policy, rolled: EvaluationRollout, threads: int, smoothing: float
) -> list[PlausibilityCheck]:
    """Play the same variations again with half the time step and with another integrator.

    All of them, and not only those that succeeded: of a policy that wins half of its episodes by the skin of its teeth,
    only half of those would be won again, in whatever physics.
    """
    won = int(rolled.outcomes.success.sum())
    finer, other = copy.copy(scene.model), copy.copy(scene.model)
    finer.opt.timestep /= 2
    discrete, fast = int(mujoco.mjtIntegrator.mjINT_DISCRETE), int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
    other.opt.integrator = discrete if scene.model.opt.integrator != discrete else fast
    checks = []
    for name, model, how in (
        ("survives_half_time_step", finer, "at half the time step"),
        ("survives_other_integrator", other, "with another integrator"),
    ):
        survived = 0
        if won:
            again = Episodes(model, scene.task, scene.actions, rolled.variations, threads=threads, smoothing=smoothing)
            survived = int(rollout(again, policy).success.sum())
        checks.append(exploit_check(name, how, survived, won))
    return checks
