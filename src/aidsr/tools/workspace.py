"""The folder in which robots, scenes, own tasks and files are kept under names such as "robot_2" and "scene_1"."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Literal

from pydantic_core import from_json, to_json

from aidsr.core.artifacts import ActuatorGroup, Artifact, Base, Brief, Placement, Robot, Scene
from aidsr.core.errors import UserError
from aidsr.core.formatting import excerpt
from aidsr.tasks import Level, Task, goal_task, load_task, read_goal
from aidsr.tools.scene import MeasuredScene

MOUNTS: dict[Base, Literal["auto", "fixed", "free"]] = {
    "fixed": "fixed",
    "moving": "fixed",
    "free": "free",
    "any": "auto",
}
"""How a robot alone is held, by the base of its job."""
_MJCF = {
    "robot": ("robot.xml", "validate the robot"),
    "scene": ("scene.xml", "assemble the scene"),
    "task": ("environment.xml", "make the task"),
}
"""Where the MJCF of each kind of thing is, and what makes it again."""
_TASK = "task"
"""In the file of a robot: the task that it is meant for."""
_NAME = re.compile(r"(robot|scene|task|file)_[1-9]\d{0,5}(\.\w+)?")


def is_own(task: str) -> bool:
    """Whether a task is one of a workspace, "task_1", and none of the benchmark."""
    return task.startswith("task_")


@contextmanager
def _undamaged(path: Path, again: str) -> Iterator[None]:
    """Say of a file that cannot be read how to get it again."""
    try:
        yield
    except (OSError, ValueError, TypeError):  # missing; no text, no JSON, no artifact
        raise UserError(f"{path} is missing or damaged; {again} again") from None


class TaskRecord(Artifact):
    """What belongs to an own task beside its environment and its goal."""

    objective: str


class SceneRecord(Artifact):
    """What belongs to a scene beside its MJCF."""

    robot: str
    """Name of the robot in the workspace."""
    task: str
    """Of the benchmark, or an own one of the workspace."""
    level: Level = "standard"
    goal: Path | None = None
    groups: tuple[ActuatorGroup, ...] = ()
    stable: bool = False
    """Whether the validator found it so."""


@dataclass(frozen=True)
class Job:
    """What a designer works on, where a workspace is for one job."""

    brief: Brief
    level: Level = "standard"
    goal: Path | None = None
    """File of the goal, where success is measured by one."""


@dataclass(frozen=True)
class Workspace:
    """A folder of robots, scenes, own tasks and files; each is written once.

    Attributes:
        folder: Created with the first thing that is kept.
        job: What all of it is for; None where every scene names its task.
        draws: Whether a probe also draws its best motion, and an own task its environment.
    """

    folder: Path
    job: Job | None = None
    draws: bool = True
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False, compare=False)

    def add_robot(self, robot: Robot, task: str = "") -> str:
        """Keep a robot, with the task under whose physics it is tested, and return its name."""
        folder = self._new("robot")
        (folder / "robot.xml").write_text(robot.mjcf, encoding="utf-8")
        record = robot.model_dump(mode="json", exclude={"mjcf"}) | ({_TASK: task} if task else {})
        (folder / "robot.json").write_bytes(to_json(record, indent=2))
        return folder.name

    def robot(self, name: str) -> Robot:
        """Return a robot by its name.

        Raises:
            UserError: There is no such robot, or a file of it is damaged.
        """
        mjcf, path = self.mjcf(name), self._find("robot", name) / "robot.json"
        with _undamaged(path, "validate the robot"):
            record = dict(from_json(path.read_bytes()))
            record.pop(_TASK, None)
            return Robot.model_validate({**record, "mjcf": mjcf})

    def task_of_robot(self, name: str) -> str:
        """Return the task under whose physics a robot is tested, "" where there is none.

        Raises:
            UserError: There is no such robot, or a file of it is damaged.
        """
        path = self._find("robot", name) / "robot.json"
        with _undamaged(path, "validate the robot"):
            return str(dict(from_json(path.read_bytes())).get(_TASK, ""))

    def add_task(self, objective: str, environment: str, goal: str) -> str:
        """Keep a task of an environment and a goal, both as text, and return its name."""
        folder = self._new("task")
        (folder / "environment.xml").write_text(environment, encoding="utf-8")
        (folder / "goal.toml").write_text(goal, encoding="utf-8")
        (folder / "task.json").write_text(TaskRecord(objective=objective).model_dump_json(indent=2), encoding="utf-8")
        return folder.name

    def own_tasks(self) -> list[str]:
        """Return the names of the own tasks, in order."""
        return self._names("task")

    def objective(self, name: str) -> str:
        """Return what an own task is for, in its user's words.

        Raises:
            UserError: There is no such task, or its file is damaged.
        """
        path = self._find("task", name) / "task.json"
        with _undamaged(path, "make the task"):
            return TaskRecord.model_validate_json(path.read_bytes()).objective

    def brief(self, task: str = "") -> Brief | None:
        """Return the job, or that of a task in a workspace without one; None where there is neither.

        Raises:
            UserError: There is no such task.
        """
        if self.job is not None:
            self._refuse_other(self.job, task)
            return self.job.brief
        if not task:
            return None
        brief = self._loaded(task, "standard").brief()
        return brief.model_copy(update={"objective": self.objective(task)}) if is_own(task) else brief

    def add_scene(self, robot: str, scene: Scene, task: str, level: Level, *, stable: bool) -> str:
        """Keep a scene of a robot and return its name."""
        folder = self._new("scene")
        goal = self.job.goal if self.job else None
        groups = self.robot(robot).actuator_groups
        record = SceneRecord(robot=robot, task=task, level=level, goal=goal, groups=groups, stable=stable)
        (folder / "scene.xml").write_text(scene.mjcf, encoding="utf-8")
        (folder / "placement.json").write_text(scene.placement.model_dump_json(indent=2), encoding="utf-8")
        (folder / "scene.json").write_text(record.model_dump_json(indent=2), encoding="utf-8")
        return folder.name

    def subject(self, name: str) -> MeasuredScene:
        """Return a scene with what measures success in it, or a robot alone.

        Raises:
            UserError: There is none of this name.
        """
        mjcf = self.mjcf(name)
        if is_own(name):
            raise UserError(f"{name} is a task, without a robot; assemble one into it")
        if not name.startswith("scene"):
            brief = self.brief(self.task_of_robot(name))
            if brief is None:
                return MeasuredScene(mjcf=mjcf)
            return MeasuredScene(mjcf=mjcf, environment=brief.environment, mount=MOUNTS[brief.base])
        record = self.record(name)
        task, goal = (record.task, record.goal) if not is_own(record.task) else ("", self._goal(record.task))
        return MeasuredScene(mjcf=mjcf, task=task, level=record.level, goal=goal, groups=record.groups)

    def record(self, name: str) -> SceneRecord:
        """Return what belongs to a scene beside its MJCF.

        Raises:
            UserError: There is no such scene, or its file is damaged.
        """
        path = self._find("scene", name) / "scene.json"
        with _undamaged(path, "assemble the scene"):
            return SceneRecord.model_validate_json(path.read_bytes())

    def placement(self, name: str) -> Placement:
        """Return how the robot of a scene is placed.

        Raises:
            UserError: There is no such scene, or its file is damaged.
        """
        path = self._find("scene", name) / "placement.json"
        with _undamaged(path, "assemble the scene"):
            return Placement.model_validate_json(path.read_bytes())

    def mjcf(self, name: str) -> str:
        """Return the MJCF of a robot, a scene, or the environment of an own task.

        Raises:
            UserError: There is none of this name, or its file is damaged.
        """
        kind = name.partition("_")[0]
        kind = kind if kind in _MJCF else "robot"
        file, again = _MJCF[kind]
        path = self._find(kind, name) / file
        with _undamaged(path, again):
            return path.read_text(encoding="utf-8")

    def task_of(self, task: str, level: Level) -> tuple[str, Level, Task | None]:
        """Return name, level and task of the job, or of what is named in a workspace without one.

        Raises:
            UserError: No task is named, or another than the job's, or there is no such task.
        """
        if self.job is None:
            if not task:
                raise UserError("name a task; list_tasks has them")
            loaded = self._loaded(task, level)
            return task if is_own(task) else loaded.name, level, loaded
        own = self.job.brief.task
        self._refuse_other(self.job, task)
        return own, self.job.level, load_task(own, self.job.level) if own else None

    def folder_of(self, scene: str) -> Path:
        """Return the folder of a scene.

        Raises:
            UserError: There is no such scene.
        """
        return self._find("scene", scene)

    def _refuse_other(self, job: Job, task: str) -> None:
        own = job.brief.task
        if task and task not in (own, own.rpartition("/")[2]):
            raise UserError(f'this work is for {own or "a job of its own"}, not for "{task}"; leave the task out')

    def _loaded(self, task: str, level: Level) -> Task:
        """Return a task of the benchmark, or an own one.

        Raises:
            UserError: There is none, its file is damaged, or an own one is asked for at a level.
        """
        if not is_own(task):
            return load_task(task, level)
        if level != "standard":
            raise UserError(f"levels are those of benchmark tasks; leave the level out for {task}")
        return goal_task(read_goal(self._goal(task)), self.mjcf(task))

    def _goal(self, name: str) -> Path:
        return self._find("task", name) / "goal.toml"

    def add_file(self, text: str, suffix: str) -> str:
        """Keep a text and return its name."""
        with self._lock:
            self.folder.mkdir(parents=True, exist_ok=True)
            number = 1 + sum(1 for _ in self.folder.glob("file_*"))
            path = self.folder / f"file_{number}.{suffix}"
            path.write_text(text, encoding="utf-8")
        return path.name

    def skip(self, kind: Literal["robot", "scene"]) -> str:
        """Use up the next name of a kind for one that could not be made, and return the name."""
        with self._lock:
            path = self._next(kind)
            self.folder.mkdir(parents=True, exist_ok=True)
            path.touch()
        return path.name

    def is_skipped(self, name: str) -> bool:
        """Whether a name was used up for what could not be made."""
        return bool(re.fullmatch(r"(robot|scene)_\d{1,6}", name)) and (self.folder / name).is_file()

    def file(self, name: str) -> str:
        """Return the text of a file.

        Raises:
            UserError: There is no such file.
        """
        path = self.folder / name
        if not (_NAME.fullmatch(name) and path.is_file()):
            raise UserError(f'no file "{excerpt(name)}"; files: {self._listed("file")}')
        with _undamaged(path, "measure"):
            return path.read_text(encoding="utf-8")

    def _new(self, kind: str) -> Path:
        with self._lock:
            folder = self._next(kind)
            folder.mkdir(parents=True)
        return folder

    def _next(self, kind: str) -> Path:
        return next(path for number in count(1) if not (path := self.folder / f"{kind}_{number}").exists())

    def _find(self, kind: str, name: str) -> Path:
        folder = self.folder / name
        if not (_NAME.fullmatch(name) and name.startswith(kind) and folder.is_dir()):
            raise UserError(f'no {kind} "{excerpt(name)}"; {kind}s: {self._listed(kind)}')
        return folder

    def _listed(self, kind: str) -> str:
        return ", ".join(self._names(kind)) or "none yet"

    def _names(self, kind: str) -> list[str]:
        names = (path.name for path in self.folder.glob(f"{kind}_*") if not self.is_skipped(path.name))
        return sorted(names, key=lambda name: int(re.sub(r"\D", "", name)))
