"""Play a script on a scene and record it step by step, in an isolated process."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tools.recording import Recording
from aidsr.tools.scene import MeasuredScene

if TYPE_CHECKING:
    from mujoco import MjModel

    from aidsr.learn.episodes.rollout import Policy
    from aidsr.learn.episodes.scene import TaskScene

_LIMITS = Limits(wall_s=900.0, cpu_s=600.0)
"""Our choice: many times what an episode of the largest built-in body takes."""


@isolated(limits=_LIMITS)
def play(
    scene: MeasuredScene,
    script: str,
    *,
    variation: int = 0,
    seconds: float = 0.0,
    distances: Sequence[tuple[str, str]] = (),
) -> Recording:
    """Play a script from the beginning of an episode and return what happened.

    One that succeeds is played again as `aidsr evaluate` does for the verdict "valid": with slack cables, with a locked
    soft body, and without the other actuators.

    Args:
        scene: The scene.
        script: See `aidsr.tools.script.GRAMMAR`.
        variation: Index of the development variation.
        seconds: How long to play; the task's time limit unless given.
        distances: Pairs of sites, or of geoms or bodies, whose distance is measured at every control step.

    Raises:
        UserError: The script cannot be read or names what is not there, or the scene is not one of its task.
        MjcfError: The scene cannot be loaded.
        IsolationError: Playing ran past its limits.
    """
    from aidsr.tools.script import parse_script

    loaded, tracks = scene.load(), parse_script(script)
    names = [group.name for group in loaded.actions.groups]

    def motion() -> Policy:
        return tracks.played_by(names, loaded.actions.rest, loaded.task.control_dt_s)

    played = record(loaded, motion(), variation=variation, seconds=seconds, distances=distances)
    return (
        played.model_copy(update={"not_valid": _not_valid(loaded, motion, variation)}) if played.succeeded else played
    )


def _not_valid(scene: TaskScene, motion: Callable[[], Policy], variation: int) -> tuple[str, ...]:
    """Return in clauses why a motion that succeeds is not the work of cables and soft body; empty where it is."""
    from aidsr.learn.episodes.batch import Episodes
    from aidsr.learn.episodes.rollout import rollout
    from aidsr.sim.deactivate import other_actuators, with_locked_soft_body, without_cables, without_other_actuators
    from aidsr.sim.structure import read_structure

    chosen, structure = scene.task.variation("development", variation), read_structure(scene.model)

    def wins(model: MjModel) -> bool:
        return bool(rollout(Episodes(model, scene.task, scene.actions, [chosen], threads=1), motion()).success[0])

    clauses = []
    if wins(without_cables(scene.model, structure)):
        clauses.append("the same motion succeeds with every cable slack")
    if wins(with_locked_soft_body(scene.model, structure)):
        clauses.append("the same motion succeeds with the joints of the soft body locked")
    others = other_actuators(structure)
    if others and not wins(without_other_actuators(scene.model, structure)):
        clauses.append(f"it fails without the {len(others)} actuators of the robot that pull on no cable")
    return tuple(clauses)


def record(
    scene: TaskScene,
    policy: Policy,
    *,
    variation: int,
    seconds: float = 0.0,
    distances: Sequence[tuple[str, str]] = (),
) -> Recording:
    """Let a policy play one episode and return what happened; see `play`."""
    from aidsr.learn.episodes.batch import Episodes
    from aidsr.learn.episodes.rollout import rollout
    from aidsr.tools.recorder import Recorder
    from aidsr.tools.script import ScriptPolicy

    chosen = scene.task.variation("development", variation)
    episodes = Episodes(scene.model, scene.task, scene.actions, [chosen], threads=1)
    if seconds:
        episodes.time_limit_s[:] = min(seconds, scene.task.time_limit_s)
    recorder = Recorder(scene, chosen, episodes, distances)
    outcomes = rollout(episodes, policy, recorder.step)
    played = recorder.recording(outcomes, variation)
    if not isinstance(policy, ScriptPolicy):
        return played
    names = [group.name for group in scene.actions.groups]
    return played.model_copy(update={"cut_off": policy.cut_off(names, played.duration_s)})
