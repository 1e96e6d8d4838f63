"""State that all pages share: the runs, the processes at work on them, and the status of each run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from aidsr.apps.web.addresses import study_address
from aidsr.apps.web.processes import Processes
from aidsr.apps.web.studies import Studies
from aidsr.core.errors import UserError
from aidsr.core.formatting import iso_time, task_title
from aidsr.core.storage_errors import storage_errors
from aidsr.runs import DesignFolder, DesignStatus, Library, Run, RunStatus, read_status
from aidsr.runs.events import at_work
from aidsr.runs.library import fingerprint
from aidsr.runs.stages import IterationStages, iteration_stages
from aidsr.runs.status import State, newest
from aidsr.runs.trainings import Training, best_verdict, trainings_of, verdicts_of
from aidsr.teams.providers.manual import pending_prompts, prompts_directory

if TYPE_CHECKING:
    from aidsr.apps.web.activities import Activities

Shown = State | Literal["interrupted"]
"""State of a run as shown: "interrupted" where the files say "running" but no process works on the run."""
Fingerprint = tuple[tuple[str, int, int], ...]


@dataclass(frozen=True)
class DesignView:
    """A design as a page shows it."""

    status: DesignStatus
    iterations: tuple[IterationStages, ...]
    picture: str
    """Path of the newest picture, relative to the run; empty where there is none."""
    motion: str
    trainings: tuple[Training, ...]
    """All trainings of the design, including those still learning."""
    evaluated: int
    """Number of evaluated policies."""
    valid: bool
    """Whether its best policy is valid, see `aidsr.runs.trainings.best_verdict`."""
    successful: bool
    """Whether the same policy is successful."""
    held_out: tuple[int, int] | None
    """Number of successful held-out episodes of that policy, and of all; None where no policy was evaluated."""
    warnings: int
    """Number of warnings of the validator at the iteration `status.stands_at`."""
    since: str
    """Time of the design's last event, ISO 8601; empty before the first event."""


@dataclass(frozen=True)
class Job:
    """A process at work on a design: started by the web app, or a training started by a study or in a terminal."""

    number: int
    """Number of the design."""
    kind: Literal["training", "export", "probe"]
    process: str
    """Name of the process in `Processes`; empty where it was started elsewhere."""


@dataclass(frozen=True)
class RunView:
    """A run as a page shows it."""

    name: str
    status: RunStatus
    designs: tuple[DesignView, ...]
    shown: Shown
    since: str
    """Time of the last event of the run itself, ISO 8601; empty before the first event."""
    jobs: tuple[Job, ...] = ()
    """Running trainings, exports and probes."""
    prompts: int = 0
    """Number of prompts that wait for a person's reply."""

    @property
    def title(self) -> str:
        """The task's name, or the objective in a few words."""
        record = self.status.record
        return task_title(record.task) or shortened(record.objective)

    @property
    def awaited(self) -> int:
        """Number of decisions and replies that wait for a person."""
        return self.prompts + sum(design.status.state == "waiting" for design in self.designs)

    def design(self, number: int) -> DesignView:
        """Return one design by its number.

        Raises:
            UserError: There is no design of that number.
        """
        return self.designs[self.status.designs.index(self.status.design(number))]


