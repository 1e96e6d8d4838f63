"""The folder of one training, and what each of its files holds."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import ValidationError

from aidsr.core.artifacts import ActuatorGroup, Artifact
from aidsr.core.directory_lock import DirectoryLock
from aidsr.core.errors import UserError
from aidsr.learn.episodes.actions import GroupsFrom
from aidsr.learn.rl.recipe import Recipe
from aidsr.tasks import Level
from aidsr.tasks.goal import AnyGoal

__all__ = ["TakenError", "TrainingConfig", "TrainingFolder", "TrainingResult"]

Written = TypeVar("Written", bound=Artifact)


class TakenError(UserError):
    """A folder belongs to another training, or to another process that is at this one."""


class TrainingConfig(Artifact):
    """What was asked of a training, enough to repeat it."""

    task: str
    goal: AnyGoal | None = None
    """Where the task is one that a goal makes of an environment."""
    goal_version: int | None = None
    """Of what goals measured then; None for a task, and for goals of before there were versions."""
    level: Level
    benchmark_version: int
    steps: int
    seed: int
    recipe: Recipe
    groups: tuple[ActuatorGroup, ...]
    """What each number of an action drives."""
    groups_from: GroupsFrom
    scene_sha256: str
    versions: dict[str, str]


class TrainingResult(Artifact):
    """How a training ended."""

    steps: int
    wall_s: float
    episodes: int
    diverged_episodes: int
    """Episodes in which the simulation broke down."""
    success_share: float | None
    """Of the last 100 episodes, with the noise of learning; None without any."""
    stopped: Literal["budget", "saturated"]
    resumed: int = 0
    """How often it went on from a checkpoint, with other episodes than it would have drawn in one sitting."""


@dataclass(frozen=True)
class TrainingFolder:
    """One trained policy: what was asked, how it went, what came out.

    | file               | content                                                                        |
    |--------------------|--------------------------------------------------------------------------------|
    | config.json        | what was asked: task, recipe, seed, budget, groups, versions                   |
    | scene.xml          | the scene it was trained in                                                    |
    | probe.json         | what the probe found, where the policy was to begin with it                    |
    | events.jsonl       | started, probed, resumed, tested, checkpoint, finished, evaluated, with times  |
    | curve.csv          | success, progress, return and speed over the steps                             |
    | checkpoint/        | the policy so far, while training goes on                                      |
    | .in_use            | empty; a process that trains here has it locked                                |
    | policy.zip         | the trained policy, as Stable-Baselines3 saves it                              |
    | normalisation.json | mean and variance of the observations, without which the policy is blind       |
    | training.json      | how it ended: steps, time, episodes, divergences; written last                 |
    | evaluation.json    | the verdict on held-out variations                                             |
    | curve.png          | the curve as a picture                                                         |
    | best.npz, median.npz | the best and the median held-out episode as motions, as `episode_recordings` says |
    | best.mp4, median.mp4 | the same as films                                                              |
    """

    path: Path

    def __truediv__(self, name: str) -> Path:
        return self.path / name

    def write(self, name: str, content: bytes | str) -> Path:
        """Put a file in its place in one step, so that a reader sees it whole or not at all."""
        target = self.path / name
        target.parent.mkdir(parents=True, exist_ok=True)
        temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)
        temporary.replace(target)
        return target

    def write_json(self, name: str, value: Mapping[str, Any]) -> Path:
        """Write a mapping as indented JSON."""
        return self.write(name, json.dumps(value, indent=2) + "\n")

    def read_json(self, name: str) -> dict[str, Any]:
        """Return what `write_json` wrote."""
        value: dict[str, Any] = json.loads((self.path / name).read_text(encoding="utf-8"))
        return value

    def read(self, name: str, kind: type[Written]) -> Written:
        """Return the artifact in a file.

        Raises:
            FileNotFoundError: There is no such file.
            UserError: It does not hold such an artifact, as where an earlier version wrote it.
        """
        try:
            return kind.model_validate_json((self.path / name).read_bytes())
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in first["loc"]) or "the whole file"
            raise UserError(
                f"{self.path / name} was expected to be as this version of AID-SR writes it, and is not ({place}: "
                f"{first['msg']}); remove {self.path} to train anew there, or train beside it with aidsr train --again"
            ) from None

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Keep the folder, made if absent, from other processes while this one trains in it.

        Raises:
            TakenError: Another one does.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        try:
            lock = DirectoryLock(self.path)
        except UserError:
            raise TakenError(
                f"a folder that nobody trains in was expected, and {self.path} is being trained already; wait for "
                "that process or end it, then the same command goes on"
            ) from None
        try:
            yield
        finally:
            lock.release()

    def note(self, kind: str, **facts: Any) -> None:
        """Append an event with the present time."""
        event = {"time": datetime.now(UTC).isoformat(timespec="milliseconds"), "kind": kind, **facts}
        with (self.path / "events.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(event) + "\n")

    def replace_folder(self, name: str, made: Path) -> None:
        """Put a folder made elsewhere in the place of one of this training's; see `recover_folder`."""
        target, old = self.path / name, self.path / f".{name}.old"
        shutil.rmtree(old, ignore_errors=True)
        if target.exists():
            target.replace(old)
        made.replace(target)
        shutil.rmtree(old, ignore_errors=True)

    def recover_folder(self, name: str) -> bool:
        """Return whether there is such a folder; one that a kill left aside, while it was replaced, is put back."""
        target, old = self.path / name, self.path / f".{name}.old"
        if old.exists() and not target.exists():
            old.replace(target)
        return target.exists()

    def remove_folder(self, name: str) -> None:
        """Remove a folder of this training's."""
        shutil.rmtree(self.path / name)
