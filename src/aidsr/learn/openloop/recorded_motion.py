"""Recording of the best motion of a probe in one variation, played once more."""

from __future__ import annotations

from aidsr.core.artifacts import ActuatorGroup
from aidsr.learn.episodes.recording import STATE, record_rollout
from aidsr.learn.openloop.replay import REPLAY_LIMITS, replay
from aidsr.learn.openloop.report import ProbedVariation
from aidsr.sandbox.isolated import isolated
from aidsr.tasks import Level
from aidsr.tasks.travelling_task import TravellingTask


def run_record_motion(
    scene: str,
    task: TravellingTask,
    probed: ProbedVariation,
    *,
    level: Level = "standard",
    groups: tuple[ActuatorGroup, ...] = (),
) -> bytes:
    """Play and record the motion of a variation in this process; see `aidsr.learn.episodes.recording.record_rollout`.

    The arguments and errors are those of `replay`.
    """
    placed, episodes, policy = replay(scene, task, probed, level=level, groups=groups, record=STATE)
    return record_rollout(episodes, policy, placed.mjcf, probed.episode.variation)


record_motion = isolated(limits=REPLAY_LIMITS)(run_record_motion)
"""`run_record_motion` in a child process with limits; raises IsolationError when they are exceeded."""
