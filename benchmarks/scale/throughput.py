"""Compare the throughput of two workers and of one: the same study with --jobs 1 and --jobs 2, alternating.

    python benchmarks/scale/throughput.py

One design is made beforehand. The timed part is what `aidsr benchmark --resume --jobs J` then does: training and
evaluating its policies, one job each, all of the same size. Every round begins with a fresh copy of the study. Nothing
else should run at the same time. It takes about five minutes on two cores.
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from aidsr.core.config import RunConfig
from aidsr.studies.jobs import Job, run_job
from aidsr.studies.outcomes import read_outcomes
from aidsr.studies.pool import LocalPool
from aidsr.studies.runner import read_failures, run_study
from aidsr.studies.study import Arm, StudyPlan, create_study, open_study

TASK = "grasping/dynamic_catching"
"""A task with short episodes, so that evaluation is a small part of a job."""
WORKERS = (1, 2)
RESULTS = Path(__file__).parent / "results.md"


def prepared(folder: Path, policies: int, steps: int) -> Path:
    """Return the folder of a study whose one design is made and verified, and whose policies are not trained yet."""
    arm = Arm(name="builtin", config=RunConfig(concepts=1))
    plan = StudyPlan(tasks=(TASK,), arms=(arm,), runs=1, seeds=policies, steps=steps, protocol="paper", probe=False)
    study = create_study(folder, plan)
    (cell,) = study.cells
    run_job(study.path, Job(cell, "design"))
    run_job(study.path, Job(cell, "verify", 1))
    return study.path


def seconds(study: Path, workers: int) -> float:
    """Return how long a copy of a study takes to finish [s]."""
    with tempfile.TemporaryDirectory() as folder:
        copy = open_study(shutil.copytree(study, Path(folder) / "study"))
        began_s = time.monotonic()
        run_study(copy, LocalPool(copy.path, workers))
        took_s = time.monotonic() - began_s
        (row,) = read_outcomes(copy)
        if read_failures(copy) or not row.complete:
            sys.exit(f"a job failed, so the time says nothing: {read_failures(copy)}")
    return took_s


def page(took_s: dict[int, list[float]], policies: int, steps: int, load: tuple[float, float]) -> str:
    """Return the results as Markdown."""
    alone, two = (median(took_s[workers]) for workers in WORKERS)
    rows = [
        f"| {workers} | {', '.join(f'{each:.1f}' for each in times)} | {median(times):.1f} "
        f"| {60 * policies / median(times):.1f} | {alone / median(times):.2f} |"
        for workers, times in took_s.items()
    ]
    return "\n".join(
        [
            "# Two workers against one",
            "",
            f"Made by `python benchmarks/scale/throughput.py --policies {policies} --steps {steps} "
            f"--rounds {len(took_s[1])}` on {os.cpu_count()} cores ({platform.machine()}), Python "
            f"{platform.python_version()}, {time.strftime('%Y-%m-%d')}.",
            "",
            f"{policies} policies of one design for {TASK}, {steps:,} control steps each, trained by protocol `paper` "
            "and judged; one job a policy, one physics and one torch thread a job. Workers took turns; a round is a "
            "fresh copy of the same study.",
            "",
            "| workers | seconds, each round | median | policies a minute | throughput |",
            "|---:|---|---:|---:|---:|",
            *rows,
            "",
            f"**Two workers do {alone / two:.2f} times what one does** (aim: at least 1.6 on two cores). Mean load of "
            f"the machine in the minute before: {load[0]:.2f}; a machine that does nothing else has less than 0.3. In "
            f"the last minute: {load[1]:.2f}.",
            "",
        ]
    )


def main() -> None:
    """Measure both numbers of workers in turns, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--policies", type=int, default=2, help="trained in each round; an even number")
    parser.add_argument("--steps", type=int, default=2000, help="control steps of a policy")
    parser.add_argument("--rounds", type=int, default=3, help="of each number of workers")
    parser.add_argument("--out", type=Path, default=RESULTS, help="the page to write")
    asked = parser.parse_args()
    before, took_s = os.getloadavg()[0], {workers: list[float]() for workers in WORKERS}
    with tempfile.TemporaryDirectory() as folder:
        study = prepared(Path(folder) / "study", asked.policies, asked.steps)
        for number in range(1, asked.rounds + 1):
            for workers in WORKERS:
                took_s[workers].append(seconds(study, workers))
                print(f"round {number}, workers {workers}: {took_s[workers][-1]:.1f} s", flush=True)  # noqa: T201
    asked.out.write_text(page(took_s, asked.policies, asked.steps, (before, os.getloadavg()[0])), encoding="utf-8")


if __name__ == "__main__":
    main()
