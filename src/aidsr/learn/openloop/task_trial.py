"""A judged scene is tried on its task in an isolated process, and where it stops is told."""

from __future__ import annotations

from pathlib import Path

from aidsr.core.artifacts import Robot, Scene, TaskReport
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tasks import Level

CANDIDATES = 64
MAX_STEPS = 150_000
"""Motions tried, and physics steps for them. Our choice: half of what `aidsr probe` takes, for one variation instead of
two: enough to tell a body that cannot from one that might."""
_LIMITS = Limits(wall_s=1800.0, cpu_s=600.0)
"""Our choice: ten times what the largest built-in body takes, and room for a busy machine."""


@isolated(limits=_LIMITS)
def try_out(
    robot: Robot,
    scene: Scene,
    *,
    task: str = "",
    level: Level = "standard",
    goal: Path | None = None,
    candidates: int = CANDIDATES,
) -> TaskReport:
    """Say in which phase of a task a scene stops, and whose work that is.

    Args:
        robot: The robot in the scene.
        scene: What the Judge passed.
        task: Name of the task.
        level: Its level.
        goal: File of a goal, instead of a task.
        candidates: Motions to try.

    Raises:
        UserError: There is no such task, or the scene is not one of it.
        MjcfError: The scene cannot be loaded.
        IsolationError: Trying ran past its limits.
    """
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.learn.openloop.failure_attribution import judge_trace, targets_of
    from aidsr.learn.openloop.probe_scene import probe
    from aidsr.learn.openloop.trace import trace
    from aidsr.tasks import goal_task, load_task, read_goal

    about = goal_task(read_goal(goal), scene.mjcf) if goal else load_task(task, level)
    groups = robot.actuator_groups
    found = probe(scene.mjcf, about, groups=groups, candidates=candidates, variations=1, max_steps=MAX_STEPS, threads=1)
    best = found.best
    watched = trace(
        TaskScene.of(scene.mjcf, about, groups=groups),
        about.variation("development", best.episode.variation),
        best.motion,
        targets_of(about),
    )
    return judge_trace(about, watched, found.motions)
