"""What `aidsr train` and `aidsr probe` are given: a scene or a design, and what measures success there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from aidsr.core.artifacts import ActuatorGroup
from aidsr.core.errors import UserError

if TYPE_CHECKING:
    from aidsr.learn.episodes.actions import Grouping
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.runs import Run
    from aidsr.tasks import Task


Levels = Literal["standard", "hard"]


@dataclass(frozen=True)
class Subject:
    """A scene, and what its run knows about it."""

    scene: Path
    task: str | Task
    level: Levels
    groups: tuple[ActuatorGroup, ...]
    home: Path
    """Where a folder training/ belongs."""

    def to_learn_in(self, grouping: Grouping) -> TaskScene:
        """Return the scene for its task.

        Raises:
            UserError: It is not one of this task.
            MjcfError: It cannot be loaded.
        """
        from aidsr.learn.episodes.scene import TaskScene

        return TaskScene.of(self.scene, self.task, level=self.level, groups=self.groups, grouping=grouping)


def subject_of(path: Path, task: str | None, level: Levels | None, goal: Path | None = None) -> Subject:
    """Return what a path stands for: the MJCF of a scene, or a design's folder with a final scene in it.

    Args:
        path: The file or the folder.
        task: Task named by the person; a design knows its own.
        level: Level of the task.
        goal: File of a goal, instead of a task; a run may hold one.

    Raises:
        UserError: There is no scene, or nobody says what it is to do.
    """
    from aidsr.runs import Run
    from aidsr.runs.folders import DesignFolder
    from aidsr.runs.status import newest

    if task and goal:
        raise UserError("a task measures success and so does a goal; give either --task or --goal")
    if not path.is_dir():
        if not (task or goal):
            raise UserError(
                f"what should be done in {path}? Name a task with --task (aidsr tasks lists them), or give a goal with "
                "--goal"
            )
        return Subject(path, _asked(path, task, level, goal), level or "standard", (), Path())
    design = DesignFolder(path)
    scene = design.final_scene.path
    if not scene.exists():
        raise UserError(
            f"a design with a final.xml was expected, and {path} has none; give the folder of an approved design, as "
            "runs/…/designs/1, or the file of a scene"
        )
    run = Run(path.parent.parent)
    known_task, known_level = _known(run)
    if not (task or goal or known_task):
        goal = run.goal.path
        if not goal.exists():
            raise UserError(
                f"{path} was designed for an objective in words, which has no measure of success; say one with --goal "
                "goal.toml (docs/environments.md), or name a task it can be trained on with --task"
            )
    robot = newest(it.robot.read() for it in design.leading_to())
    groups = robot.actuator_groups if robot else ()
    asked = _asked(scene, task or known_task, level, goal)
    return Subject(scene, asked, level or known_level or "standard", groups, path)


def _known(run: Run) -> tuple[str, Literal["", "standard", "hard"]]:
    """Return the task and the level a run was asked for; empty where it was not."""
    record = run.record.read()
    return (record.task, record.level) if record and record.task else ("", "")


def _asked(scene: Path, task: str | None, level: Levels | None, goal: Path | None) -> str | Task:
    """Return the name of a task, or the task that a goal makes of the scene.

    Raises:
        UserError: There is no such goal, or a level is asked of it.
    """
    if goal is None:
        return task or ""
    if level:
        raise UserError(f"only tasks come at levels, and success is measured by the goal {goal}; leave --level out")
    from aidsr.learn.episodes.scene import read_mjcf_text
    from aidsr.tasks import goal_task, read_goal

    return goal_task(read_goal(goal), read_mjcf_text(scene))
