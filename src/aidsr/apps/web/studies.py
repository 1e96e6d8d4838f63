"""Studies of many runs: their progress, read from their folders periodically in a separate thread, and their runs."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from aidsr.apps.web.processes import Processes
from aidsr.core.calls import Usage
from aidsr.core.errors import AidsrError, UserError
from aidsr.core.plain_tree import require_plain_tree
from aidsr.runs import RUN_FILE, Run
from aidsr.runs.library import is_name
from aidsr.runs.status import State

if TYPE_CHECKING:
    from aidsr.core.config import Budget
    from aidsr.studies.budget import StudyBudget
    from aidsr.studies.outcomes import DesignRow
    from aidsr.studies.study import Cell, StudyPlan

_EVERY_S = 15.0
"""Maximum age of a reading. Our choice: a study lasts hours, and reading one of 200 designs takes about a second."""


JOBS = 2
"""Number of parallel jobs of a study that was never started here. Source: default of `aidsr benchmark`."""

_BETWEEN = "~"
"""Separator of study, arm, task and number in the name of a run; none of these parts contains it."""


@dataclass(frozen=True)
class RunOfStudy:
    """One run of a study as a page shows it."""

    name: str
    """Name of the run, part of its address; empty before the run has started."""
    arm: str
    task: str
    number: int
    state: State | None = None
    designs: int = 0
    approved: int = 0
    judged: int = 0
    """Number of designs with an evaluated policy."""
    successful: int = 0
    progress: float | None = None
    """Best progress that an open-loop motion reached on any of its designs; None where no design was probed."""


@dataclass(frozen=True)
class StudyView:
    """A study as a page shows it; if it cannot be read, only `complaint` is set."""

    key: str
    """Identifier of the study, part of its address."""
    name: str
    complaint: str = ""
    runs: int = 0
    runs_done: int = 0
    started: int = 0
    """Number of runs and policies that are started and not finished. Whether a process still works on them is not known
    here, because a study may run on other machines."""
    policies: int = 0
    """Number of evaluated policies."""
    failed: int = 0
    """Number of jobs that were given up after their last attempt."""
    jobs_left: int = 0
    core_hours_left: float = 0.0
    usage: Usage = field(default_factory=Usage)
    to_spend_usd: float = 0.0
    left: tuple[str, ...] = ()
    """Remainder of each limit of the study, in words; empty for a study without limits."""
    report: bool = False
    cells: tuple[RunOfStudy, ...] = ()
    asks: str = ""
    """Summary of the plan, in words."""
    failures: tuple[str, ...] = ()
    """Descriptions of the last failed attempts at jobs."""
    at_work: bool = False
    """Whether a process started by this app works on the study."""


class Studies:
    """The studies in the folder of runs, and those named when the web app was started.

    Args:
        runs: Folder of the runs; each folder in it with a study.toml is a study.
        processes: Processes started by this app.
        more: Folders of studies outside the folder of runs.
    """

    def __init__(self, runs: Path, processes: Processes, more: Sequence[Path] = ()) -> None:
        self._runs, self._processes, self._more = runs, processes, tuple(more)
        self._known: tuple[StudyView, ...] = ()
        self._read_s = -float("inf")
        self._reading = threading.Lock()

    def views(self) -> tuple[StudyView, ...]:
        """Return the state of the studies as last read; if that is too old, read them again in the background."""
        if time.monotonic() - self._read_s > _EVERY_S and self._reading.acquire(blocking=False):
            threading.Thread(target=self._read, name="read studies", daemon=True).start()
        return self._known

    def report(self, key: str) -> Path:
        """Return the report of a study.

        Raises:
            UserError: There is no such study, it holds links or other special files, or it has no report yet.
        """
        folder = self.folder(key)
        require_plain_tree(folder)
        report = folder / "report.html"
        if not report.is_file():
            raise UserError("the study has no report yet; write it with: aidsr report STUDY")
        return report

    def folder(self, key: str) -> Path:
        """Return the folder of a study.

        Raises:
            UserError: There is no such study.
        """
        found = self._folders().get(key)
        if found is None:
            raise UserError(f'"{key[:80]}" is not a study: no folder of this name with a study.toml found')
        return found

    def view(self, key: str) -> StudyView:
        """Return the state of a study as last read; read it now if it was never read.

        Raises:
            UserError: There is no such study.
        """
        folder = self.folder(key)
        known = next((view for view in self.views() if view.key == key), None)
        return known or self._view(key, folder)

    def run(self, name: str) -> Run:
        """Return a run of a study by its name, "STUDY~ARM~TASK~NUMBER".

        Raises:
            UserError: There is no such run, or it or its study holds links or other special files.
        """
        key, *parts = name.split(_BETWEEN)
        if len(parts) == 3 and all(is_name(part) for part in parts):
            study = self.folder(key)
            home = study.joinpath("runs", *parts)
            for file in sorted(home.glob(f"*/{RUN_FILE}")):
                require_plain_tree(study)
                require_plain_tree(home)
                return Run(file.parent, name)
        raise UserError(f'"{name[:80]}" is not a run of a study that has started')

    @staticmethod
    def study_of(name: str) -> str:
        """Return the key of the study that a run's name contains; empty for a run that belongs to no study."""
        key, between, _ = name.partition(_BETWEEN)
        return key if between else ""

    def process(self, key: str) -> str:
        """Return the name of the process that works on a study."""
        return f"{key}{_BETWEEN}study"

    def resume(self, key: str, jobs: int | None = None) -> None:
        """Start a process that works on a study until it is finished.

        Args:
            key: Key of the study.
            jobs: Number of parallel jobs; None for as many as in the process before, or `JOBS` where there was none.

        Raises:
            UserError: There is no such study, or a process already works on it.
        """
        jobs = jobs or self._jobs(key) or JOBS
        command = ["benchmark", str(self.folder(key)), "--resume", "--jobs", str(jobs)]
        self._processes.start(self.process(key), command)
        self._read_s = -float("inf")

    def jobs(self, key: str) -> int:
        """Return the number of parallel jobs of the process that works on a study; 1 where that is unknown."""
        return self._jobs(key) or 1

    def _jobs(self, key: str) -> int:
        """Return the number of parallel jobs of the last process of a study; 0 where that is unknown."""
        command = self._processes.command(self.process(key))
        return int(command[command.index("--jobs") + 1]) if "--jobs" in command else 0

    def stop(self, key: str) -> None:
        """Ask the process that works on a study to end; finished work is kept.

        Raises:
            UserError: No running process of this study was started by this app.
        """
        if not self._processes.stop(self.process(key)):
            raise UserError("this study was not started in the web app; stop it with Control-C where it was started")
        self._read_s = -float("inf")

    def is_running(self, key: str) -> bool:
        """Whether a process started by this app works on a study."""
        return self._processes.is_alive(self.process(key))

    def output_tail(self, key: str) -> str:
        """Return the last output of the process that worked on a study."""
        return self._processes.output_tail(self.process(key))

    def _folders(self) -> dict[str, Path]:
        """Return the folders of the studies by key: a folder's name, with a suffix as in "name-2" if it is taken."""
        beside = sorted(self._runs.iterdir()) if self._runs.is_dir() else []
        found: dict[str, Path] = {}
        without_key: list[tuple[str, Path]] = []
        for path in (*beside, *self._more):
            if _is_study(path):
                name = path.resolve().name
                if is_name(name) and name not in found:
                    found[name] = path
                else:
                    without_key.append((name if is_name(name) else "study", path))
        for name, path in without_key:  # last, so that no suffix takes the name of another folder
            found[next(key for number in count(2) if (key := f"{name}-{number}") not in found)] = path
        return found

    def _view(self, key: str, path: Path) -> StudyView:
        return replace(_view(key, path), at_work=self.is_running(key))

    def _read(self) -> None:
        try:
            self._known = tuple(self._view(key, path) for key, path in self._folders().items())
        finally:
            self._read_s = time.monotonic()
            self._reading.release()


