"""Try the designs of runs on their task without learning, and compare designs made with a memory and without.

    python -m benchmarks.memory.tried build/memory/* build/without-memory/*

The name of the folder that holds a run is its arm. Each approved design gets a row in results.jsonl. The same command
continues with the designs that are missing; without runs it only prints the table.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from statistics import fmean

from benchmarks.rows import append_row, read_rows

from aidsr.api import find_scene
from aidsr.core.artifacts import Artifact
from aidsr.core.provenance import commit
from aidsr.runs import Run
from aidsr.tools.trial import try_scene

RESULTS = Path(__file__).with_name("results.jsonl")


class Row(Artifact):
    """Trial of one design."""

    arm: str
    task: str
    run: str
    design: int
    progress: float
    """Mean progress of the trial's searches."""
    best: float
    """Best progress of all attempts, including scripts."""
    phase: str
    scene_sha256: str
    commit: str


def main() -> None:
    """Try the designs that are missing, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*", type=Path, help="run folders")
    rows = read_rows(RESULTS, Row)
    known = {(row.run, row.design) for row in rows}
    for run in map(Run, parser.parse_args().runs):
        for design in run.designs:
            if design.final_scene.path.exists() and (run.name, design.number) not in known:
                rows.append(row_of(run, design.number))
                append_row(RESULTS, rows[-1])
    sys.stdout.write(table(rows))


def row_of(run: Run, number: int) -> Row:
    """Try a design with its designer's actuator groups, and return its row."""
    scene = find_scene(run.design(number)).for_learning("auto")
    report = try_scene(scene)
    return Row(
        arm=run.path.resolve().parent.name,
        task=run.asked().task,
        run=run.name,
        design=number,
        progress=round(report.progress, 3),
        best=round(max(attempt.progress for attempt in report.attempts), 3),
        phase=report.phase,
        scene_sha256=scene.fingerprint,
        commit=commit(),
    )


def table(rows: list[Row]) -> str:
    """Return progress by task and arm, as Markdown."""
    lines = ["| task | arm | progress of each design | mean | best of all tried |", "|---|---|---|---|---|"]
    for task, arm in sorted({(row.task, row.arm) for row in rows}):
        mine = [row for row in rows if (row.task, row.arm) == (task, arm)]
        each = ", ".join(f"{row.progress:.2f}" for row in mine)
        lines.append(
            f"| {task} | {arm} | {each} | {fmean(row.progress for row in mine):.2f} | "
            f"{max(row.best for row in mine):.2f} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
