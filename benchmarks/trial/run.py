"""Try every scene with the earlier and the present trial, train in it, and record the results.

    python -m benchmarks.trial.run training earlier trial short

Rows go to results.jsonl. The same command continues with the rows that are missing, and several commands may share the
file. A row holds for the text of its scene and its version of the benchmark; if one of them changes, the row is made
again. `report` writes the table.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

import numpy as np
from benchmarks.learning.compare import RESULTS as TRAININGS
from benchmarks.learning.compare import Row as Trained
from benchmarks.learning.compare import newest, success_of
from benchmarks.learning.suite import Half
from benchmarks.rows import append_row, read_rows
from benchmarks.trial.earlier import try_as_before
from benchmarks.trial.scenes import TrialScene, scenes, trained_by_teams
from pydantic import Field

from aidsr.core.artifacts import Artifact
from aidsr.core.config import PROMISING_SHARE
from aidsr.core.provenance import commit, processor
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.policy import one_torch_thread
from aidsr.learn.rl.recipe import PROTOCOLS
from aidsr.learn.rl.short_training import evaluate_briefly
from aidsr.learn.rl.trained import FinishedTraining
from aidsr.learn.rl.training import train
from aidsr.tasks import BENCHMARK_VERSION, is_current
from aidsr.tools.trial import try_scene

RESULTS = Path(__file__).with_name("results.jsonl")
STEPS = 60_000
"""Control steps of a training, by protocol `best`: a fifth of the full budget."""

_CHANGED_SINCE = ("manipulation/drawer_opening", "manipulation/force_controlled_brushing")
"""Tasks whose environment changed at commit 1bf1e8d within version 4 of the benchmark: `is_current` does not tell
trainings from before and after the change apart."""

SHORT_STEPS = 30_000
"""Control steps of a short training, as with `--task-training 30000`."""

Kind = Literal["training", "earlier", "trial", "short"]


class Row(Artifact):
    """Result of one kind of test of a scene."""

    scene: str
    task: str
    half: Half
    author: str
    kind: Kind
    success: float
    """Share of successes: in 20 development variations that were never trained on, or in the searches of a trial."""
    progress: float
    """Mean progress over the same episodes or searches."""
    sent_back: bool = False
    phase: str = ""
    details: dict[str, tuple[float, ...]] = Field(default_factory=dict)
    """Single results of a trial, on which its decision is based."""
    processor_s: float
    scene_sha256: str
    benchmark_version: int = BENCHMARK_VERSION
    steps: int = 0
    commit: str
    processor: str


def main() -> None:
    """Make the rows that are missing."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="+", choices=tuple(_MAKERS))
    parser.add_argument("--half", choices=("decide", "aside"), help="both unless named")
    parser.add_argument("--scenes", nargs="+", help="names, all of the half unless given")
    parser.add_argument("--out", type=Path, default=RESULTS)
    asked = parser.parse_args()
    for scene in scenes(asked.half, asked.scenes):
        for kind in asked.kinds:
            loaded = scene.load()
            if kind == "training" and (scene.name in taken_over() or loaded.fingerprint in trained_by_teams(STEPS)):
                continue
            if not any(is_of(row, scene, kind, loaded.fingerprint) for row in read_rows(asked.out, Row)):
                _note(asked.out, make(kind, scene, loaded))


def taken_over() -> dict[str, Trained]:
    """Return the newest trainings of `benchmarks.learning` with this budget and version of the benchmark, by scene.

    Rows of `benchmarks.learning` hold no hash of the scene, but both benchmarks read robot and placement from the same
    file. Trainings in an environment that has changed since are left out.
    """
    found = newest(read_rows(TRAININGS, Trained), "best", STEPS)
    return {name: row for name, row in found.items() if row.task not in _CHANGED_SINCE}


def is_of(row: Row, scene: TrialScene, kind: str, sha256: str) -> bool:
    """Return whether a row is of this kind and of this scene as it is today."""
    same = (row.scene, row.kind, row.scene_sha256) == (scene.name, kind, sha256)
    return same and is_current(row.task, row.benchmark_version)


def make(kind: Kind, asked: TrialScene, scene: TaskScene) -> Row:
    """Make one test of a scene and return its row."""
    began = time.process_time()
    found = _MAKERS[kind](scene)
    return Row(
        scene=asked.name,
        task=asked.task,
        half=asked.half,
        author=asked.author,
        kind=kind,
        processor_s=round(time.process_time() - began, 2),
        scene_sha256=scene.fingerprint,
        commit=commit(),
        processor=processor(),
        **found,
    )


def _trained(scene: TaskScene) -> dict[str, object]:
    with TemporaryDirectory() as home, one_torch_thread():
        folder = Path(home, "training")
        train(scene, folder, steps=STEPS, recipe=PROTOCOLS["best"], threads=1)
        finished = FinishedTraining.load(folder)
        success, progress = success_of(finished.scene, finished.policy, finished.config.recipe.smoothing, np.inf)
    return {"success": success, "progress": progress, "steps": STEPS}


def _tried(scene: TaskScene) -> dict[str, object]:
    report = try_scene(scene)
    searches = [attempt for attempt in report.attempts if attempt.how == "search"]
    return {
        "success": sum(attempt.succeeded for attempt in searches) / len(searches),
        "progress": report.progress,
        "sent_back": not report.critique.passed,
        "phase": report.phase,
        "details": {
            "decisive": (scene.task.decisive_stage()[0],),
            "searches": tuple(attempt.progress for attempt in searches),
            "script": tuple(attempt.progress for attempt in report.attempts if attempt.how == "script"),
            "succeeded": tuple(float(attempt.succeeded) for attempt in report.attempts),
            "start": (report.start_progress,),
        },
    }


def _trained_briefly(scene: TaskScene) -> dict[str, object]:
    evaluation = evaluate_briefly(scene, SHORT_STEPS)
    progress = sum(one.best_progress for one in evaluation.episodes) / len(evaluation.episodes)
    sent_back = evaluation.success_share < PROMISING_SHARE or not evaluation.valid
    details = {"valid": (float(evaluation.valid),)}
    return {
        "success": evaluation.success_share,
        "progress": progress,
        "sent_back": sent_back,
        "details": details,
        "steps": SHORT_STEPS,
    }


_MAKERS: dict[Kind, Callable[[TaskScene], dict[str, object]]] = {
    "training": _trained,
    "earlier": try_as_before,
    "trial": _tried,
    "short": _trained_briefly,
}


def _note(path: Path, row: Row) -> None:
    append_row(path, row)
    sys.stdout.write(
        f"{row.scene} {row.kind}: success {row.success:.0%}, progress {row.progress:.2f}, {row.phase} "
        f"{'sent back' * row.sent_back}, {row.processor_s:.0f} s of a processor\n"
    )
    sys.stdout.flush()


def kept(rows: Sequence[Row], kind: Kind) -> dict[str, Row]:
    """Return the newest row of each scene, of one kind and for the present version of the benchmark."""
    return {row.scene: row for row in rows if row.kind == kind and is_current(row.task, row.benchmark_version)}


if __name__ == "__main__":
    main()
