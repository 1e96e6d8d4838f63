"""The benchmark: 18 tasks in four categories, and tasks of other packages.

    from aidsr.tasks import load_task, task_names

    task = load_task("button_pushing")
    brief = task.brief()

A package adds its own tasks through the entry-point group "aidsr.tasks": the entry's name is the name of the task, its
value is the `Task` subclass.
"""

from __future__ import annotations

from typing import get_args

from aidsr.core.arguments import check_type
from aidsr.core.errors import UserError
from aidsr.core.plugins import PluginGroup
from aidsr.core.suggestions import closest_name
from aidsr.tasks.goals import Goal, GoalTask, goal_task, parse_goal, read_goal
from aidsr.tasks.grasping.ball_from_bowl import BallFromBowl
from aidsr.tasks.grasping.delicate_grasping import DelicateGrasping
from aidsr.tasks.grasping.dynamic_catching import DynamicCatching
from aidsr.tasks.grasping.simple_grasping import SimpleGrasping
from aidsr.tasks.grasping.zero_gravity_grasping import ZeroGravityGrasping
from aidsr.tasks.locomotion.flat_ground import FlatGround
from aidsr.tasks.locomotion.gap import Gap
from aidsr.tasks.locomotion.incline import Incline
from aidsr.tasks.locomotion.obstacles import Obstacles
from aidsr.tasks.locomotion.stairs import Stairs
from aidsr.tasks.locomotion.tunnel import Tunnel
from aidsr.tasks.manipulation.crank_turning import CrankTurning
from aidsr.tasks.manipulation.drawer_opening import DrawerOpening
from aidsr.tasks.manipulation.force_controlled_brushing import ForceControlledBrushing
from aidsr.tasks.reaching.around_corners import AroundCorners
from aidsr.tasks.reaching.button_pushing import ButtonPushing
from aidsr.tasks.reaching.pipe_inserting import PipeInserting
from aidsr.tasks.reaching.surface_adapting import SurfaceAdapting
from aidsr.tasks.readings import Contacts, Outline, Reader, Readings
from aidsr.tasks.task import BENCHMARK_VERSION, Criteria, Feature, Level, Split, Task, find_fault
from aidsr.tasks.variation import Change, Variation, apply_to_batch, apply_to_simulation

__all__ = [
    "BENCHMARK_VERSION",
    "PLUGINS",
    "RULES_FROZEN_AT",
    "TASKS",
    "TASKS_IN_SAMPLE",
    "TASKS_OUT_OF_SAMPLE",
    "Change",
    "Contacts",
    "Criteria",
    "Feature",
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
    "is_current",
    "load_task",
    "parse_goal",
    "read_goal",
    "task_names",
]

_KNOWN: tuple[type[Task], ...] = (
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
_NEW: tuple[type[Task], ...] = (AroundCorners, BallFromBowl, Incline, CrankTurning)

TASKS: dict[str, type[Task]] = {task.name: task for task in (*_KNOWN, *_NEW)}
"""The benchmark's own tasks by "category/name", in the order of its tables."""

TASKS_IN_SAMPLE: tuple[str, ...] = tuple(task.name for task in _KNOWN)
"""Tasks that were known when the built-in rules were written."""

TASKS_OUT_OF_SAMPLE: tuple[str, ...] = tuple(task.name for task in _NEW)
"""Tasks that were added after the built-in rules were frozen at `RULES_FROZEN_AT`. Their objectives share no content
word with the words by which the rules recognize a kind of job."""

RULES_FROZEN_AT = "6f28d50"
"""Commit at which the built-in rules were frozen, before any out-of-sample task existed."""

PLUGINS = PluginGroup[type[Task]](
    group="aidsr.tasks", noun="task", kind=Task, is_subclass=True, builtin=lambda: TASKS.keys(), find_fault=find_fault
)


def task_names() -> tuple[str, ...]:
    """Return the names of all tasks, "category/name": the benchmark's in its order, then those of other packages."""
    others = (entry.name for entry in PLUGINS.entries())
    return (*TASKS, *sorted(name for name in set(others) if name not in TASKS))


def load_task(name: str, level: Level = "standard") -> Task:
    """Return a task.

    Args:
        name: "category/name", or the name alone if no other task has it.
        level: "standard", the benchmark, or "hard", the same scene with harder numbers.

    Raises:
        TypeError: The name is not a string.
        UserError: There is no such task, it cannot be loaded, or it has no such level.
    """
    check_type(name, str, "task must be the name of a task")
    names = task_names()
    found = [known for known in names if name in (known, known.rpartition("/")[2])]
    if len(found) != 1:
        raise UserError(_unknown(name, found, names))
    task = TASKS.get(found[0]) or next(
        PLUGINS.load(entry).value for entry in PLUGINS.entries() if entry.name == found[0]
    )
    levels = get_args(Level) if task.hard else ("standard",)
    if level not in levels:
        raise UserError(f'task "{found[0]}" has no level "{level}"; levels: {", ".join(levels)}')
    return task.at(level)


def is_current(name: str, version: int) -> bool:
    """Return whether a result of a task from a version of the benchmark is still valid: the task has not changed since.

    Args:
        name: Name of the task as for `load_task`.
        version: `BENCHMARK_VERSION` of the result.

    Raises:
        UserError: There is no such task.
    """
    return load_task(name).unchanged_since <= version <= BENCHMARK_VERSION


def _unknown(name: str, found: list[str], names: tuple[str, ...]) -> str:
    """Return the error message for an unknown or ambiguous name."""
    if found:
        return f'"{name}" is ambiguous: {", ".join(found)}; use the full name'
    plain = {known.rpartition("/")[2]: known for known in names} | {known: known for known in names}
    near = closest_name(name, plain)
    hint = f' did you mean "{plain[near]}"?' if near else ""
    return f'unknown task "{name}";{hint} tasks: {", ".join(names)}'
