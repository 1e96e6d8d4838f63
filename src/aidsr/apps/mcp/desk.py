"""The scenes an agent has made: numbered folders, which `aidsr train`, `probe` and `view` take as they are."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from aidsr.core.artifacts import Robot, Scene
from aidsr.core.errors import UserError
from aidsr.tasks import Level, Task, load_task

__all__ = ["Desk"]

_NUMBER = re.compile(r"\d{4}")


@dataclass(frozen=True)
class Desk:
    """A folder of scenes, each in a numbered folder of its own.

    Attributes:
        folder: Holds them; made when the first one is kept.
    """

    folder: Path

    def keep(self, robot: Robot, scene: Scene, task: Task) -> Path:
        """Write a scene and what it was made of, and return its folder."""
        taken = [int(path.name) for path in self.folder.glob("*") if _NUMBER.fullmatch(path.name)]
        home = self.folder / f"{max(taken, default=0) + 1:04d}"
        home.mkdir(parents=True)
        (home / "scene.xml").write_text(scene.mjcf, encoding="utf-8")
        (home / "robot.xml").write_text(robot.mjcf, encoding="utf-8")
        (home / "robot.json").write_text(robot.model_dump_json(exclude={"mjcf"}, indent=2), encoding="utf-8")
        (home / "placement.json").write_text(scene.placement.model_dump_json(indent=2), encoding="utf-8")
        (home / "task.txt").write_text(f"{task.name}\n", encoding="utf-8")
        (home / "level.txt").write_text(f"{task.level}\n", encoding="utf-8")
        return home

    def scene(self, number: str) -> Path:
        """Return the file of a scene by its number.

        Raises:
            UserError: There is no such scene.
        """
        path = self.folder / number / "scene.xml"
        if not _NUMBER.fullmatch(number) or not path.is_file():
            known = ", ".join(sorted(home.name for home in self.folder.glob("*") if _NUMBER.fullmatch(home.name)))
            raise UserError(f'Expected the number of a scene, found "{number}"; there are: {known or "none yet"}.')
        return path

    def task(self, number: str) -> Task:
        """Return the task that a scene belongs to, at its level.

        Raises:
            UserError: There is no such scene, or its folder does not say what it was made for.
        """
        home = self.scene(number).parent
        try:
            name, level = ((home / file).read_text(encoding="utf-8").strip() for file in ("task.txt", "level.txt"))
        except FileNotFoundError as error:
            raise UserError(
                f"Expected the scene's task and level in {home}, found no {Path(error.filename).name}; assemble the "
                "scene anew."
            ) from None
        return load_task(name, cast("Level", level))  # it says which levels there are
