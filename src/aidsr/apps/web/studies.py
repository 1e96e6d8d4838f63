"""Progress of studies of many runs: read from their folders periodically, in a separate thread."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from aidsr.core.calls import Usage
from aidsr.core.errors import AidsrError, UserError

if TYPE_CHECKING:
    from aidsr.core.config import Budget
    from aidsr.studies.budget import StudyBudget

_EVERY_S = 15.0
"""How old a reading may be. Our choice: a study lasts hours, and reading one of 200 designs takes about a second."""


@dataclass(frozen=True)
class StudyView:
    """A study as a page shows it; where it cannot be read there is only a complaint."""

    key: str
    """Part of its address."""
    name: str
    complaint: str = ""
    runs: int = 0
    runs_done: int = 0
    started: int = 0
    """Runs and policies that are started and not finished; whether a process works on them only a terminal knows, as
    a study may run on other machines."""
    policies: int = 0
    """Judged."""
    failed: int = 0
    """Jobs that were given up."""
    jobs_left: int = 0
    core_hours_left: float = 0.0
    usage: Usage = field(default_factory=Usage)
    to_spend_usd: float = 0.0
    left: tuple[str, ...] = ()
    """What is left of each limit of the study, in words; empty for one without."""
    report: bool = False


class Studies:
    """The studies beside the runs, and those named by the person who started the web app.

    Args:
        runs: Folder of the runs; studies are folders in it with a study.toml.
        more: Other folders of studies.
    """

    def __init__(self, runs: Path, more: Sequence[Path] = ()) -> None:
        self._runs, self._more = runs, tuple(more)
        self._known: tuple[StudyView, ...] = ()
        self._read_s = -float("inf")
        self._reading = threading.Lock()

    def views(self) -> tuple[StudyView, ...]:
        """Return the state of the studies when last read, and read them again in the background if that is old."""
        if time.monotonic() - self._read_s > _EVERY_S and self._reading.acquire(blocking=False):
            threading.Thread(target=self._read, name="read studies", daemon=True).start()
        return self._known

    def report(self, key: str) -> Path:
        """Return the report of a study.

        Raises:
            UserError: There is no such study, or no report of it yet.
        """
        folder = self._folders().get(key)
        if folder is None or not (folder / "report.html").is_file():
            raise UserError("the study has no report yet; aidsr report STUDY writes it")
        return folder / "report.html"

    def _folders(self) -> dict[str, Path]:
        beside = sorted(self._runs.iterdir()) if self._runs.is_dir() else []
        found = [path for path in (*beside, *self._more) if (path / "study.toml").is_file()]
        return {str(number): path for number, path in enumerate(found, 1)}

    def _read(self) -> None:
        try:
            self._known = tuple(_view(key, path) for key, path in self._folders().items())
        finally:
            self._read_s = time.monotonic()
            self._reading.release()


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
        runs = [run for cell in study.cells if (run := study.run(cell)) is not None]
        finished = sum(read_status(run).state == "finished" for run in runs)
        trainings = [training for run in runs for design in run.designs for training in trainings_of(design)]
        learning = sum(not training.evaluation.path.exists() for training in trainings)
        given_up = {str(one["job"]) for one in read_failures(study) if one["attempt"] == MOST_ATTEMPTS}
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
        )
    except AidsrError as error:
        return StudyView(key, path.name, str(error))


def _left(budget: StudyBudget, limit: Budget) -> Iterator[str]:
    """Yield what is left of each limit; what runs at work have not used counts as left."""
    if limit.cost_usd is not None:
        yield f"${max(0.0, limit.cost_usd - budget.paid_usd):.2f} left of ${limit.cost_usd:.2f}"
    if limit.tokens is not None:
        yield f"{max(0, limit.tokens - budget.tokens):,} tokens left of {limit.tokens:,}"
