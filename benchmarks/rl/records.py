"""Measurements, one per line of a file, each with the conditions under which it was made."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

from learning import Way

from aidsr.core.artifacts import Artifact
from aidsr.learn.rl.recipe import Recipe
from aidsr.runs.files import replace_file
from aidsr.tasks import BENCHMARK_VERSION


class Conditions(Artifact):
    """Conditions that must be equal for measurements that are compared."""

    benchmark_version: int
    packages: dict[str, str]
    cores: int


class LearningConditions(Conditions):
    """Conditions that must be equal for trainings that are compared."""

    recipe: dict[str, Any]
    """The package's recipe, with the fields of that time."""
    most_steps: int
    """Budget of control steps of the package's recipe."""
    patience: float
    """Time limit of the default PPO, as a multiple of the wall time of the package's recipe."""

    @property
    def machine(self) -> Conditions:
        """The conditions that do not concern learning."""
        return Conditions(benchmark_version=self.benchmark_version, packages=self.packages, cores=self.cores)


class Stepping(Artifact):
    """Stepping speed of the simulations of a body."""

    body: str
    conditions: Conditions
    load: float
    """Mean load of the machine in the minute before."""
    simulations: int
    """Number of simulations of the batched environment and of the raw physics."""
    processes: int
    """Number of processes of SubprocVecEnv, one environment each."""
    rounds: tuple[dict[str, float], ...]
    """Env-steps per second of each kind, in each round."""


class Run(Artifact):
    """Trainings of a body with one seed."""

    body: str
    seed: int
    conditions: LearningConditions
    load: float
    """Mean load of the machine in the minute before."""
    ours: Way
    theirs: Way


Record = TypeVar("Record", Stepping, Run)


def learning_conditions_now(most_steps: int, patience: float) -> LearningConditions:
    """Return the conditions of today's trainings."""
    return LearningConditions(
        benchmark_version=BENCHMARK_VERSION,
        packages={name: version(name) for name in ("mujoco", "stable-baselines3", "torch")},
        cores=os.cpu_count() or 0,
        recipe=Recipe().model_dump(mode="json"),
        most_steps=most_steps,
        patience=patience,
    )


def kept(raw: Path, kind: type[Record], conditions: Conditions) -> list[Record]:
    """Return the records of a file, none if there is no file; exit if one was made under other conditions."""
    lines = raw.read_text(encoding="utf-8").splitlines() if raw.exists() else []
    records = [kind.model_validate_json(line) for line in lines]
    for record in records:
        if record.conditions != conditions:
            sys.exit(
                f"{raw} was measured under other conditions: {record.conditions}; expected were {conditions}. Name "
                "another file with --out"
            )
    return records


def keep(raw: Path, records: Sequence[Record]) -> None:
    """Replace the contents of a file by records."""
    replace_file(raw, "".join(record.model_dump_json() + "\n" for record in records).encode())
