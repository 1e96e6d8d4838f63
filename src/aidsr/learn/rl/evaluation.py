"""The verdict on a trained policy: held-out variations, no noise, and whether to believe what it does."""

from __future__ import annotations

import copy
from dataclasses import dataclass

import mujoco

from aidsr.core.artifacts import Evaluation, PlausibilityCheck
from aidsr.core.errors import UserError
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.playing import Actor, Course, play
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.episode_stats import RECORDED, Evidence, Witness
from aidsr.learn.rl.plausibility import (
    behaviour_checks,
    exploit_check,
    penetration_check,
    structure_check,
    training_check,
)
from aidsr.learn.rl.training import DEVELOPMENT
from aidsr.learn.rl.training_folder import TrainingResult
from aidsr.tasks import BENCHMARK_VERSION, Split, Variation

__all__ = ["LEAST_EPISODES", "Watched", "evaluate", "watch"]

LEAST_EPISODES = 20
"""Source: docs/tasks.md, evaluation of one design."""


@dataclass(frozen=True)
class Watched:
    """Episodes as they were played."""

    variations: tuple[Variation, ...]
    course: Course
    evidence: Evidence
    models: tuple[mujoco.MjModel, ...]
    """The scene as varied for each episode."""


def evaluate(
    scene: TaskScene,
    actor: Actor,
    *,
    episodes: int = LEAST_EPISODES,
    threads: int = 0,
    smoothing: float = 0.0,
    training: TrainingResult | None = None,
    split: Split = "held_out",
) -> tuple[Evaluation, Watched]:
    """Judge a policy on variations it has never seen.

    Args:
        scene: What it acts in.
        actor: The policy, without noise.
        episodes: How many variations, at least 20.
        threads: Native threads; 0 takes all processors.
        smoothing: What the policy was trained with.
        training: How it was trained, for the check that the simulation held meanwhile.
        split: "held_out" for a score. "development" for a verdict that designers are told, so that no design is made
            for the variations that score it; training draws none of these.

    Returns:
        The verdict, and the episodes behind it.
    """
    if episodes < LEAST_EPISODES:
        raise UserError(f"an evaluation needs at least {LEAST_EPISODES} episodes to mean something, found {episodes}")
    first = 0 if split == "held_out" else DEVELOPMENT
    indices = range(first, first + episodes)
    watched = watch(scene, actor, indices, threads=threads, smoothing=smoothing, split=split)
    structure = Episodes(scene.model, scene.task, scene.actions, watched.variations[:1], threads=1).structure
    checks = [structure_check(structure)]
    if training is not None:
        checks.append(training_check(training.episodes, training.diverged_episodes))
    checks += behaviour_checks(watched.course, watched.evidence, structure)
    checks.append(penetration_check(watched.models, watched.evidence, structure))
    checks += _exploit_checks(scene, actor, watched, threads, smoothing)
    results = tuple(watched.course.result(row, index) for row, index in enumerate(indices))
    facts = {"task": scene.task.name, "level": scene.task.level, "benchmark_version": BENCHMARK_VERSION}
    versions = {"mujoco": mujoco.__version__}
    return Evaluation(episodes=results, checks=tuple(checks), versions=versions, split=split, **facts), watched


def watch(
    scene: TaskScene,
    actor: Actor,
    indices: range,
    *,
    threads: int = 0,
    smoothing: float = 0.0,
    split: Split = "held_out",
) -> Watched:
    """Play variations and look closely."""
    model = copy.copy(scene.model)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    variations = tuple(scene.task.variation(split, index) for index in indices)
    episodes = Episodes(
        model, scene.task, scene.actions, variations, threads=threads, smoothing=smoothing, record=RECORDED
    )
    witness = Witness(episodes)
    course = play(episodes, actor, witness.look)
    models = tuple(episodes.batch.get_model(index) for index in range(episodes.n))
    return Watched(variations, course, witness.evidence(), models)


def _exploit_checks(
    scene: TaskScene, actor: Actor, watched: Watched, threads: int, smoothing: float
) -> list[PlausibilityCheck]:
    """Play the same variations again with half the time step and with another integrator.

    All of them, and not only those that succeeded: of a policy that wins half of its episodes by the skin of its teeth,
    only half of those would be won again, in whatever physics.
    """
    won = int(watched.course.succeeded.sum())
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
            again = Episodes(model, scene.task, scene.actions, watched.variations, threads=threads, smoothing=smoothing)
            survived = int(play(again, actor).succeeded.sum())
        checks.append(exploit_check(name, how, survived, won))
    return checks
