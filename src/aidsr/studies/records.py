"""The designs of a study as plain records, for a table of one's own."""

from __future__ import annotations

from pathlib import Path

from aidsr.core.arguments import check_type
from aidsr.studies.outcomes import DesignRow, read_outcomes
from aidsr.studies.study import Study, as_study

Record = dict[str, str | int | float | bool | None]
"""Results of one design by column; None where a value does not exist."""
_USAGE = ("input_tokens", "output_tokens", "cost_usd")
COLUMNS = (
    "arm",
    "task",
    "run",
    "design",
    "family",
    "outcome",
    "stable",
    "valid",
    "successful",
    "episodes_share",
    "probe_progress",
    "iterations",
    *_USAGE,
    "latency_s",
    "steps",
    "resumed",
    "motions",
    "won_by_mean_action",
    "training_s",
    "complete",
)
"""Columns of a record, which are those of report.csv. `DesignRow` says what they mean."""


def record_of(row: DesignRow) -> Record:
    """Return the results of a design as plain values, with its evaluations aggregated."""
    found: Record = {name: getattr(row.usage if name in _USAGE else row, name) for name in COLUMNS}
    return found if row.evaluations else {**found, "episodes_share": None}


def outcomes(study: str | Path | Study) -> list[Record]:
    """Return the results of a study so far, one record for each design of its plan, successful or not.

        table = pandas.DataFrame(aidsr.outcomes("studies/first"))
        print(table.groupby(["arm", "task"]).successful.mean())

    A record has the columns of report.csv: arm, task, run, design, family, outcome ("unfinished" before the design has
    ended), stable, valid and successful (False until measured), episodes_share (success rate in held-out episodes),
    probe_progress, iterations, input_tokens, output_tokens, cost_usd, latency_s, steps and training_s (of all its
    trainings), resumed, motions, won_by_mean_action (numbers of policies), and complete: whether all its results exist.

    Args:
        study: A study, its folder, or a file with the results of one, written by `aidsr submit`, which is verified.

    Raises:
        TypeError: `study` has another type.
        UserError: The folder holds no study, or the file was changed.
    """
    check_type(study, (str, Path, Study), "study must be a study, its folder, or a file written by aidsr submit")
    if not isinstance(study, Study) and Path(study).is_file():
        from aidsr.studies.submission import read_submission

        rows = read_submission(Path(study)).designs
    else:
        rows = read_outcomes(as_study(study))
    return [record_of(row) for row in rows]
