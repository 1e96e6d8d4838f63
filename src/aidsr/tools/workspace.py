"""Folder that stores robots, scenes, own tasks and files under names such as "robot_2" and "scene_1"."""

from __future__ import annotations

import re
import shutil
import threading
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Literal

from pydantic_core import from_json, to_json

from aidsr.core.arguments import check_type
from aidsr.core.artifacts import MOUNTS, ActuatorGroup, Artifact, Brief, Placement, Robot, Scene
from aidsr.core.errors import UserError
from aidsr.core.formatting import excerpt
from aidsr.runs.folders import DesignFolder
from aidsr.runs.status import newest
from aidsr.tasks import Level, Task, goal_task, load_task, read_goal
from aidsr.tools.scene import MeasuredScene
from aidsr.validation.validator import Mount

_MJCF = {
    "robot": ("robot.xml", "validate the robot"),
    "scene": ("scene.xml", "assemble the scene"),
    "task": ("environment.xml", "make the task"),
}
"""MJCF file of each kind of entry, and advice on how to make the entry again."""
_NAME = re.compile(r"(robot|scene|task|file)_(?P<number>[1-9]\d{0,5})(\.\w+)?")


def is_own(task: str) -> bool:
    """Whether a task's name is that of an own task of a workspace ("task_1"), not of a benchmark task."""
    return task.startswith("task_")


@contextmanager
def _undamaged(path: Path, again: str) -> Iterator[None]:
    """Turn errors in reading a file into a UserError that says how to make the file again.

    Raises:
        UserError: The file is missing or damaged.
    """
    try:
        yield
    except (OSError, ValueError, TypeError):  # missing, or not valid text, JSON or artifact
        raise UserError(f"{path} is missing or damaged; {again} again") from None


class TaskRecord(Artifact):
    """Data of an own task in addition to its environment and goal."""

    objective: str


class RobotTest(Artifact):
    """Settings of the test of a robot alone, stored in the robot's JSON file."""

    task: str = ""
    """Task whose physics is used; empty for none, or for that of the job."""
    mount: Mount = "auto"
    realizable: bool = False
    """Whether parts that cannot be built are errors."""

    def mount_for(self, brief: Brief | None) -> Mount:
        """Return how the root is held: as stated, else as in the job, else "auto", which is as in the MJCF."""
        return MOUNTS[brief.base] if self.mount == "auto" and brief else self.mount


_AS_THE_JOB_SAYS = RobotTest()


class SceneRecord(Artifact):
    """Data of a scene in addition to its MJCF and placement."""

    robot: str
    """Name of the robot in the workspace."""
    task: str
    """Name of a benchmark task or of an own task of the workspace."""
    level: Level = "standard"
    goal: Path | None = None
    groups: tuple[ActuatorGroup, ...] = ()
    stable: bool = False
    """Whether the validator found it stable."""
    stand: bool = True
    """Whether a free robot was raised or lowered until it stands; so is a changed robot in its place."""


@dataclass(frozen=True)
class Job:
    """The job of a workspace that is for one job only."""

    brief: Brief
    level: Level = "standard"
    goal: Path | None = None
    """File of the goal, if success is measured by a goal."""


