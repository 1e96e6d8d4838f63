"""A judged scene is tried on its task in an isolated process, and where it stops is told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from aidsr.core.artifacts import Robot, Scene, TaskReport
from aidsr.sandbox import isolation
from aidsr.tasks import Level

__all__ = ["try_out", "try_out_in_worker"]

CANDIDATES = 64
MAX_STEPS = 150_000
"""Motions tried, and physics steps for them. Our choice: half of what `aidsr probe` takes, for one variation instead of
two: enough to tell a body that cannot from one that might."""
_LIMITS = isolation.Limits(wall_s=1800.0, cpu_s=600.0)
"""Our choice: ten times what the largest built-in body takes, and room for a busy machine."""


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
    argument = {
        "mjcf": scene.mjcf,
        "groups": [group.model_dump(mode="json") for group in robot.actuator_groups],
        "task": task,
        "level": level,
        "goal": str(goal.resolve()) if goal else "",
        "candidates": candidates,
    }
    return TaskReport.model_validate(
        isolation.call("aidsr.learn.openloop.task_trial:try_out_in_worker", argument, _LIMITS)
    )


def try_out_in_worker(argument: dict[str, Any]) -> dict[str, Any]:
    """Do the work of `try_out` on plain values."""
    from aidsr.core.artifacts import ActuatorGroup
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.learn.openloop.failure_attribution import judge_trace, targets_of
    from aidsr.learn.openloop.probe_scene import probe
    from aidsr.learn.openloop.trace import trace
    from aidsr.tasks import goal_task, load_task, read_goal

    mjcf = argument["mjcf"]
    task = (
        goal_task(read_goal(argument["goal"]), mjcf)
        if argument["goal"]
        else load_task(argument["task"], argument["level"])
    )
    groups = tuple(ActuatorGroup.model_validate(group) for group in argument["groups"])
    tried = argument["candidates"]
    found = probe(mjcf, task, groups=groups, candidates=tried, variations=1, max_steps=MAX_STEPS, threads=1)
    best = found.best
    watched = trace(
        TaskScene.of(mjcf, task, groups=groups),
        task.variation("development", best.episode.variation),
        best.motion,
        targets_of(task),
    )
    return judge_trace(task, watched, found.motions).model_dump(mode="json")
