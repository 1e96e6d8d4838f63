"""Recording of the best motion of a probe in one variation, played once more."""

from __future__ import annotations

from aidsr.core.artifacts import ActuatorGroup
from aidsr.core.errors import UserError
from aidsr.learn.openloop.report import ProbedVariation
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tasks import Level
from aidsr.tasks.travelling_task import TravellingTask

_LIMITS = Limits(wall_s=300.0, cpu_s=180.0)
"""Limits of the child process. Our choice: many times what an episode of the largest built-in robot takes."""


def run_record_motion(
    scene: str,
    task: TravellingTask,
    probed: ProbedVariation,
    *,
    level: Level = "standard",
    groups: tuple[ActuatorGroup, ...] = (),
) -> bytes:
    """Play and record the motion of a variation in this process; see `aidsr.learn.episodes.recording.record_rollout`.

    Args:
        scene: MJCF of the scene that was probed.
        task: Task on which it was probed.
        probed: Variation from the report of the probe.
        level: Level of a task given by name.
        groups: Actuators that act together, as the robot's author declares.

    Raises:
        UserError: The scene is not one of the task, or the motion belongs to another robot.
        MjcfError: The scene cannot be loaded.
    """
    from aidsr.learn.episodes.batch import Episodes
    from aidsr.learn.episodes.recording import STATE, record_rollout
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.learn.openloop.motion import Motions, OpenLoopPolicy

    names = [group.group for group in probed.motion.groups]
    groupings = (TaskScene.of(scene, task, level=level, groups=groups, grouping=each) for each in ("auto", "off"))
    placed = next((each for each in groupings if [group.name for group in each.actions.groups] == names), None)
    if placed is None:
        raise UserError("the motions of this probe belong to another robot; probe the design again")
    varied = placed.task.variation("development", probed.episode.variation)
    episodes = Episodes(placed.model, placed.task, placed.actions, [varied], threads=1, record=STATE)
    policy = OpenLoopPolicy(Motions.of([probed.motion]), placed.task.control_dt_s)
    return record_rollout(episodes, policy, placed.mjcf, probed.episode.variation)


record_motion = isolated(limits=_LIMITS)(run_record_motion)
"""`run_record_motion` in a child process with limits; raises IsolationError when they are exceeded."""