def _is_study(path: Path) -> bool:
    from aidsr.studies.study import STUDY_FILE

    try:
        return (path / STUDY_FILE).is_file()
    except OSError:  # a folder that may not be read, such as lost+found
        return False


def _view(key: str, path: Path) -> StudyView:
    from aidsr.runs import read_status
    from aidsr.runs.trainings import trainings_of
    from aidsr.studies.budget import StudyBudget, read_budget
    from aidsr.studies.estimate import estimate_study
    from aidsr.studies.outcomes import paid_usd, read_outcomes
    from aidsr.studies.runner import MOST_ATTEMPTS, read_failures
    from aidsr.studies.study import open_study

    try:
        study = open_study(path)
        rows, left = read_outcomes(study), estimate_study(study)
        runs = {cell: run for cell in study.cells if (run := study.run(cell)) is not None}
        states = {cell: read_status(run).state for cell, run in runs.items()}
        finished = sum(state == "finished" for state in states.values())
        trainings = [training for run in runs.values() for design in run.designs for training in trainings_of(design)]
        learning = sum(not training.evaluation.path.exists() for training in trainings)
        failures = read_failures(study)
        given_up = {str(one["job"]) for one in failures if one["attempt"] == MOST_ATTEMPTS}
        return StudyView(
            key,
            path.name,
            runs=len(list(study.cells)),
            runs_done=finished,
            started=len(runs) - finished + learning,
            policies=sum(len(row.evaluations) for row in rows),
            failed=len(given_up),
            jobs_left=sum(left.jobs.values()),
            core_hours_left=left.core_hours,
            usage=sum((row.usage for row in rows), Usage()).model_copy(update={"cost_usd": paid_usd(study, rows)}),
            to_spend_usd=left.cost_usd,
            left=tuple(_left(StudyBudget(study, read_budget(study)), read_budget(study))),
            report=(path / "report.html").is_file(),
            cells=tuple(_cell(key, cell, states.get(cell), rows) for cell in study.cells),
            asks=_asks(study.plan),
            failures=tuple(f"{one['job']}, attempt {one['attempt']}: {one['error']}" for one in failures[-5:]),
        )
    except AidsrError as error:
        return StudyView(key, path.name, str(error))


