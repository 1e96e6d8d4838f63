"""What of the environment a task is about, and where a robot for it stands."""

from __future__ import annotations

from aidsr.tasks.goals.goal_task import GoalTask
from aidsr.tasks.task import Task


def targets_of(task: Task) -> tuple[str, ...]:
    """Return the bodies of the environment that a task measures the robot's touch with; of a goal its site or body."""
    if isinstance(task, GoalTask):
        return tuple(dict.fromkeys((*task.goal.points, *task.goal.bodies)))
    touched = [sensor.target for sensor in task.sensors if sensor.quantity in ("contact_force", "contacts")]
    return tuple(dict.fromkeys(touched)) if task.base != "free" else ()


def targets_and_mounts(task: Task) -> tuple[str, ...]:
    """Return what of a task has to be in sight where no robot is placed yet: its targets and all mounts."""
    return (*targets_of(task), *(mount.name for mount in task.brief().summary.mounts))
