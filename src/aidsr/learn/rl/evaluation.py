"""Evaluation of a trained policy: held-out variations, no noise, and checks whether its behavior is plausible."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Evaluation, MeanAction, PlausibilityCheck
from aidsr.core.config import VERDICT_EPISODES
from aidsr.core.errors import UserError
from aidsr.core.provenance import commit, processor, versions_of
from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.episodes.episode_stats import RECORDED, EpisodeStats, StatsRecorder
from aidsr.learn.episodes.plausibility import (
    FEWEST_SUCCESSES,
    behavior_checks,
    exploit_check,
    height_check,
    necessity_check,
    nothing_to_check,
    part_check,
    penetration_check,
    scope_check,
    start_check,
    structure_check,
    training_check,
)
from aidsr.learn.episodes.rollout import Constant, EpisodeOutcomes, Policy, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.policy import TrainedPolicy
from aidsr.learn.rl.training import DEVELOPMENT
from aidsr.learn.rl.training_folder import TrainingResult
from aidsr.sim.deactivate import other_actuators, with_locked_soft_body, without_cables, without_other_actuators
from aidsr.sim.numerics import at_half_the_time_step, with_other_integrators
from aidsr.sim.structure import read_structure
from aidsr.tasks import BENCHMARK_VERSION, Split, Variation
from aidsr.tasks.locomotion.base import LaneTask
from aidsr.tasks.readings import FloatArray

LEAST_EPISODES = 20
"""Minimum number of episodes of an evaluation; enough for feedback to designers. At a share of one half the confidence
interval is 30 to 70 %."""

REPLAYED = 20
"""Maximum number of successful episodes, evenly spaced, that are replayed without cables, with a locked body and with a
constant action. They run to the time limit, so replaying a hundred would cost more than the evaluation itself. Our
choice."""


_PACKAGES = ("aidsr", "mujoco", "numpy", "torch", "stable-baselines3")


@dataclass(frozen=True)
class EvaluationRollout:
    """Episodes of an evaluation and their statistics."""

    variations: tuple[Variation, ...]
    outcomes: EpisodeOutcomes
    stats: EpisodeStats
    models: tuple[mujoco.MjModel, ...]
    """Model of the scene as varied for each episode."""
    mean_actions: FloatArray
    """Mean over the control steps of the action applied in each episode, (n, k), -1 to 1."""


@dataclass(frozen=True)
class EvaluationPoint:
    """Progress of the episodes of a running evaluation, which are played in parallel."""

    episodes: int
    ended: int
    succeeded: int
    simulated_s: float
    """Simulated time since the episodes began [s]."""
    time_limit_s: float
    """Simulated time at which the last episode ends [s]."""


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
    structure = read_structure(scene.model)
    checks = [
        structure_check(structure),
        scope_check(scene.model, structure),
        start_check(scene.model, structure, scene.task.base),
        part_check(scene.model, structure, scene.task.sensors),
    ]
    if isinstance(scene.task, LaneTask):
        checks.append(height_check(scene.model, structure))
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


def rollout_with_stats(
    scene: TaskScene,
    policy: Policy,
    indices: range,
    *,
    threads: int = 0,
    smoothing: float = 0.0,
    split: Split = "held_out",
    listen: Callable[[EvaluationPoint], None] = lambda _point: None,
) -> EvaluationRollout:
    """Play variations and record statistics; the other arguments are those of `evaluate`."""
    model = copy.copy(scene.model)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    variations = tuple(scene.task.variation(split, index) for index in indices)
    episodes = Episodes(
        model, scene.task, scene.actions, variations, threads=threads, smoothing=smoothing, record=RECORDED
    )
    recorder = StatsRecorder(episodes)
    succeeded, steps = 0, 0
    done, acted = np.zeros((episodes.n, episodes.actions.size)), np.zeros((episodes.n, 1))

    def watch(result: StepResult) -> None:
        nonlocal succeeded, steps
        done[episodes.stepped] += episodes.applied_action[episodes.stepped]
        acted[episodes.stepped] += 1.0
        recorder.update(result)
        succeeded, steps = succeeded + int(result.success.sum()), steps + 1
        ended = episodes.n - int(episodes.running.sum())
        task = scene.task
        listen(EvaluationPoint(episodes.n, ended, succeeded, steps * task.control_dt_s, task.time_limit_s))

    outcomes = rollout(episodes, policy, watch)
    models = tuple(episodes.batch.get_model(index) for index in range(episodes.n))
    return EvaluationRollout(variations, outcomes, recorder.stats(), models, done / acted)


@dataclass(frozen=True)
class Replays:
    """Plays the variations of an evaluation again, in models with changed values but the same elements."""

    scene: TaskScene
    policy: Policy
    variations: tuple[Variation, ...]
    threads: int = 0
    smoothing: float = 0.0

    def play(self, model: mujoco.MjModel, only: Sequence[int] | None = None) -> EpisodeOutcomes:
        """Return the outcomes of the episodes in a changed model.

        Args:
            model: The scene's model, changed.
            only: Rows of the variations to play; None for all. The other episodes are not run and do not succeed.
        """
        task, actions = self.scene.task, self.scene.actions
        episodes = Episodes(model, task, actions, self.variations, threads=self.threads, smoothing=self.smoothing)
        if only is not None:
            episodes.running &= np.isin(np.arange(episodes.n), only)
        return rollout(episodes, self.policy)

    def survival(self, name: str, how: str, model: mujoco.MjModel, won: int) -> PlausibilityCheck:
        """Check that successes survive a change.

        All variations are played, not only those that succeeded: a policy that barely succeeds in half of its episodes
        would succeed in only half of those again, with any physics.
        """
        return exploit_check(name, how, int(self.play(model).success.sum()) if won else 0, won)

    def necessity(self, name: str, how: str, model: mujoco.MjModel, won: Sequence[int]) -> PlausibilityCheck:
        """Check that successes vanish with a change."""
        enough = len(won) >= FEWEST_SUCCESSES
        return necessity_check(name, how, int(self.play(model, won).success.sum()) if enough else 0, len(won))


def motion_checks(
    scene: TaskScene,
    policy: Policy,
    rolled: EvaluationRollout,
    indices: Sequence[int],
    *,
    threads: int = 0,
    smoothing: float = 0.0,
) -> list[PlausibilityCheck]:
    """Return the checks of how a policy moves the robot: energy, joint ranges, overlap, and other numerics.

    Args:
        scene: Scene in which the policy acts.
        policy: The policy, without noise.
        rolled: Episodes that the policy played.
        indices: Indices of their variations.
        threads: Native threads; 0 takes all processors.
        smoothing: Smoothing of actions with which the policy was trained.
    """
    structure, dt_s = read_structure(scene.model), scene.task.control_dt_s
    return [
        *behavior_checks(rolled.outcomes, rolled.stats, structure),
        penetration_check(rolled.models, rolled.stats, structure, indices=indices, dt_s=dt_s),
        *_exploit_checks(scene, policy, rolled, threads, smoothing),
    ]


def _exploit_checks(
    scene: TaskScene, policy: Policy, rolled: EvaluationRollout, threads: int, smoothing: float
) -> list[PlausibilityCheck]:
    """Play the same variations again with half the time step and with another integrator.

    The second of the other integrators is used only if successes do not survive the first.
    """
    replays = Replays(scene, policy, rolled.variations, threads, smoothing)
    model, won = scene.model, int(rolled.outcomes.success.sum())
    found = [replays.survival("survives_half_time_step", "at half the time step", at_half_the_time_step(model), won)]
    tried: list[PlausibilityCheck] = []
    for name, other in with_other_integrators(model).items():
        tried.append(replays.survival("survives_other_integrator", f'with the integrator "{name}"', other, won))
        if tried[-1].passed:
            break
    last = tried[-1]
    messages = "; ".join(check.message for check in reversed(tried))
    return [*found, last.model_copy(update={"message": messages})]


def _mean_action(scene: TaskScene, rolled: EvaluationRollout, threads: int) -> MeanAction | None:
    """Replay successful episodes with the constant mean of the actions that succeeded in them."""
    won = np.flatnonzero(rolled.outcomes.success)
    if not won.size:
        return None
    action, some = rolled.mean_actions[won].mean(axis=0), _spread(won)
    replays = Replays(scene.with_base(None), Constant(action), rolled.variations, threads)
    succeeded = int(replays.play(scene.model, some).success.sum())
    return MeanAction(action=tuple(np.round(action, 3).tolist()), succeeded=succeeded, of=len(some))


def _spread(won: NDArray[np.intp]) -> list[int]:
    """Return at most `REPLAYED` of the successful episodes, evenly spaced."""
    found: list[int] = won[np.linspace(0, won.size - 1, min(won.size, REPLAYED)).astype(int)].tolist()
    return found


def body_checks(
    scene: TaskScene, policy: Policy, rolled: EvaluationRollout, *, threads: int = 0, smoothing: float = 0.0
) -> list[PlausibilityCheck]:
    """Replay without cables, with a locked soft body, and without other actuators, and return these checks.

    Args:
        scene: Scene in which the policy acts.
        policy: The policy, without noise.
        rolled: Episodes that the policy played.
        threads: Native threads; 0 takes all processors.
        smoothing: Smoothing of actions with which the policy was trained.
    """
    replays = Replays(scene, policy, rolled.variations, threads, smoothing)
    model, structure, won = scene.model, read_structure(scene.model), np.flatnonzero(rolled.outcomes.success)
    some = _spread(won)
    slack, locked = without_cables(model, structure), with_locked_soft_body(model, structure)
    name, others = "works_without_other_actuators", other_actuators(structure)
    if others:
        how = f"without the force of the {len(others)} actuators that pull on no cable"
        alone = replays.survival(name, how, without_other_actuators(model, structure), won.size)
    else:
        alone = nothing_to_check(name, "all actuators of the robot pull on cables")
    return [
        replays.necessity("needs_cables", "with every cable slack", slack, some),
        replays.necessity("needs_soft_body", "with the joints of the soft body locked", locked, some),
        alone,
    ]
