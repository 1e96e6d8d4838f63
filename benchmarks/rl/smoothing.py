"""What smoothing of actions does for arms and for a crawler, and how well an arm presses a button after a minute.

    python benchmarks/rl/smoothing.py

Built-in designs are trained on all cores, one after the other, with and without smoothing, and judged on held-out
variations. Budgets are so small that a policy of the arms takes about a minute on two cores. Policies are kept under
build/smoothing, so a stopped run goes on; smoothing.md beside this file is made of them. Nothing else should run
meanwhile.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import aidsr
from aidsr.artifacts import Evaluation
from aidsr.episodes.scene import TaskScene
from aidsr.rl.recipe import Recipe
from aidsr.rl.trained import evaluate_training
from aidsr.rl.training import TrainingResult, train
from aidsr.tasks import BENCHMARK_VERSION

HOME = Path(__file__).parent
SMOOTHINGS = (0.0, 0.7)


@dataclass(frozen=True)
class Case:
    """A built-in design, and how it is trained with each smoothing."""

    task: str
    design: int
    """Seed of the built-in team."""
    steps: int
    seeds: int = 1

    def trainings(self) -> Iterator[tuple[float, int]]:
        """Return smoothing and seed of each; smoothings take turns."""
        return ((smoothing, seed) for seed in range(self.seeds) for smoothing in SMOOTHINGS)


CASES = (
    *(Case("reaching/button_pushing", design, 45_000, seeds=5) for design in (7, 8)),
    Case("reaching/button_pushing", 8, 50_000, seeds=5),
    *(Case("reaching/button_pushing", design, 45_000) for design in range(4)),
    Case("locomotion/flat_ground", 1, 100_000),
)


@dataclass(frozen=True)
class Learned:
    """A policy, and how it was judged."""

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
            sys.stdout.write(_row(learned[-1]) + "\n")
            sys.stdout.flush()
            (HOME / "smoothing.md").write_text(page(learned), encoding="utf-8")


def _made(case: Case, home: Path) -> Path:
    """Return the scene of a case's design, made unless it is there."""
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


def page(learned: list[Learned]) -> str:
    """Return the table of policies, and medians where a design was trained more than twice with a smoothing."""
    told = [
        f"# Smoothing of actions\n\nMade by `python benchmarks/rl/smoothing.py` on {os.cpu_count()} cores, MuJoCo "
        f"{version('mujoco')}, version {BENCHMARK_VERSION} of the benchmark. Each number is of one policy: control "
        "steps and wall time of its training, and the share of 20 held-out episodes that it won.\n",
        "| task | built-in seed | smoothing | training seed | steps | wall | won | valid |",
        "|---|---|---|---|---|---|---|---|",
        *map(_row, learned),
        "",
    ]
    for case in CASES:
        for smoothing in SMOOTHINGS:
            own = [one for one in learned if (one.case, one.smoothing) == (case, smoothing)]
            if len(own) > 2:
                won = statistics.median(one.evaluation.success_share for one in own)
                wall_s = statistics.median(one.result.wall_s for one in own)
                told.append(
                    f"{case.task}, built-in seed {case.design}, {case.steps:,} steps, smoothing {smoothing:g}, median of {len(own)}: "
                    f"**{won:.0%} won after {wall_s:.0f} s**.\n"
                )
    return "\n".join(told).rstrip() + "\n"


def _row(one: Learned) -> str:
    cells = (
        one.case.task,
        one.case.design,
        f"{one.smoothing:g}",
        one.seed,
        f"{one.result.steps:,}",
        f"{one.result.wall_s:.0f} s",
        f"{one.evaluation.success_share:.0%}",
        "yes" if one.evaluation.valid else "no",
    )
    return f"| {' | '.join(map(str, cells))} |"


if __name__ == "__main__":
    main()