@dataclass(frozen=True)
class Workspace:
    """A folder of robots, scenes, own tasks and files, each of which is written once.

    Attributes:
        folder: The folder; created with the first entry.
        job: Job of all entries; None where every scene has its own task.
        draws: Whether results include pictures of the best motion of a probe and of the environment of an own task.
    """

    folder: Path
    job: Job | None = None
    draws: bool = True
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False, compare=False)

    def add_robot(self, robot: Robot, test: RobotTest = _AS_THE_JOB_SAYS) -> str:
        """Store a robot, with the settings of its test, and return its name."""
        folder = self._new("robot")
        (folder / "robot.xml").write_text(robot.mjcf, encoding="utf-8")
        record = robot.model_dump(mode="json", exclude={"mjcf"}) | test.model_dump(mode="json", exclude_defaults=True)
        (folder / "robot.json").write_bytes(to_json(record, indent=2))
        return folder.name

    def robot(self, name: str) -> Robot:
        """Return a robot by its name.

        Raises:
            UserError: There is no such robot, or a file of it is damaged.
        """
        return self._robot(name)[0]

    def test_of_robot(self, name: str) -> RobotTest:
        """Return the settings of the test of a robot.

        Raises:
            UserError: There is no such robot, or a file of it is damaged.
        """
        return self._robot(name)[1]

    def _robot(self, name: str) -> tuple[Robot, RobotTest]:
        mjcf, path = self.mjcf(name), self._find("robot", name) / "robot.json"
        with _undamaged(path, "validate the robot"):
            record = dict(from_json(path.read_bytes()))
            test = RobotTest.model_validate({key: record.pop(key) for key in RobotTest.model_fields if key in record})
            return Robot.model_validate({**record, "mjcf": mjcf}), test

    def add_task(self, objective: str, environment: str, goal: str) -> str:
        """Store a task made of an environment (MJCF) and a goal (TOML), both as text, and return its name."""
        folder = self._new("task")
        (folder / "environment.xml").write_text(environment, encoding="utf-8")
        (folder / "goal.toml").write_text(goal, encoding="utf-8")
        (folder / "task.json").write_text(TaskRecord(objective=objective).model_dump_json(indent=2), encoding="utf-8")
        return folder.name

    def own_tasks(self) -> list[str]:
        """Return the names of the own tasks, in the order of their numbers."""
        return self._names("task")

    def objective(self, name: str) -> str:
        """Return the objective of an own task, in the user's words.

        Raises:
            UserError: There is no such task, or its file is damaged.
        """
        path = self._find("task", name) / "task.json"
        with _undamaged(path, "make the task"):
            return TaskRecord.model_validate_json(path.read_bytes()).objective

    def brief(self, task: str = "") -> Brief | None:
        """Return the brief of the job, or of a task in a workspace without a job; None where there is neither.

        Raises:
            UserError: There is no such task, or it is not that of the job.
        """
        if self.job is not None:
            self._refuse_other(self.job, task)
            return self.job.brief
        if not task:
            return None
        brief = self._loaded(task, "standard").brief()
        return brief.model_copy(update={"objective": self.objective(task)}) if is_own(task) else brief

    def add_scene(self, robot: str, scene: Scene, task: str, level: Level, *, stable: bool, stand: bool) -> str:
        """Store a scene of a robot and return its name."""
        folder = self._new("scene")
        goal = self.job.goal if self.job else None
        groups = self.robot(robot).actuator_groups
        record = SceneRecord(robot=robot, task=task, level=level, goal=goal, groups=groups, stable=stable, stand=stand)
        (folder / "scene.xml").write_text(scene.mjcf, encoding="utf-8")
        (folder / "placement.json").write_text(scene.placement.model_dump_json(indent=2), encoding="utf-8")
        (folder / "scene.json").write_text(record.model_dump_json(indent=2), encoding="utf-8")
        return folder.name

    def add_design(self, design: str | Path | DesignFolder) -> str:
        """Store the robot and the scene of an approved design with its task or goal, and return the scene's name.

            work = Workspace(Path("work"))
            scene = work.add_design(run.design(1))
            print(TOOLS["play"].call(work, {"scene": scene, "script": "*: t=0 -1, t=2 1"}).text)

        Args:
            design: A design of a run, or its folder.

        Raises:
            TypeError: `design` has another type.
            UserError: It is not an approved design of a run, or one of its files is damaged.
        """
        check_type(design, (str, Path, DesignFolder), "design must be a design or its folder")
        found = design if isinstance(design, DesignFolder) else DesignFolder(Path(design))
        if not found.final_scene.path.exists():
            raise UserError(
                f"{found.path} is not an approved design: final.xml not found; give one, as runs/…/designs/1"
            )
        run = found.run
        record, until = run.asked(), found.leading_to()
        found.require_whole()
        robot = newest(each.robot.read() for each in until)
        scene = newest(each.scene.read() for each in until)
        report = newest(each.scene_report.read() for each in until)
        if robot is None or scene is None:
            raise UserError(f"{found.path} has no robot or no scene in its iterations; restore it, or design again")
        task = record.task
        if (goal := run.goal.read()) is not None:
            task = self.add_task(record.objective, run.brief().environment, goal.decode())
        name = self.add_robot(robot, RobotTest(task=task))
        stable = bool(report and report.stable)
        return self.add_scene(name, scene, task, record.level or "standard", stable=stable, stand=False)

    def subject(self, name: str) -> MeasuredScene:
        """Return a scene with its task or goal, or a robot alone, as the subject of a measurement.

        Raises:
            UserError: There is no robot or scene of this name.
        """
        mjcf = self.mjcf(name)
        if is_own(name):
            raise UserError(f"{name} is a task, without a robot; assemble one into it")
        if not name.startswith("scene"):
            test = self.test_of_robot(name)
            brief = self.brief(test.task)
            environment = brief.environment if brief else ""
            return MeasuredScene(mjcf=mjcf, environment=environment, mount=test.mount_for(brief))
        record = self.record(name)
        task, goal = record.task, self.job.goal if self.job else record.goal  # a run may have been moved
        if is_own(task):
            task, goal = "", self._goal(task)
        return MeasuredScene(mjcf=mjcf, task=task, level=record.level, goal=goal, groups=record.groups)

    def record(self, name: str) -> SceneRecord:
        """Return the record of a scene.

        Raises:
            UserError: There is no such scene, or its file is damaged.
        """
        path = self._find("scene", name) / "scene.json"
        with _undamaged(path, "assemble the scene"):
            return SceneRecord.model_validate_json(path.read_bytes())

    def placement(self, name: str) -> Placement:
        """Return the placement of the robot of a scene.

        Raises:
            UserError: There is no such scene, or its file is damaged.
        """
        path = self._find("scene", name) / "placement.json"
        with _undamaged(path, "assemble the scene"):
            return Placement.model_validate_json(path.read_bytes())

    def mjcf(self, name: str) -> str:
        """Return the MJCF of a robot, a scene, or the environment of an own task.

        Raises:
            UserError: There is no entry of this name, or its file is damaged.
        """
        kind = name.partition("_")[0]
        if kind not in _MJCF:
            known = "; ".join(f"{each}s: {self._listed(each)}" for each in ("robot", "scene"))
            raise UserError(f'no robot or scene "{excerpt(name)}"; {known}')
        file, again = _MJCF[kind]
        path = self._find(kind, name) / file
        with _undamaged(path, again):
            return path.read_text(encoding="utf-8")

    def task_of(self, task: str, level: Level) -> tuple[str, Level, Task | None]:
        """Return name, level and task of the job, or of the named task in a workspace without a job.

        The task is None for a job without a task.

        Raises:
            UserError: There is no such task, no task is named in a workspace without a job, or it is not the job's.
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
        """Return a benchmark task or an own task.

        Raises:
            UserError: There is no such task, its file is damaged, or a level is given for an own task.
        """
        if not is_own(task):
            return load_task(task, level)
        if level != "standard":
            raise UserError(f"levels are those of benchmark tasks; leave the level out for {task}")
        return goal_task(read_goal(self._goal(task)), self.mjcf(task))

    def _goal(self, name: str) -> Path:
        return self._find("task", name) / "goal.toml"

    def add_file(self, text: str, suffix: str) -> str:
        """Store a text as a file and return its name."""
        with self._lock:
            self.folder.mkdir(parents=True, exist_ok=True)
            while True:
                name = f"file_{1 + max(map(_number, self._names('file')), default=0)}.{suffix}"
                with suppress(FileExistsError), (self.folder / name).open("x", encoding="utf-8") as file:
                    file.write(text)
                    return name

    def skip(self, kind: Literal["robot", "scene"]) -> str:
        """Reserve the next name of a kind for an entry that could not be made, and return the name."""
        with self._lock:
            path = self._next(kind)
            self.folder.mkdir(parents=True, exist_ok=True)
            path.touch()
        return path.name

    def remove_except(self, kept: Collection[str]) -> None:
        """Remove all robots and scenes, and all names reserved for them, except those of the given names."""
        for path in (*self.folder.glob("robot_*"), *self.folder.glob("scene_*")):
            if path.name not in kept:
                shutil.rmtree(path) if path.is_dir() else path.unlink()

    def is_skipped(self, name: str) -> bool:
        """Whether a name was reserved for an entry that could not be made."""
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
        names = (path.name for path in self.folder.glob(f"{kind}_*") if _NAME.fullmatch(path.name))
        return sorted((name for name in names if not self.is_skipped(name)), key=_number)


def _number(name: str) -> int:
    """Return the number in the name of an entry or a file."""
    match = _NAME.fullmatch(name)
    assert match is not None, "only such names are given"
    return int(match["number"])
