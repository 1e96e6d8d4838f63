"""The checks of a verdict: played episodes with their statistics, and the same episodes played again otherwise.

They need no trained policy: the script of a designer and the motion of a probe are checked in the same way.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import PlausibilityCheck
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
)
from aidsr.learn.episodes.rollout import EpisodeOutcomes, Policy, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.deactivate import other_actuators, with_locked_soft_body, without_cables, without_other_actuators
from aidsr.sim.numerics import at_half_the_time_step, with_other_integrators
from aidsr.sim.structure import read_structure
from aidsr.tasks import Split, Variation
from aidsr.tasks.locomotion.base import LaneTask
from aidsr.tasks.readings import FloatArray

REPLAYED = 20
"""Maximum number of successful episodes, evenly spaced, that are replayed without cables, with a locked body and with a
constant action. They run to the time limit, so replaying a hundred would cost more than the evaluation itself. Our
choice."""


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

    def alone(self, row: int) -> EvaluationRollout:
        """Return one of the episodes alone."""
        one = slice(row, row + 1)
        outcomes = {each.name: getattr(self.outcomes, each.name)[one] for each in fields(self.outcomes)}
        stats = {each.name: getattr(self.stats, each.name)[one] for each in fields(self.stats)}
        return EvaluationRollout(
            variations=self.variations[one],
            outcomes=EpisodeOutcomes(**outcomes),
            stats=EpisodeStats(**stats),
            models=self.models[one],
            mean_actions=self.mean_actions[one],
        )


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


def rollout_with_stats(
    scene: TaskScene,
    policy: Policy,
    indices: Sequence[int],
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
    return [
        *episode_checks(scene, rolled, indices),
        *_exploit_checks(scene, policy, rolled, threads, smoothing),
    ]


def episode_checks(scene: TaskScene, rolled: EvaluationRollout, indices: Sequence[int]) -> list[PlausibilityCheck]:
    """Return the checks of what was played: divergence, motion, energy, joint ranges and overlap."""
    structure, dt_s = read_structure(scene.model), scene.task.control_dt_s
    return [
        *behavior_checks(rolled.outcomes, rolled.stats, structure),
        penetration_check(rolled.models, rolled.stats, structure, indices=indices, dt_s=dt_s),
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


def scene_checks(scene: TaskScene) -> list[PlausibilityCheck]:
    """Return the checks of the robot in its scene, whatever it does."""
    structure = read_structure(scene.model)
    checks = [
        structure_check(structure),
        scope_check(scene.model, structure),
        start_check(scene.model, structure, scene.task.base),
        part_check(scene.model, structure, scene.task.sensors),
    ]
    if isinstance(scene.task, LaneTask):
        checks.append(height_check(scene.model, structure))
    return checks


def spread(won: NDArray[np.intp]) -> list[int]:
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
    some = spread(won)
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
