"""Tables of results submitted by several people; each submission file is verified first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from aidsr.core.artifacts import Artifact
from aidsr.core.errors import UserError
from aidsr.core.formatting import counted, format_cell
from aidsr.studies.report import format_rate, format_training, taken_in_words
from aidsr.studies.study import Study
from aidsr.studies.submission import Submission, hash_scenes, read_submission
from aidsr.studies.tables import ArmLine, arm_lines


class Conditions(Artifact):
    """Conditions that two results must share to appear in one table."""

    benchmark_version: int
    level: str
    tasks: tuple[str, ...]
    seeds: int
    steps: int
    protocol: str

    @property
    def in_words(self) -> str:
        """The conditions as a heading."""
        tasks, trained = counted(len(self.tasks), "task"), format_training(self.seeds, self.steps, self.protocol)
        return f"Benchmark version {self.benchmark_version}, level {self.level}, {tasks}, {trained}"


def leaderboard(paths: Sequence[Path]) -> str:
    """Return submissions merged into Markdown: one table for each set of conditions, the most successful arms first.

    Raises:
        UserError: A file is no submission or was changed, or the same submission was given twice.
    """
    found = {path: read_submission(path) for path in paths}
    seen: dict[str, Path] = {}
    for path, submission in found.items():
        if submission.sha256 in seen:
            raise UserError(f"{path} and {seen[submission.sha256]} are the same submission; give it once")
        seen[submission.sha256] = path
    groups: dict[Conditions, list[tuple[Path, ArmLine]]] = {}
    for path, submission in found.items():
        groups.setdefault(_conditions(submission), []).extend((path, arm) for arm in _arms(submission))
    parts = [_table(conditions, rows) for conditions, rows in groups.items()]
    hashes = [f"- {format_cell(str(path))}: sha256 {submission.sha256}" for path, submission in found.items()]
    return (
        "\n\n".join([*parts, "Files; the figures of each were checked against its outcomes:\n" + "\n".join(hashes)])
        + "\n"
    )


def check_scenes(path: Path, study: Study) -> int:
    """Check that the scenes in a study's folder are exactly those of a submission, and return their number.

    Raises:
        UserError: The file is no submission, or scenes differ.
    """
    submitted, here = read_submission(path).scenes_sha256, hash_scenes(study)
    unlike = sorted(name for name in submitted.keys() | here.keys() if submitted.get(name) != here.get(name))
    if unlike:
        raise UserError(
            f"{study.path} does not contain the scenes of {path}: {len(unlike)} scenes differ, among them {unlike[0]}"
        )
    return len(submitted)


def _conditions(submission: Submission) -> Conditions:
    plan = submission.plan
    return Conditions(
        benchmark_version=plan.benchmark_version,
        level=plan.level,
        tasks=tuple(sorted(plan.tasks)),
        seeds=plan.seeds,
        steps=plan.steps if plan.seeds else 0,
        protocol=plan.protocol if plan.seeds else "",
    )


def _arms(submission: Submission) -> tuple[ArmLine, ...]:
    models: Mapping[str, str] = {arm.name: arm.config.model for arm in submission.plan.arms}
    return arm_lines(submission.designs, models)


def _table(conditions: Conditions, rows: Sequence[tuple[Path, ArmLine]]) -> str:
    ordered = sorted(rows, key=lambda row: _rank(row[1]), reverse=True)
    head = (
        f"## {conditions.in_words}\n\n"
        "| file | arm | model | designs | stable | valid | successful | tokens | cost |\n"
        "|---|---|---|---:|---:|---:|---:|---:|---:|"
    )
    return "\n".join([head, *(_row(path, arm, conditions.seeds > 0) for path, arm in ordered)])


def _row(path: Path, arm: ArmLine, trained: bool) -> str:
    line = arm.line
    judged = [format_rate(line, of) if trained else "not trained" for of in ("valid", "successful")]
    tokens, cost, _ = taken_in_words(line)
    designs = (
        f"{line.attempted}" if line.complete == line.attempted else f"{line.complete} of {line.attempted} finished"
    )
    cells = [
        str(path),
        arm.arm,
        arm.model,
        designs,
        format_rate(line, "stable"),
        *judged,
        tokens,
        cost,
    ]
    return f"| {' | '.join(map(format_cell, cells))} |"


def _rank(arm: ArmLine) -> tuple[float, float, float]:
    line = arm.line
    return line.successful / line.attempted, line.episodes_share or 0.0, line.stable / line.attempted
