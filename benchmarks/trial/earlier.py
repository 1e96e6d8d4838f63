"""The earlier trial: one seed, one variation, 150,000 steps; any progress beyond the first stage passes.

Kept for comparison. It decides as at commit 51cdd36.
"""

from __future__ import annotations

from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.probe_scene import probe_scene

_MOTIONS, _STEPS = 64, 150_000


def try_as_before(scene: TaskScene) -> dict[str, object]:
    """Return the success and progress of the best motion, and whether the scene is sent back."""
    found = probe_scene(scene, candidates=_MOTIONS, variations=1, max_steps=_STEPS, threads=1)
    episode = found.best.episode
    success, progress = episode.ended == "succeeded", episode.best_progress
    starts = [start for start, _ in scene.task.stages]
    enough = starts[0] if scene.task.base == "free" else starts[min(1, len(starts) - 1)]
    return {
        "success": float(success),
        "progress": progress,
        "sent_back": not success and progress < enough,
        "phase": found.reached,
    }
