"""The folder in which a designer's robots, scenes and files are kept under names such as "robot_2" and "scene_1"."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from pydantic_core import from_json

from aidsr.core.artifacts import ActuatorGroup, Artifact, Base, Brief, Placement, Robot, Scene
from aidsr.core.errors import UserError
from aidsr.core.formatting import excerpt
from aidsr.tasks import Level, Task, load_task
from aidsr.tools.scene import MeasuredScene

MOUNTS: dict[Base, Literal["auto", "fixed", "free"]] = {
    "fixed": "fixed",
    "moving": "fixed",
    "free": "free",
    "any": "auto",
}
"""How a robot alone is held, by the base of its job."""
_NAME = re.compile(r"(robot|scene|file)_[1-9]\d{0,5}(\.\w+)?")


@contextmanager
def _undamaged(path: Path, again: str) -> Iterator[None]:
    """Say of a file that cannot be read how to get it again."""
    try:
        yield
    except (OSError, ValueError, TypeError):  # missing; no text, no JSON, no artifact
        raise UserError(f"{path} is missing or damaged; {again} again") from None


class SceneRecord(Artifact):
    """What belongs to a scene beside its MJCF."""

    robot: str
    """Name of the robot in the workspace."""
    task: str
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
    """A folder of robots, scenes and files; each is written once.

    Attributes:
        folder: Created with the first thing that is kept.
        job: What all of it is for; None where every scene names its task.
    """

    folder: Path
    job: Job | None = None
    _lock: threading.Lock = field(default_factory=threading.Lock, repr=False, compare=False)

    def add_robot(self, robot: Robot) -> str:
        """Keep a robot and return its name."""
        folder = self._new("robot")
        (folder / "robot.xml").write_text(robot.mjcf, encoding="utf-8")
        (folder / "robot.json").write_text(robot.model_dump_json(exclude={"mjcf"}, indent=2), encoding="utf-8")
        return folder.name

    def robot(self, name: str) -> Robot:
        """Return a robot by its name.

        Raises:
            UserError: There is no such robot, or a file of it is damaged.
        """
        mjcf, path = self.mjcf(name), self._find("robot", name) / "robot.json"
        with _undamaged(path, "validate the robot"):
            return Robot.model_validate({**from_json(path.read_bytes()), "mjcf": mjcf})

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
        if not name.startswith("scene"):
            if self.job is None:
                return MeasuredScene(mjcf=mjcf)
            brief = self.job.brief
            return MeasuredScene(mjcf=mjcf, environment=brief.environment, mount=MOUNTS[brief.base])
        record = self.record(name)
        return MeasuredScene(mjcf=mjcf, task=record.task, level=record.level, goal=record.goal, groups=record.groups)

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
        """Return the MJCF of a robot or a scene.

        Raises:
            UserError: There is none of this name, or its file is damaged.
        """
        kind = "scene" if name.startswith("scene") else "robot"
        path = self._find(kind, name) / f"{kind}.xml"
        with _undamaged(path, "assemble the scene" if kind == "scene" else "validate the robot"):
            return path.read_text(encoding="utf-8")

    def task_of(self, task: str, level: Level) -> tuple[str, Level, Task | None]:
        """Return name, level and task of the job, or of what is named in a workspace without one.

        Raises:
            UserError: No task is named, or another than the job's, or there is no such task.
        """
        if self.job is None:
            if not task:
                raise UserError("name a task; list_tasks has them")
            loaded = load_task(task, level)
            return loaded.name, level, loaded
        own = self.job.brief.task
        if task and task not in (own, own.rpartition("/")[2]):
            raise UserError(f'this work is for {own or "a job of its own"}, not for "{task}"; leave the task out')
        return own, self.job.level, load_task(own, self.job.level) if own else None

    def add_file(self, text: str, suffix: str) -> str:
        """Keep a text and return its name."""
        with self._lock:
            self.folder.mkdir(parents=True, exist_ok=True)
            number = 1 + sum(1 for _ in self.folder.glob("file_*"))
            path = self.folder / f"file_{number}.{suffix}"
            path.write_text(text, encoding="utf-8")
        return path.name

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
            number = 1
            while (folder := self.folder / f"{kind}_{number}").exists():
                number += 1
            folder.mkdir(parents=True)
        return folder

    def _find(self, kind: str, name: str) -> Path:
        folder = self.folder / name
        if not (_NAME.fullmatch(name) and name.startswith(kind) and folder.is_dir()):
            raise UserError(f'no {kind} "{excerpt(name)}"; {kind}s: {self._listed(kind)}')
        return folder

    def _listed(self, kind: str) -> str:
        names = (path.name for path in self.folder.glob(f"{kind}_*"))
        return ", ".join(sorted(names, key=lambda name: int(re.sub(r"\D", "", name)))) or "none yet"
