"""Play a script on a scene and record it step by step, in an isolated process."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tools.recording import Recording
from aidsr.tools.scene import MeasuredScene

if TYPE_CHECKING:
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

    loaded = scene.load()
    names = [group.name for group in loaded.actions.groups]
    policy = parse_script(script).played_by(names, loaded.actions.rest, loaded.task.control_dt_s)
    return record(loaded, policy, variation=variation, seconds=seconds, distances=distances)


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