@dataclass(frozen=True)
class Site:
    """The folder of runs that the web app shows."""

    library: Library
    processes: Processes
    studies: Studies
    _read: dict[str, tuple[Fingerprint, RunStatus, tuple[DesignView, ...]]] = field(default_factory=dict)
    """What was last read of each run, by the run's name, with the fingerprint of the run's files at that time."""

    @classmethod
    def at(cls, runs: Path, studies: Sequence[Path] = ()) -> Site:
        """Return the site for a folder of runs, and for studies in other folders."""
        runs = runs.resolve()  # paths written into a run must be valid from any directory in which it is resumed
        processes = Processes(runs / ".web" / "processes")
        return cls(Library(runs), processes, Studies(runs, processes, studies))

    @cached_property
    def activities(self) -> Activities:
        """What is running and waiting, read once for all open pages."""
        from aidsr.apps.web.activities import Activities

        return Activities(self)

    @property
    def own(self) -> Path:
        """Folder for files that belong to the web app and to no run."""
        return self.library.path / ".web"

    def run(self, name: str) -> Run:
        """Return a run by its name; for a run of a study that is "STUDY~ARM~TASK~NUMBER".

        Raises:
            UserError: There is no such run.
        """
        return self.studies.run(name) if self.studies.study_of(name) else self.library.run(name)

    def way_to(self, name: str) -> tuple[tuple[str, str], ...]:
        """Return text and address of each page above a run's page: all runs, then the run's study if it has one."""
        study = self.studies.study_of(name)
        return (("Runs", "/"), (study, study_address(study))) if study else (("Runs", "/"),)

    def view(self, run: Run) -> RunView:
        """Return the state of a run; its files are read again only when they changed.

        Raises:
            UserError: The folder is not a run, or one of its files is damaged.
            StorageError: A file or folder of the run cannot be read, as without the permission.
        """
        with storage_errors(run.path):
            return self._view(run)

    def _view(self, run: Run) -> RunView:
        name, mark = run.name, fingerprint(run)
        known = self._read.get(name)
        if known is None or known[0] != mark:
            status = read_status(run)
            designs = tuple(_design(run, run.design(each.number), each) for each in status.designs)
            known = self._read[name] = (mark, status, designs)
        _, status, designs = known
        shown: Shown = status.state
        prompts = 0
        if shown == "running" and not self.is_running(run):
            shown = "interrupted"
        elif shown == "running" and (directory := prompts_directory(status.record.config.model)) is not None:
            prompts = len(pending_prompts(directory))
            shown = "waiting" if prompts else shown
        jobs = tuple(job for each in designs for job in self._jobs(run, each.status.number, each.trainings))
        return RunView(name, status, designs, shown, _changed(run.events), jobs, prompts)

    def _jobs(self, run: Run, number: int, trainings: Sequence[Training]) -> Iterator[Job]:
        kinds: tuple[tuple[Literal["training", "export", "probe"], str], ...] = (
            ("training", self.training_name(run, number)),
            ("export", self.export_name(run, number)),
            ("probe", self.probe_name(run, number)),
        )
        for kind, process in kinds:
            if self.processes.is_alive(process):
                yield Job(number, kind, process)
            elif kind == "training" and any(training.at_work for training in trainings):
                yield Job(number, kind, "")

    def is_running(self, run: Run) -> bool:
        """Whether a process works on a run, started by the web app or in a terminal."""
        return self.processes.is_alive(run.name) or bool(at_work(run.events))

    def unexplained_output(self, run: Run, view: RunView) -> str:
        """Return the last output of a run's process that ended without recording why; empty otherwise.

        A process that refuses to start, as without a key, records nothing at all.
        """
        if view.status.state == "finished" or self.is_running(run):
            return ""
        logs = (run.events, *(run.design(each.status.number).events for each in view.designs))
        last_event_s = max((log.stat().st_mtime for log in logs if log.exists()), default=0.0)
        refused = self.processes.started_s(run.name) > last_event_s
        silent = view.shown == "interrupted" or (view.shown == "stopped" and not view.status.stopped)
        return self.processes.output_tail(run.name) if refused or silent else ""

    def refuse_running(self, run: Run) -> None:
        """Refuse an action that is not allowed while a process works on a run.

        Raises:
            UserError: A process works on the run.
        """
        if self.is_running(run):
            raise UserError(f"{run.name} is already running; wait for it, or stop it first")

    def resume(self, run: Run) -> None:
        """Start a process that works on a run until it is finished.

        Raises:
            UserError: A process already works on the run.
        """
        self.refuse_running(run)
        self.processes.start(run.name, ["resume", str(run.path)])

    def design(self, run_name: str, number: int) -> tuple[Run, DesignFolder]:
        """Return a run and its design by the names in an address.

        Raises:
            UserError: There is no such run or design.
        """
        run = self.run(run_name)
        design = run.design(number)
        if not design.path.is_dir():
            there = ", ".join(str(each.number) for each in run.designs) or "none yet"
            raise UserError(f"{run_name} has no design {number}; it has: {there}")
        return run, design

    def trash(self, name: str) -> None:
        """Move a run that no process works on to the trash.

        Raises:
            UserError: There is no such run, or a process still designs, trains, exports or probes in it.
        """
        run = self.library.run(name)
        self.refuse_running(run)
        jobs = (job for each in run.designs for job in self._jobs(run, each.number, trainings_of(each)))
        if job := next(jobs, None):
            raise UserError(f"design {job.number} has a running {job.kind}; stop it first, then delete {name}")
        self.library.trash(name)

    def training_name(self, run: Run, number: int) -> str:
        """Return the name of the process that trains a design."""
        return f"{run.name}.design{number}.training"

    def export_name(self, run: Run, number: int) -> str:
        """Return the name of the process that exports a design."""
        return f"{run.name}.design{number}.export"

    def probe_name(self, run: Run, number: int) -> str:
        """Return the name of the process that probes a design."""
        return f"{run.name}.design{number}.probe"


_TITLE_CHARACTERS = 80
"""Maximum length of an objective that serves as the title of its run. Our choice: one line."""


def shortened(words: str) -> str:
    """Return a text written by a person or a model, shortened to the length of a title."""
    line = " ".join(words.split())
    return line if len(line) <= _TITLE_CHARACTERS else f"{line[: _TITLE_CHARACTERS - 1].rstrip()}…"


def _design(run: Run, design: DesignFolder, status: DesignStatus) -> DesignView:
    trainings = trainings_of(design)
    verdicts = verdicts_of(design)
    best = best_verdict(verdicts)
    stands = design.iteration(status.stands_at)
    report = stands.scene_report.read() or stands.robot_report.read()
    newest_first = design.leading_to(status.stands_at)
    picture = newest(it.preview.path if it.preview.path.exists() else None for it in newest_first)
    motion = newest(it.motion.path if it.motion.path.exists() else None for it in newest_first)
    return DesignView(
        status=status,
        iterations=iteration_stages(design, status),
        picture=picture.relative_to(run.path).as_posix() if picture else "",
        motion=motion.relative_to(run.path).as_posix() if motion else "",
        trainings=trainings,
        evaluated=len(verdicts),
        valid=best is not None and best.valid,
        successful=best is not None and best.successful,
        held_out=(sum(each.ended == "succeeded" for each in best.episodes), len(best.episodes)) if best else None,
        warnings=len(report.warnings) if report else 0,
        since=_changed(design.events),
    )


def _changed(log: Path) -> str:
    """Return when a log was last written to, ISO 8601; a page counts up from that time."""
    try:
        return iso_time(log.stat().st_mtime)
    except FileNotFoundError:
        return ""


def state_of(shown: Shown, design: DesignView) -> str:
    """Return the state of a design, or its outcome: "running" in its files may mean interrupted or waiting."""
    if design.status.outcome:
        return design.status.outcome.outcome
    state = design.status.state
    return shown if state == "running" and shown in ("interrupted", "waiting") else state


def model_in_words(model: str) -> str:
    """Return a model's name as pages show it: "by hand" instead of the folder of prompts answered by hand."""
    return "by hand" if prompts_directory(model) else model
