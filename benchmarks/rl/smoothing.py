"""Effect of action smoothing for tentacles and a crawler, and success at button pushing after a minute of training.

    python benchmarks/rl/smoothing.py

Built-in designs are trained one after the other on all cores, with and without smoothing, and evaluated on held-out
variations. Budgets are so small that training a tentacle takes about a minute on two cores. Policies are kept under
build/smoothing, so a stopped run can be continued; smoothing.md beside this file is made from them. Nothing else should
run at the same time.
"""

from __future__ import annotations

import argparse
import itertools
import os
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import aidsr
from aidsr.core.artifacts import Evaluation
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.recipe import Recipe
from aidsr.learn.rl.trained import evaluate_training
from aidsr.learn.rl.training import train
from aidsr.learn.rl.training_folder import TrainingResult
from aidsr.tasks import BENCHMARK_VERSION

HOME = Path(__file__).parent
SMOOTHINGS = (0.0, 0.7)


@dataclass(frozen=True)
class Case:
    """A built-in design, and how often and how long it is trained with each smoothing."""

    task: str
    design: int
    """Seed of the built-in team."""
    steps: int
    seeds: int = 1

    def trainings(self) -> Iterator[tuple[float, int]]:
        """Return the smoothing and the seed of each training; smoothings alternate."""
        return ((smoothing, seed) for seed in range(self.seeds) for smoothing in SMOOTHINGS)


CASES = (
    *(Case("reaching/button_pushing", design, 45_000, seeds=5) for design in (7, 8)),
    Case("reaching/button_pushing", 8, 50_000, seeds=5),
    *(Case("reaching/button_pushing", design, 45_000) for design in range(4)),
    Case("locomotion/flat_ground", 1, 100_000),
)


@dataclass(frozen=True)
class Learned:
    """A trained policy and its evaluation."""

    case: Case
    smoothing: float
    seed: int
    result: TrainingResult
    evaluation: Evaluation


def main() -> None:
    """Train what is missing, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, default=Path("build/smoothing"), help="where policies are kept")
    folder = parser.parse_args().folder
    learned = []
    for case in CASES:
        home = folder / f"{case.task.replace('/', '.')}-{case.design}"
        scene = TaskScene.of(_made(case, home), case.task)
        for smoothing, seed in case.trainings():
            learned.append(_learned(case, scene, home / f"{case.steps}-{smoothing:g}-{seed}", smoothing, seed))
            (HOME / "smoothing.md").write_text(page(learned), encoding="utf-8")


def _made(case: Case, home: Path) -> Path:
    """Return the path of the scene of a case's design; run the design unless the scene exists."""
    there = sorted(home.glob("*/designs/1/final.xml"))
    if there:
        return there[0]
    return aidsr.design(task=case.task, concepts=1, seed=case.design, runs=home).design(1).final_scene.path


def _learned(case: Case, scene: TaskScene, folder: Path, smoothing: float, seed: int) -> Learned:
    result = train(scene, folder, steps=case.steps, seed=seed, recipe=Recipe(smoothing=smoothing))
    kept = folder / "evaluation.json"
    if kept.exists():
        return Learned(case, smoothing, seed, result, Evaluation.model_validate_json(kept.read_text("utf-8")))
    return Learned(case, smoothing, seed, result, evaluate_training(folder, videos=False))


# --- the table ---


def page(learned: Sequence[Learned]) -> str:
    """Return the page as Markdown: a table with a row for each case and smoothing."""
    ways = itertools.product(CASES, SMOOTHINGS)
    groups = ([one for one in learned if (one.case, one.smoothing) == way] for way in ways)
    made = (
        f"Made by `python benchmarks/rl/smoothing.py` on {os.cpu_count()} cores, MuJoCo {version('mujoco')}, version "
        f"{BENCHMARK_VERSION} of the benchmark. Robots are designed by the built-in team; *won* is the share of 20 "
        "held-out episodes of each policy, by training seed from 0 on."
    )
    head = "| task | seed of design | budget, control steps | smoothing | valid | won | median | median wall s |"
    rows = [_row(group) for group in groups if group]
    return "\n".join(["# Smoothing of actions\n", made + "\n", head, "|---" * 8 + "|", *rows]) + "\n"


def _row(group: Sequence[Learned]) -> str:
    case, won = group[0].case, [one.evaluation.success_share for one in group]
    cells = (
        case.task,
        case.design,
        f"{case.steps:,}",
        f"{group[0].smoothing:g}",
        f"{sum(one.evaluation.valid for one in group)} of {len(group)}",
        ", ".join(f"{share:.0%}" for share in won),
        f"{statistics.median(won):.0%}",
        f"{statistics.median(one.result.wall_s for one in group):.0f}",
    )
    return f"| {' | '.join(map(str, cells))} |"


if __name__ == "__main__":
    main()
