"""The episode in which a motion of a probe is played once more."""

from __future__ import annotations

from collections.abc import Sequence

from aidsr.core.artifacts import ActuatorGroup
from aidsr.core.errors import UserError
from aidsr.learn.episodes.actions import Grouping
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.motion import Motions, OpenLoopPolicy
from aidsr.learn.openloop.report import ProbedVariation
from aidsr.sandbox.limits import Limits
from aidsr.tasks import Level
from aidsr.tasks.travelling_task import TravellingTask

REPLAY_LIMITS = Limits(wall_s=300.0, cpu_s=180.0)
"""Limits of a child process that replays a motion. Our choice: many times what an episode of the largest built-in robot
takes."""

_GROUPINGS: tuple[Grouping, ...] = ("auto", "off")


def replay(
    scene: str,
    task: TravellingTask,
    probed: ProbedVariation,
    *,
    level: Level = "standard",
    groups: tuple[ActuatorGroup, ...] = (),
    record: Sequence[str] = (),
) -> tuple[TaskScene, Episodes, OpenLoopPolicy]:
    """Return the scene of a probe, the single episode of a variation, not yet played, and the policy of its motion.

    Args:
        scene: MJCF of the scene that was probed.
        task: Task on which it was probed.
        probed: Variation from the report of the probe; its motion tells how the actuators were grouped.
        level: Level of a task given by name.
        groups: Actuators that act together, as the robot's author declares.
        record: Fields that the episode records in every physics step.

    Raises:
        UserError: The scene is not one of the task, or the motion belongs to another robot.
        MjcfError: The scene cannot be loaded.
    """
    names = [group.group for group in probed.motion.groups]
    scenes = (TaskScene.of(scene, task, level=level, groups=groups, grouping=each) for each in _GROUPINGS)
    placed = next((each for each in scenes if [group.name for group in each.actions.groups] == names), None)
    if placed is None:
        raise UserError("the motions of this probe belong to another robot; probe the design again")
    variation = placed.task.variation("development", probed.episode.variation)
    episodes = Episodes(placed.model, placed.task, placed.actions, [variation], threads=1, record=record)
    return placed, episodes, OpenLoopPolicy(Motions.of([probed.motion]), placed.task.control_dt_s)