def _cell(key: str, cell: Cell, state: State | None, rows: Sequence[DesignRow]) -> RunOfStudy:
    own = [row for row in rows if (row.arm, row.task, row.run) == (cell.arm, cell.task, cell.number)]
    reached = [row.probe_progress for row in own if row.probe_progress is not None]
    return RunOfStudy(
        _BETWEEN.join((key, *cell.name.split("/"))) if state is not None else "",
        cell.arm,
        cell.task,
        cell.number,
        state,
        designs=len(own),
        approved=sum(row.outcome == "approved" for row in own),
        judged=sum(bool(row.evaluations) for row in own),
        successful=sum(row.successful for row in own),
        progress=max(reached, default=None),
    )


def _asks(plan: StudyPlan) -> str:
    from aidsr.core.formatting import counted
    from aidsr.studies.report import format_training

    return (
        f"{counted(len(plan.tasks), 'task')} at the {plan.level} level, {counted(len(plan.arms), 'arm')}, "
        f"{counted(plan.runs, 'run')} per task and arm; {format_training(plan.seeds, plan.steps, plan.protocol)}."
    )


def _left(budget: StudyBudget, limit: Budget) -> Iterator[str]:
    """Yield the remainder of each limit, in words; what running jobs have not used yet counts as remaining."""
    if limit.cost_usd is not None:
        yield f"${max(0.0, limit.cost_usd - budget.paid_usd):.2f} of ${limit.cost_usd:.2f} remaining"
    if limit.tokens is not None:
        yield f"{max(0, limit.tokens - budget.tokens):,} of {limit.tokens:,} tokens remaining"
