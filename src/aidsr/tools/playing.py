"""Playing of scripts and policies on a scene with recording of every control step, in an isolated process."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from aidsr.learn.openloop.film import Film, record_film
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tools.recording import Recording
from aidsr.tools.scene import MeasuredScene

if TYPE_CHECKING:
    from mujoco import MjModel

    from aidsr.learn.episodes.batch import Episodes
    from aidsr.learn.episodes.rollout import Policy
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.learn.openloop.script import Script
    from aidsr.tasks.readings import BoolArray
    from aidsr.tasks.variation import Variation

_LIMITS = Limits(wall_s=7200.0, cpu_s=4800.0)
"""Limits of playing scripts. Our choice: many times the duration of eight episodes of the largest built-in robot."""
_POLICY_LIMITS = Limits(wall_s=7200.0, cpu_s=4800.0, memory_mib=16_384)
"""Limits of playing a policy: as above, with the address space that torch maps."""


@isolated(limits=_LIMITS)
def play_variations(
    scene: MeasuredScene,
    script: str,
    *,
    variations: Sequence[int],
    seconds: float = 0.0,
    distances: Sequence[tuple[str, str]] = (),
) -> tuple[Recording, ...]:
    """Play a script from the start of one episode of each variation and return the recordings.

    Successful episodes are checked as `aidsr evaluate` does for the verdict "valid": scope, start and functional part
    of the robot; divergence, motion, energy, joint ranges and overlap of the episode; and whether it succeeds with
    slack cables, with a locked soft body, without other actuators, at half the time step, and with another integrator.
    Each test runs all these episodes as one batch.

    Args:
        scene: The scene.
        script: Motion script; see `aidsr.learn.openloop.script.GRAMMAR`.
        variations: Indices of the development variations.
        seconds: Duration [s], at most the task's time limit; 0 for the time limit.
        distances: Pairs of names of sites, geoms or bodies whose distance is measured at every control step.

    Raises:
        UserError: The script cannot be parsed or names an unknown group or feature, or the scene does not belong to its
            task.
        MjcfError: The scene cannot be loaded.
        IsolationError: Playing exceeded a limit.
    """
    from aidsr.learn.openloop.script import parse_script
    from aidsr.learn.openloop.script_policy import script_policy

    loaded, tracks = scene.load(), parse_script(script)
    played = [
        record(loaded, script_policy(loaded, tracks), variation=variation, seconds=seconds, distances=distances)
        for variation in variations
    ]
    won = [one.variation for one in played if one.succeeded]
    if not won:
        return tuple(played)
    found = dict(zip(won, _played_again(loaded, tracks, won), strict=True))
    return tuple(one.model_copy(update=found.get(one.variation, {})) for one in played)


@isolated(limits=_LIMITS)
def film_script(scene: MeasuredScene, script: str, *, variation: int = 0, seconds: float = 0.0) -> Film:
    """Play a script as `play_variations` does and return the episode, ready to be rendered.

    Raises:
        UserError: The script cannot be parsed or names an unknown group or feature, or the scene does not belong to its
            task.
        MjcfError: The scene cannot be loaded.
        IsolationError: Playing exceeded a limit.
    """
    from aidsr.learn.openloop.script_policy import script_policy

    loaded = scene.load()
    chosen = loaded.task.variation("development", variation)
    return record_film(loaded, _episodes(loaded, loaded.model, [chosen], seconds), script_policy(loaded, script))


@isolated(limits=_POLICY_LIMITS, prepare=("aidsr.learn.rl.trained",))
def play_policy(folder: Path, variation: int) -> Recording:
    """Play one development variation with a trained policy, without noise, and return the recording.

    Args:
        folder: Folder of the finished training.
        variation: Index of the variation.

    Raises:
        UserError: There is no finished training.
        IsolationError: Playing exceeded a limit.
    """
    from aidsr.learn.rl.policy import one_torch_thread
    from aidsr.learn.rl.trained import FinishedTraining

    trained = FinishedTraining.load(folder)
    with one_torch_thread():
        return record(trained.scene, trained.policy, variation=variation, smoothing=trained.config.recipe.smoothing)


def _episodes(
    scene: TaskScene, model: MjModel, variations: Sequence[Variation], seconds: float, smoothing: float = 0.0
) -> Episodes:
    """Return episodes of a model of the scene, limited to `seconds` unless 0."""
    from aidsr.learn.episodes.batch import Episodes

    episodes = Episodes(model, scene.task, scene.actions, variations, threads=1, smoothing=smoothing)
    if seconds:
        episodes.time_limit_s[:] = min(seconds, scene.task.time_limit_s)
    return episodes


def _played_again(scene: TaskScene, tracks: Script, won: Sequence[int]) -> list[dict[str, tuple[str, ...]]]:
    """Check a script's successes; return the fields `not_valid` and `fragile` of the recording of each variation."""
    import numpy as np

    from aidsr.core.formatting import format_check
    from aidsr.learn.episodes.policy_checks import Replays, episode_checks, rollout_with_stats, scene_checks
    from aidsr.learn.episodes.rollout import Constant
    from aidsr.learn.openloop.script_policy import script_policy
    from aidsr.sim.deactivate import other_actuators, with_locked_soft_body, without_cables, without_other_actuators
    from aidsr.sim.numerics import at_half_the_time_step, with_other_integrators
    from aidsr.sim.structure import read_structure

    structure = read_structure(scene.model)
    moving, uncorrected = scene.with_base(script_policy(scene, tracks)), Constant(np.zeros(scene.actions.size))
    rolled = rollout_with_stats(moving, uncorrected, won, threads=1, split="development")
    replays = Replays(moving, uncorrected, rolled.variations, threads=1)

    def wins(model: MjModel) -> BoolArray:
        return replays.play(model).success

    others = other_actuators(structure)
    found = [
        ("the same motion succeeds with every cable slack", wins(without_cables(scene.model, structure))),
        (
            "the same motion succeeds with the joints of the soft body locked",
            wins(with_locked_soft_body(scene.model, structure)),
        ),
    ]
    if others:
        alone = ~wins(without_other_actuators(scene.model, structure))
        found.append((f"it fails without the {len(others)} actuators of the robot that pull on no cable", alone))
    otherwise = np.zeros(len(won), dtype=bool)
    for other in with_other_integrators(scene.model).values():
        if not otherwise.all():
            otherwise |= wins(other)
    lost = [
        ("at half the time step", ~wins(at_half_the_time_step(scene.model))),
        ("with another integrator", ~otherwise),
    ]
    of_robot = scene_checks(scene)
    told = []
    for row, index in enumerate(won):
        checks = [*of_robot, *episode_checks(moving, rolled.alone(row), [index])]
        failed = [f"{check.message}: {format_check(check)}" for check in checks if not check.passed]
        not_valid = [*(clause for clause, holds in found if holds[row]), *failed]
        told.append({"not_valid": tuple(not_valid), "fragile": tuple(clause for clause, holds in lost if holds[row])})
    return told


