"""The benchmark: 14 tasks in four categories, and a door for tasks of others.

    from aidsr.tasks import load_task, task_names

    task = load_task("button_pushing")
    brief = task.brief()

A package adds its own tasks through the entry-point group "aidsr.tasks": the entry's name is the task's, its value the
`Task` subclass.
"""

from __future__ import annotations

import difflib
from importlib.metadata import entry_points
from typing import get_args

from aidsr.core.errors import UserError
from aidsr.tasks.goal import Goal, parse_goal, read_goal
from aidsr.tasks.goal_kinds import GoalTask
from aidsr.tasks.goal_task import goal_task
from aidsr.tasks.grasping.delicate_grasping import DelicateGrasping
from aidsr.tasks.grasping.dynamic_catching import DynamicCatching
from aidsr.tasks.grasping.simple_grasping import SimpleGrasping
from aidsr.tasks.grasping.zero_gravity_grasping import ZeroGravityGrasping
from aidsr.tasks.locomotion.flat_ground import FlatGround
from aidsr.tasks.locomotion.gap import Gap
from aidsr.tasks.locomotion.obstacles import Obstacles
from aidsr.tasks.locomotion.stairs import Stairs
from aidsr.tasks.locomotion.tunnel import Tunnel
from aidsr.tasks.manipulation.drawer_opening import DrawerOpening
from aidsr.tasks.manipulation.force_controlled_brushing import ForceControlledBrushing
from aidsr.tasks.reaching.button_pushing import ButtonPushing
from aidsr.tasks.reaching.pipe_inserting import PipeInserting
from aidsr.tasks.reaching.surface_adapting import SurfaceAdapting
from aidsr.tasks.reader import Reader
from aidsr.tasks.readings import Contacts, Outline, Readings
from aidsr.tasks.task import BENCHMARK_VERSION, Level, Split, Task
from aidsr.tasks.variation import Change, Variation, apply_to_batch, apply_to_simulation

__all__ = [
    "BENCHMARK_VERSION",
    "ENTRY_POINT_GROUP",
    "TASKS",
    "Change",
    "Contacts",
    "Goal",
    "GoalTask",
    "Level",
    "Outline",
    "Reader",
    "Readings",
    "Split",
    "Task",
    "Variation",
    "apply_to_batch",
    "apply_to_simulation",
    "goal_task",
    "load_task",
    "parse_goal",
    "read_goal",
    "task_names",
]

ENTRY_POINT_GROUP = "aidsr.tasks"

TASKS: dict[str, type[Task]] = {
    task.name: task
    for task in (
        ButtonPushing,
        SurfaceAdapting,
        PipeInserting,
        SimpleGrasping,
        ZeroGravityGrasping,
        DelicateGrasping,
        DynamicCatching,
        FlatGround,
        Stairs,
        Obstacles,
        Gap,
        Tunnel,
        DrawerOpening,
        ForceControlledBrushing,
    )
}
"""The benchmark's own tasks by "category/name", in the order of its tables."""


def task_names() -> tuple[str, ...]:
    """Return the names of all tasks, "category/name": the benchmark's in its order, then those of other packages."""
    others = (entry.name for entry in entry_points(group=ENTRY_POINT_GROUP))
    return (*TASKS, *sorted(name for name in set(others) if name not in TASKS))


def load_task(name: str, level: Level = "standard") -> Task:
    """Return a task.

    Args:
        name: "category/name", or the name alone where it is the only one of that name.
        level: "standard", the benchmark, or "hard", the same scene with harder numbers.

    Raises:
        UserError: There is no such task, or it has no such level.
    """
    names = task_names()
    found = [known for known in names if name in (known, known.rpartition("/")[2])]
    if len(found) != 1:
        raise UserError(_unknown(name, found, names))
    task = TASKS.get(found[0]) or _of_another_package(found[0])
    if level not in get_args(Level) or (level == "hard" and not task.hard):
        levels = "standard or hard" if task.hard else "standard only"
        raise UserError(f'Task "{found[0]}" comes at level {levels}; found "{level}".')
    return task.at(level)


def _unknown(name: str, found: list[str], names: tuple[str, ...]) -> str:
    """Return the sentence for a name that is nobody's or several tasks'."""
    if found:
        return f'"{name}" is the name of several tasks: {", ".join(found)}. Name one of them in full.'
    plain = {known.rpartition("/")[2]: known for known in names} | {known: known for known in names}
    near = difflib.get_close_matches(name, plain, n=1)
    hint = f' Did you mean "{plain[near[0]]}"?' if near else ""
    return f'There is no task "{name}".{hint} Tasks: {", ".join(names)}.'


def _of_another_package(name: str) -> type[Task]:
    """Load the task class behind an entry point."""
    (entry,) = entry_points(group=ENTRY_POINT_GROUP, name=name)
    task = entry.load()
    if not (isinstance(task, type) and issubclass(task, Task)):
        raise UserError(
            f'The entry point "{name}" in group "{ENTRY_POINT_GROUP}" must name a subclass of aidsr.tasks.Task; '
            f"found {entry.value}. Correct it in the package that declares it."
        )
    return task
