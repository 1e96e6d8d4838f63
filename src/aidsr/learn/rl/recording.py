"""Recording of one held-out episode of a trained policy, played again: positions, cables, contacts, progress."""

from __future__ import annotations

from pathlib import Path

from aidsr.core.errors import UserError
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits

_LIMITS = Limits(wall_s=300.0, cpu_s=180.0, memory_mib=16384)
"""Limits of the child process. Our choice: ten times what the longest episode of a task takes; torch maps about 6 GiB
without using them."""


@isolated(limits=_LIMITS)
def record_episode(training: Path, variation: int) -> bytes:
    """Play one held-out variation with the policy of a training; see `aidsr.learn.episodes.recording.record_rollout`.

    The episode may differ from the same one among the hundred of an evaluation, because a single observation changes
    the order in which the network's sums are computed; `ended` describes this episode.

    Args:
        training: Folder of a finished training.
        variation: Index of a held-out variation, from 0.

    Raises:
        UserError: There is no such training, or an earlier version made it, with other observations.
        IsolationError: The episode takes too long.
    """
    from aidsr.learn.episodes.batch import Episodes
    from aidsr.learn.episodes.recording import STATE, record_rollout
    from aidsr.learn.rl.policy import one_torch_thread
    from aidsr.learn.rl.trained import FinishedTraining

    finished = FinishedTraining.load(training)
    scene, varied = finished.scene, finished.scene.task.variation("held_out", variation)
    smoothing = finished.config.recipe.smoothing
    episodes = Episodes(scene.model, scene.task, scene.actions, [varied], threads=1, smoothing=smoothing, record=STATE)
    if finished.policy.normalisation.mean.shape != episodes.observation.shape[1:]:
        raise UserError(f"the policy in {training} was trained with other observations; train it again")
    with one_torch_thread():
        return record_rollout(episodes, finished.policy, scene.mjcf, variation)
