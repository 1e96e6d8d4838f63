"""What was measured, kept line by line with the conditions that it was measured under."""

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
    """What may not change between measurements that are compared."""

    benchmark_version: int
    packages: dict[str, str]
    cores: int


class LearningConditions(Conditions):
    """The same for trainings."""

    recipe: dict[str, Any]
    """With the fields it had then."""
    most_steps: int
    """Budget of our recipe."""
    patience: float
    """How many times our wall time the defaults may take."""

    @property
    def machine(self) -> Conditions:
        """Those that have nothing to do with learning."""
        return Conditions(benchmark_version=self.benchmark_version, packages=self.packages, cores=self.cores)


class Stepping(Artifact):
    """How fast the simulations of a body step."""

    body: str
    conditions: Conditions
    load: float
    """Of the machine, the minute before."""
    simulations: int
    """Of the batched environment and of the raw physics."""
    processes: int
    """Of SubprocVecEnv, one environment each."""
    rounds: tuple[dict[str, float], ...]
    """Env-steps per second of each kind, in each round."""


class Run(Artifact):
    """How a body learns with one seed."""

    body: str
    seed: int
    conditions: LearningConditions
    load: float
    """Of the machine, the minute before."""
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
    """Return what a file holds, nothing where there is no file; end where it was measured under other conditions."""
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
    """Put records in the place of what a file holds."""
    replace_file(raw, "".join(record.model_dump_json() + "\n" for record in records).encode())
