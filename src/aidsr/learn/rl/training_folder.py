"""The folder of one training and the contents of its files."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from aidsr.core.artifacts import Artifact
from aidsr.core.directory_lock import DirectoryLock
from aidsr.core.errors import UserError
from aidsr.core.numbered import numbered_in
from aidsr.core.storage_errors import storage_errors
from aidsr.learn.rl.training_config import Stopped, TrainingConfig

Written = TypeVar("Written", bound=Artifact)

CONFIG_FILE = "config.json"
SCENE_FILE = "scene.xml"
RESULT_FILE = "training.json"
EVALUATION_FILE = "evaluation.json"
PROBE_FILE = "probe.json"
CURVE_FILE = "curve.csv"
POLICY_FILE = "policy.zip"
NORMALISATION_FILE = "normalisation.json"
"""Names of files of a training that several modules read or write; `TrainingFolder` says what each holds.
`aidsr.runs.trainings` reads them without the libraries of this package."""


class FolderInUseError(UserError):
    """A folder holds another training, or another process trains, evaluates or renders in it."""


class TrainingResult(Artifact):
    """Result of a training."""

    steps: int
    wall_s: float
    episodes: int
    diverged_episodes: int
    """Episodes in which the simulation diverged."""
    success_share: float | None
    """Share of the last 100 episodes that succeeded, with exploration noise. With SAC, share of 20 new episodes without
    noise at the end of the budget, or of its last 20 if the training ended earlier. None without any episode."""
    stopped: Stopped
    resumed: int = 0
    """Number of times that it resumed from a checkpoint; it then samples other episodes than it would have in one
    process."""


@dataclass(frozen=True)
class TrainingFolder:
    """Folder of one trained policy: settings, course of the training, results.

    | file                 | content                                                                             |
    |----------------------|-------------------------------------------------------------------------------------|
    | config.json          | settings: task, recipe, seed, budget, groups, versions                              |
    | scene.xml            | the scene in which the policy was trained                                           |
    | probe.json           | report of the probe, whose motion the policy has to beat or was to imitate          |
    | events.jsonl         | started, probed, resumed, tested, checkpoint, restored, beaten, finished, evaluated |
    | curve.csv            | success, progress, return and speed over the steps                                  |
    | checkpoint/          | the policy so far, during training                                                  |
    | .in_use              | empty; locked by the process that trains, evaluates or renders here                 |
    | policy.zip           | the trained policy, as Stable-Baselines3 saves it                                   |
    | normalisation.json   | mean and variance of the observations                                               |
    | training.json        | result: steps, time, episodes, divergences; written last                            |
    | evaluation.json      | the verdict on held-out variations                                                  |
    | curve.png            | the curve as a picture                                                              |
    | best.npz, median.npz | the best and the median held-out episode, see `episode_recordings`                  |
    | best.mp4, median.mp4 | the same episodes as videos                                                         |
    """

    path: Path

    def __truediv__(self, name: str) -> Path:
        return self.path / name

    def write(self, name: str, content: bytes | str) -> Path:
        """Write a file atomically: a reader sees either the whole file or nothing."""
        target = self.path / name
        target.parent.mkdir(parents=True, exist_ok=True)
        temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
        with storage_errors(target):
            try:
                temporary.write_bytes(content.encode() if isinstance(content, str) else content)
                temporary.replace(target)
            except OSError:
                temporary.unlink(missing_ok=True)
                raise
        return target

    def write_json(self, name: str, value: Mapping[str, Any]) -> Path:
        """Write a mapping as indented JSON."""
        return self.write(name, json.dumps(value, indent=2) + "\n")

    def read_json(self, name: str) -> dict[str, Any]:
        """Return the mapping that `write_json` wrote."""
        value: dict[str, Any] = json.loads((self.path / name).read_text(encoding="utf-8"))
        return value

    def read(self, name: str, kind: type[Written]) -> Written:
        """Return the artifact in a file.

        Raises:
            FileNotFoundError: There is no such file.
            UserError: The file does not contain such an artifact, because another version wrote it.
        """
        try:
            return kind.model_validate_json((self.path / name).read_bytes())
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in first["loc"]) or "the whole file"
            raise UserError(
                f"{self.path / name} was written by another version of AID-SR ({place}: {first['msg']}); remove "
                f"{self.path} to train there, or train again, into the next folder"
            ) from None

    def finished(self, config: TrainingConfig) -> TrainingResult | None:
        """Return the result of this training; None where it has not started or has to be resumed.

        Args:
            config: Requested settings.

        Raises:
            FolderInUseError: The folder holds another training.
        """
        if not (self.path / CONFIG_FILE).exists():
            return None
        differing = self.read(CONFIG_FILE, TrainingConfig).differences(config)
        if differing:
            raise FolderInUseError(
                f"{self.path} holds a training that differs in {', '.join(differing)}; use another folder, or the "
                "same settings to resume it"
            )
        return self.read(RESULT_FILE, TrainingResult) if (self.path / RESULT_FILE).exists() else None

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Lock the folder, created if absent, while this process trains, evaluates or renders in it.

        Raises:
            FolderInUseError: Another process has locked it.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        try:
            lock = DirectoryLock(self.path)
        except UserError:
            raise FolderInUseError(
                f"another process trains, judges or films in {self.path}; wait for it or end it, then run the same "
                "command again"
            ) from None
        try:
            yield
        finally:
            lock.release()

    def log_event(self, kind: str, **facts: Any) -> None:
        """Append an event with the current time."""
        event = {"time": datetime.now(UTC).isoformat(timespec="milliseconds"), "kind": kind, **facts}
        with (self.path / "events.jsonl").open("a", encoding="utf-8") as file:
            file.write(json.dumps(event) + "\n")

    def replace_folder(self, name: str, made: Path) -> None:
        """Replace a subfolder of this training by one that was created elsewhere; see `recover_folder`."""
        target, old = self.path / name, self.path / f".{name}.old"
        shutil.rmtree(old, ignore_errors=True)
        if target.exists():
            target.replace(old)
        made.replace(target)
        shutil.rmtree(old, ignore_errors=True)

    def recover_folder(self, name: str) -> bool:
        """Return whether a subfolder exists; restore it first if the process was killed while replacing it."""
        target, old = self.path / name, self.path / f".{name}.old"
        if old.exists() and not target.exists():
            old.replace(target)
        return target.exists()

    def remove_folder(self, name: str) -> None:
        """Remove a subfolder of this training."""
        shutil.rmtree(self.path / name)


def folder_for(home: Path, config: TrainingConfig, *, again: bool = False) -> Path:
    """Return the last of the folders 001, 002 … under `home` that holds the same training, else the next one.

    That training may be unfinished. With `again`, return the next folder in any case.
    """
    numbered = numbered_in(home)
    same = [] if again else [path for path in numbered if _holds(path, config)]
    return same[-1] if same else home / f"{int(numbered[-1].name) + 1 if numbered else 1:03d}"


def _holds(path: Path, config: TrainingConfig) -> bool:
    try:
        existing = TrainingFolder(path).read(CONFIG_FILE, TrainingConfig)
    except (FileNotFoundError, UserError):  # no training, or one of a version with other settings
        return False
    return not existing.differences(config)