def record(
    scene: TaskScene,
    policy: Policy,
    *,
    variation: int,
    seconds: float = 0.0,
    distances: Sequence[tuple[str, str]] = (),
    smoothing: float = 0.0,
) -> Recording:
    """Play one episode with a policy in this process and return the recording.

    Args:
        scene: The scene.
        policy: The policy.
        variation: Index of the development variation.
        seconds: Duration [s], at most the task's time limit; 0 for the time limit.
        distances: Pairs of names of sites, geoms or bodies whose distance is measured.
        smoothing: Share of the previous action in the next action, as in the training of the policy.
    """
    from aidsr.learn.episodes.rollout import rollout
    from aidsr.learn.openloop.script_policy import ScriptPolicy
    from aidsr.tools.commands import blocks_in_words, unnamed_in_words
    from aidsr.tools.recorder import Recorder

    chosen = scene.task.variation("development", variation)
    episodes = _episodes(scene, scene.model, [chosen], seconds, smoothing)
    recorder = Recorder(scene, chosen, episodes, distances)
    outcomes = rollout(episodes, policy, recorder.step)
    played = recorder.recording(outcomes, variation)
    if not isinstance(policy, ScriptPolicy):
        return played
    names = [group.name for group in scene.actions.groups]
    told = {
        "cut_off": policy.cut_off(names, played.duration_s),
        "commands": tuple(unnamed_in_words(scene, policy.unnamed)),
        "blocks": tuple(blocks_in_words(policy.starts)),
    }
    return played.model_copy(update=told)
