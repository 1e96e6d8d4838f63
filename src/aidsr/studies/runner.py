"""Runner of studies: start pending jobs, retry failed ones, and give up jobs that keep failing."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

from aidsr.core.errors import Limit, UserError
from aidsr.studies.budget import StudyBudget, read_budget
from aidsr.studies.jobs import Job, pending_in
from aidsr.studies.pool import EndedJob, Pool
from aidsr.studies.study import Cell, Study
from aidsr.tasks import BENCHMARK_VERSION

MOST_ATTEMPTS = 3
"""Number of attempts after which a failing job is given up. Our choice: a lost machine or a full disk can make a job
fail twice."""


@dataclass(frozen=True)
class Progress:
    """The progress of a study."""

    done: int
    running: tuple[Job, ...]
    waiting: int
    failed: tuple[Job, ...]
    """Jobs that were given up after `MOST_ATTEMPTS` attempts."""
    last: EndedJob | None = None
    """Job that ended last."""
    unpaid: tuple[Job, ...] = ()
    """At the end: jobs that were not run because too little of the study's limit is left."""
    refused: tuple[Limit, ...] = ()
    """At the end: the limits of which too little is left."""


@dataclass
class _StudyRun:
    study: Study
    pool: Pool
    listen: Callable[[Progress], None]
    budget: StudyBudget
    without: frozenset[Cell | Job]
    waiting: dict[Job, None] = field(default_factory=dict)
    running: dict[Job, None] = field(default_factory=dict)
    attempts: Counter[Job] = field(default_factory=Counter)
    failed: list[Job] = field(default_factory=list)
    done: int = 0
    order: dict[Cell, int] = field(init=False)
    """Position of each cell in the study."""

    def __post_init__(self) -> None:
        self.order = {cell: place for place, cell in enumerate(self.study.cells)}

    def to_the_end(self) -> Progress:
        for cell in self.study.cells:
            self._queue_pending(cell)
        last = None
        try:
            if self.waiting:
                _check_version(self.study)
            while self.waiting or self.running:
                self.budget.refusing.clear()
                self._start_jobs()
                if not self.running:
                    break
                self.listen(self._progress(last))
                last = self.pool.wait()
                self._end(last)
        finally:
            self.pool.close()
        refused = tuple(sorted(self.budget.refusing)) if self.waiting else ()
        end = replace(self._progress(last), unpaid=tuple(self.waiting), refused=refused)
        self.listen(end)
        return end

    def _start_jobs(self) -> None:
        for job in sorted(self.waiting, key=self._turn):
            if self.pool.free <= 0:
                return
            paid_for = self.budget.begin(job, self.pool.free)
            if paid_for is not None:
                del self.waiting[job]
                self.running[job] = None
                self.pool.begin(paid_for)

    def _turn(self, job: Job) -> tuple[int, int, int]:
        """Return the sort key of a job: first runs before second ones, then untried jobs first, then early cells."""
        return job.cell.number, self.attempts[job], self.order[job.cell]

    def _end(self, ended: EndedJob) -> None:
        job = ended.job
        del self.running[job]
        self.budget.end(job, exhausted_limits=ended.exhausted_limits)
        still_pending = job in pending_in(self.study, job.cell)
        if ended.exhausted_limits:
            self.waiting[job] = None
        elif ended.error or still_pending:
            self.attempts[job] += 1
            _note_failure(self.study, ended, self.attempts[job])
            if not still_pending:  # it failed after its output, such as in drawing a film
                self.done += 1
            elif self.attempts[job] >= MOST_ATTEMPTS:
                self.failed.append(job)
            else:
                self.waiting[job] = None
        else:
            self.done += 1
        for cell in (job.cell, *self.study.followers(job.cell)):
            self._queue_pending(cell)

    def _queue_pending(self, cell: Cell) -> None:
        if cell in self.without:
            return
        for job in pending_in(self.study, cell):
            if job not in self.running and job not in self.failed and job not in self.without:
                self.waiting.setdefault(job)

    def _progress(self, last: EndedJob | None) -> Progress:
        return Progress(self.done, tuple(self.running), len(self.waiting), tuple(self.failed), last)


def _check_version(study: Study) -> None:
    """Refuse to continue a study of another benchmark version: its figures would mix two versions of the tasks.

    Raises:
        UserError: The benchmark has changed since the study's plan was made.
    """
    planned = study.plan.benchmark_version
    if planned != BENCHMARK_VERSION:
        raise UserError(
            f"{study.path} is a study of benchmark version {planned}, whose tasks differ from those of version "
            f"{BENCHMARK_VERSION}; it can be read but not resumed: start another study"
        )


def run_study(
    study: Study,
    pool: Pool,
    listen: Callable[[Progress], None] = lambda _progress: None,
    without: frozenset[Cell | Job] = frozenset(),
) -> Progress:
    """Run all pending jobs of a study within its limit; a stopped study is resumed by calling this again.

    Args:
        study: The study.
        pool: Executor of the jobs; closed at the end.
        listen: Called before each wait for a job, and at the end.
        without: Runs and single jobs to leave out, such as those whose results are kept elsewhere.

    Raises:
        UserError: Jobs are pending, and the study has another benchmark version.
    """
    return _StudyRun(study, pool, listen, StudyBudget(study, read_budget(study)), without).to_the_end()


def read_failures(study: Study) -> list[dict[str, object]]:
    """Return every failed attempt in order, with the keys of `_KEYS`. An unfinished last line is ignored.

    Raises:
        UserError: A complete line is not a failed attempt.
    """
    path = study.path / _FAILURES
    lines = path.read_bytes().split(b"\n")[:-1] if path.exists() else []
    return [_failure(path, number, line) for number, line in enumerate(lines, start=1)]


_FAILURES = "failures.jsonl"
_KEYS = ("time", "job", "attempt", "error")


def _failure(path: Path, number: int, line: bytes) -> dict[str, object]:
    try:
        found = json.loads(line)
    except ValueError:
        found = None
    if not isinstance(found, dict) or not found.keys() >= set(_KEYS):
        raise UserError(f"line {number} of {path} is not a failed job; remove or restore that line")
    return found


def _note_failure(study: Study, ended: EndedJob, attempt: int) -> None:
    """Append a failed attempt; an unfinished last line of a killed process is cut off."""
    time = datetime.now(UTC).isoformat(timespec="seconds")
    error = ended.error or "the job ended without writing its output"
    note = dict(zip(_KEYS, (time, ended.job.name, attempt, error), strict=True))
    with (study.path / _FAILURES).open("a+b") as file:
        file.seek(0)
        file.truncate(file.read().rfind(b"\n") + 1)
        file.write(json.dumps(note).encode() + b"\n")
