"""Tabulate runs that a language model answered through `--model manual:DIRECTORY`.

    aidsr design --task button_pushing --model manual:desk --runs runs --seed 1     # and somebody answers
    python benchmarks/manual/table.py runs/*

Each run's questions and replies are copied to transcripts/TASK (of further runs of a task to TASK-2, TASK-3 ...), and
each design gets a row in results.md.
"""

from __future__ import annotations

import argparse
import shutil
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

from aidsr.core.artifacts import Evaluation
from aidsr.runs import Run, read_status
from aidsr.runs.trainings import trainings_of
from aidsr.studies.tables import PAPER
from aidsr.validation import validate

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Row:
    """Outcome of one design."""

    task: str
    concept: str
    loads_as_written: bool
    loads_repaired: bool
    first_stable: bool
    iterations: int
    judged: bool
    outcome: str
    verdict: str
    calls: int
    tokens_in: int
    tokens_out: int


def main() -> None:
    """Write the table and copy the transcripts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path)
    runs = [Run(path) for path in parser.parse_args().runs]
    rows = [row for run in runs for row in rows_of(run)]
    (HERE / "results.md").write_text(table(rows), encoding="utf-8")
    keep_transcripts(runs, HERE / "transcripts")


def rows_of(run: Run) -> list[Row]:
    """Return a row for each design of a run."""
    record, status = run.asked(), read_status(run)
    rows = []
    for folder, state in zip(run.designs, status.designs, strict=True):
        first = folder.iterations[0]
        repaired = (first.path / "robot.xml").read_text(encoding="utf-8")
        written = first.robot_as_written.read()
        report = first.robot_report.read()
        verdicts = [training.evaluation.read() for training in trainings_of(folder)]
        rows.append(
            Row(
                task=record.task or record.objective,
                concept=state.concept,
                loads_as_written=_loads(written.decode() if written else repaired),
                loads_repaired=_loads(repaired),
                first_stable=bool(report and report.stable),
                iterations=state.iteration,
                judged=bool(state.judged),
                outcome=state.outcome.outcome if state.outcome else "unfinished",
                verdict=", ".join(_in_words(verdict) for verdict in verdicts if verdict) or "not trained",
                calls=state.usage.calls,
                tokens_in=state.usage.input_tokens,
                tokens_out=state.usage.output_tokens,
            )
        )
    return rows


def _loads(mjcf: str) -> bool:
    return not any(fault.layer == "load" and fault.severity == "error" for fault in validate(mjcf).faults)


def _in_words(verdict: Evaluation) -> str:
    word = "successful" if verdict.successful else "valid" if verdict.valid else "not valid"
    return f"{word} ({verdict.success_share:.0%} of {len(verdict.episodes)})"


def table(rows: list[Row]) -> str:
    """Return the page as Markdown."""
    lines = [
        "# Runs answered by a language model by hand",
        "",
        "Made by `python benchmarks/manual/table.py`. A language model was given the text of each prompt, and wrote",
        "each reply as a file; README.md says how far it was alone with it. Tokens are estimated from visible bytes",
        "by 3; calls and tokens of the Designer are shared evenly. What was trained later stands in trained.md.",
        "",
        "| task | concept | first reply loads | after mechanical repairs | first robot stable | iterations | judged |"
        " outcome | after training | calls | tokens in | tokens out |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    lines += [
        f"| {row.task} | {row.concept} | {_yes(row.loads_as_written)} | {_yes(row.loads_repaired)} |"
        f" {_yes(row.first_stable)} | {row.iterations} | {_yes(row.judged)} | {row.outcome} | {row.verdict} |"
        f" {row.calls} | {row.tokens_in:,} | {row.tokens_out:,} |"
        for row in rows
    ]
    tokens = fmean(row.tokens_in + row.tokens_out for row in rows)
    lines += [
        "",
        f"First replies that load: {_share(rows, 'loads_as_written')} as written,"
        f" {_share(rows, 'loads_repaired')} after mechanical repairs. Stable at the first reply:"
        f" {_share(rows, 'first_stable')}. Approved: {sum(row.outcome == 'approved' for row in rows)} of {len(rows)}.",
        "",
        f"Mean {tokens:,.0f} visible tokens a design. Published: {PAPER.tokens:,} ({PAPER.source}), which most likely",
        "include tokens of reasoning that no reply shows: the two cannot be compared directly.",
    ]
    return "\n".join(lines) + "\n"


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _share(rows: list[Row], name: str) -> str:
    return f"{sum(getattr(row, name) for row in rows)} of {len(rows)}"


def keep_transcripts(runs: Sequence[Run], home: Path) -> None:
    """Copy the questions and replies of runs from their exchange directories, in place of earlier ones of these tasks.

    Args:
        runs: The runs. The first of a task is copied to TASK, the others to TASK-2, TASK-3 ...
        home: Folder of the copies.
    """
    counts = Counter[str]()
    for run in runs:
        record = run.asked()
        task = (record.task or "own").rpartition("/")[2]
        counts[task] += 1
        if counts[task] == 1:
            for earlier in (home / task, *home.glob(f"{task}-[0-9]*")):
                shutil.rmtree(earlier, ignore_errors=True)
        folder = home / (task if counts[task] == 1 else f"{task}-{counts[task]}")
        folder.mkdir(parents=True)
        desk = Path(record.config.model.partition(":")[2])
        for file in sorted(desk.glob("[0-9]*.*.md")):
            shutil.copy(file, folder / file.name)


if __name__ == "__main__":
    main()
