"""Targets of a task in its environment, and the mounts for a robot."""

from __future__ import annotations

from aidsr.tasks.goals.goal_task import GoalTask
from aidsr.tasks.goals.reading import AnyGoal
from aidsr.tasks.task import Task


def targets_of(task: Task) -> tuple[str, ...]:
    """Return the target bodies of a task.

    These are the bodies whose contacts with the robot the task measures, none for a free robot. For a goal they are its
    target sites and bodies.
    """
    if isinstance(task, GoalTask):
        return targets_of_goal(task.goal)
    touched = [sensor.target for sensor in task.sensors if sensor.quantity in ("contact_force", "contacts")]
    return tuple(dict.fromkeys(touched)) if task.base != "free" else ()


def targets_of_goal(goal: AnyGoal) -> tuple[str, ...]:
    """Return the names of the target sites and bodies of a goal."""
    return tuple(dict.fromkeys((*goal.points, *goal.bodies)))


def targets_and_mounts(task: Task) -> tuple[str, ...]:
    """Return what a picture must show before a robot is placed: the targets of a task and all mounts."""
    return (*targets_of(task), *(mount.name for mount in task.brief().summary.mounts))
