"""Is a training hopeless if no episode without noise has succeeded after most of its steps?

    python -m benchmarks.learning.hopeless build/teams/four-roles/*/designs/*/training/best-60000

Records in hopeless.jsonl, for each evaluated training of protocol `best`, when it first succeeded and the success share
of its policy. Then counts how often the rule `--stop-hopeless` would have ended a training that succeeds, without
trainings for a task that has changed since. Without folders it only counts.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.learning.compare import RESULTS as SUITE
from benchmarks.learning.compare import Row, newest
from benchmarks.rows import read_rows

from aidsr.core.artifacts import SUCCESSFUL_SHARE, Artifact
from aidsr.core.rates import Rate
from aidsr.learn.rl.recipe import HOPELESS_AFTER
from aidsr.runs.trainings import Training, read_curve
from aidsr.tasks import is_current

RESULTS = Path(__file__).with_name("hopeless.jsonl")
_STEPS = 60_000
"""Budget of the counted trainings of the suite [control steps]."""


class Ended(Artifact):
    """Result of one training."""

    scene_sha256: str
    task: str
    steps: int
    """Budget of control steps."""
    first_won: int | None
    """Control steps at the first point of the curve with a success; None if there is none."""
    success_share: float
    """Share of successes in the 20 or 100 held-out episodes of the evaluation."""
    benchmark_version: int = 4
    """Version of the benchmark at the time of the training."""


def main() -> None:
    """Record the trainings in the folders, and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trainings", nargs="*", type=Path, help="folders of trainings")
    known = kept()
    for path in parser.parse_args().trainings:
        ended = ended_in(Training(path))
        if ended is not None and ended.scene_sha256 not in {each.scene_sha256 for each in known}:
            known.append(ended)
    RESULTS.write_text("".join(each.model_dump_json() + "\n" for each in known), encoding="utf-8")
    sys.stdout.write(f"suite: {told(suite_trainings(read_rows(SUITE, Row)))}\n")
    current = [each for each in known if is_current(each.task, each.benchmark_version)]
    others = [(each.first_won, each.steps, each.success_share) for each in current]
    sys.stdout.write(f"designs of benchmarks.teams: {told(others)}\n")


def suite_trainings(rows: Sequence[Row]) -> list[tuple[int | None, int, float]]:
    """Return first success, budget and final success share of the newest training of each scene of the suite."""
    return [
        (next((point.steps for point in row.curve if point.success > 0), None), row.steps, row.curve[-1].success)
        for row in newest(rows, "best", _STEPS).values()
    ]


def kept() -> list[Ended]:
    """Return the recorded trainings."""
    return read_rows(RESULTS, Ended)


def ended_in(training: Training) -> Ended | None:
    """Return the result of a training; None if it was not evaluated, or if it began with a script."""
    verdict, config = training.evaluation.read(), training.config.read()
    if verdict is None or config is None or config["recipe"].get("script"):
        return None
    won = [row.steps for row in read_curve(training) if row.success_share]
    return Ended(
        scene_sha256=config["scene_sha256"],
        task=config["task"],
        steps=config["steps"],
        first_won=won[0] if won else None,
        success_share=verdict.success_share,
        benchmark_version=verdict.benchmark_version,
    )


def told(trainings: Sequence[tuple[int | None, int, float]]) -> str:
    """Return in words how many trainings the rule ends, and how many of these win at least half of their episodes.

    Args:
        trainings: Steps of the first success (None without one), budget of steps, and final success share of each.
    """
    ends = [share for won, steps, share in trainings if won is None or won >= HOPELESS_AFTER * steps]
    wrong = Rate(sum(share >= SUCCESSFUL_SHARE for share in ends), len(ends))
    successful = sum(share >= SUCCESSFUL_SHARE for _, _, share in trainings)
    interval = f" (Wilson {wrong.interval.low:.0%} to {wrong.interval.high:.0%})" if ends else ""
    return (
        f"{len(trainings)} trainings, {successful} successful; ended by the rule {len(ends)}, "
        f"wrongly {wrong.hits}{interval}"
    )


if __name__ == "__main__":
    main()
