"""The scenes an agent has assembled: numbered folders, which `aidsr train`, `probe` and `view` take."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from aidsr.core.artifacts import Robot, Scene
from aidsr.core.errors import UserError
from aidsr.tasks import Level, Task, load_task

_NUMBER = re.compile(r"\d{4}")


@dataclass(frozen=True)
class SceneFolder:
    """A folder of scenes, each in a numbered folder of its own.

    Attributes:
        folder: The folder; created with the first scene.
    """

    folder: Path

    def add(self, robot: Robot, scene: Scene, task: Task) -> Path:
        """Write a scene and its parts, and return its folder."""
        taken = [int(path.name) for path in self.folder.glob("*") if _NUMBER.fullmatch(path.name)]
        directory = self.folder / f"{max(taken, default=0) + 1:04d}"
        directory.mkdir(parents=True)
        (directory / "scene.xml").write_text(scene.mjcf, encoding="utf-8")
        (directory / "robot.xml").write_text(robot.mjcf, encoding="utf-8")
        (directory / "robot.json").write_text(robot.model_dump_json(exclude={"mjcf"}, indent=2), encoding="utf-8")
        (directory / "placement.json").write_text(scene.placement.model_dump_json(indent=2), encoding="utf-8")
        (directory / "task.txt").write_text(f"{task.name}\n", encoding="utf-8")
        (directory / "level.txt").write_text(f"{task.level}\n", encoding="utf-8")
        return directory

    def scene(self, number: str) -> Path:
        """Return the file of a scene by its number.

        Raises:
            UserError: There is no such scene.
        """
        path = self.folder / number / "scene.xml"
        if not _NUMBER.fullmatch(number) or not path.is_file():
            known = ", ".join(
                sorted(directory.name for directory in self.folder.glob("*") if _NUMBER.fullmatch(directory.name))
            )
            raise UserError(f'no scene "{number}"; scenes are: {known or "none yet"}')
        return path

    def task(self, number: str) -> Task:
        """Return the task that a scene belongs to, at its level.

        Raises:
            UserError: There is no such scene, or its folder lacks the task or level.
        """
        directory = self.scene(number).parent
        try:
            name, level = ((directory / file).read_text(encoding="utf-8").strip() for file in ("task.txt", "level.txt"))
        except FileNotFoundError as error:
            raise UserError(f"{directory} has no {Path(error.filename).name}; assemble the scene again") from None
        return load_task(name, cast("Level", level))  # load_task refuses other levels
