"""Try a scene on its task by open-loop motions, in an isolated process, and attribute its failure to a role."""

from __future__ import annotations

from pathlib import Path

from aidsr.core.artifacts import Robot, Scene, TaskReport
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tasks import Level

CANDIDATES = 64
MAX_STEPS = 150_000
"""Motions tried, and physics steps for them. Our choice: half of what `aidsr probe` takes, for one variation instead of
two: enough to separate a body that cannot from one that might."""
_LIMITS = Limits(wall_s=1800.0, cpu_s=600.0)
"""Our choice: ten times what the largest built-in body takes, and room for a busy machine."""


@isolated(limits=_LIMITS)
def try_task(
    robot: Robot,
    scene: Scene,
    *,
    task: str = "",
    level: Level = "standard",
    goal: Path | None = None,
    candidates: int = CANDIDATES,
) -> TaskReport:
    """Return the phase of a task in which a scene fails, and the role that can change that.

    Args:
        robot: The robot in the scene.
        scene: What the Judge passed.
        task: Name of the task.
        level: Its level.
        goal: File of a goal, instead of a task.
        candidates: Number of motions to try.

    Raises:
        UserError: There is no such task, or the scene is not one of it.
        MjcfError: The scene cannot be loaded.
        IsolationError: The trial exceeded its limits.
    """
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.learn.openloop.failure_attribution import attribute_failure, targets_of
    from aidsr.learn.openloop.probe_scene import probe_scene
    from aidsr.learn.openloop.trace import trace_motion
    from aidsr.tasks import goal_task, load_task, read_goal

    goal_or_task = goal_task(read_goal(goal), scene.mjcf) if goal else load_task(task, level)
    placed = TaskScene.of(scene.mjcf, goal_or_task, groups=robot.actuator_groups)
    found = probe_scene(placed, candidates=candidates, variations=1, max_steps=MAX_STEPS, threads=1)
    best = found.best
    variation = goal_or_task.variation("development", best.episode.variation)
    traced = trace_motion(placed, variation, best.motion, targets_of(goal_or_task))
    return attribute_failure(goal_or_task, traced, found.motions)
