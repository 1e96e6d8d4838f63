"""What all pages share: the runs, the processes at work on them, and the state of each run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from aidsr.apps.web.processes import Processes
from aidsr.apps.web.studies import Studies
from aidsr.core.errors import UserError
from aidsr.runs import DesignFolder, DesignStatus, Library, Run, RunStatus, read_status
from aidsr.runs.events import at_work
from aidsr.runs.library import fingerprint
from aidsr.runs.stages import Attempt, attempts
from aidsr.runs.status import State, newest
from aidsr.runs.trainings import Training, best_verdict, trainings_of, verdicts_of
from aidsr.teams.providers.manual import pending_prompts, prompts_directory

if TYPE_CHECKING:
    from aidsr.apps.web.work import Work

Shown = State | Literal["interrupted"]
"""A run's state, and "interrupted" where the files say "running" and no process is."""
Fingerprint = tuple[tuple[str, int, int], ...]


@dataclass(frozen=True)
class DesignView:
    """A design as a page shows it."""

    status: DesignStatus
    attempts: tuple[Attempt, ...]
    picture: str
    """Newest picture, relative to the run; empty where there is none."""
    motion: str
    trainings: tuple[Training, ...]
    """Its policies, those that still learn among them."""
    trained: int
    """How many policies were judged."""
    valid: bool
    """Its best policy, see `aidsr.runs.trainings.best_verdict`."""
    successful: bool
    """The same policy."""
    held_out: tuple[int, int] | None
    """Held-out episodes that this policy won, and of how many; None where none was judged."""
    warnings: int
    """Of the validator, at the iteration it stands at."""
    since: str
    """When something last happened to it, ISO 8601; empty before the first event."""


@dataclass(frozen=True)
class Job:
    """A process at work on a design: started by the web app, or a training that a study or a terminal does."""

    number: int
    """Of the design."""
    kind: Literal["training", "export", "probe"]
    process: str
    """Its name among the processes; empty where it was started elsewhere."""


@dataclass(frozen=True)
class RunView:
    """A run as a page shows it."""

    name: str
    status: RunStatus
    designs: tuple[DesignView, ...]
    shown: Shown
    since: str
    """When something last happened to the run itself, ISO 8601; empty before the first event."""
    jobs: tuple[Job, ...] = ()
    """Trainings, exports and probes at work."""
    prompts: int = 0
    """How many questions wait for a person's reply."""

    @property
    def title(self) -> str:
        """The task's name, or what is to be done in a few words."""
        record = self.status.record
        named = record.task.rpartition("/")[2].replace("_", " ")
        return named or shortened(record.objective)

    @property
    def awaited(self) -> int:
        """How many decisions and replies wait for a person."""
        return self.prompts + sum(design.status.state == "waiting" for design in self.designs)

    def design(self, number: int) -> DesignView:
        """Return one design by its number.

        Raises:
            UserError: There is none of that number.
        """
        return self.designs[self.status.designs.index(self.status.design(number))]


@dataclass(frozen=True)
class Site:
    """The folder of runs that the web app shows."""

    library: Library
    processes: Processes
    studies: Studies
    _read: dict[str, tuple[Fingerprint, RunStatus, tuple[DesignView, ...]]] = field(default_factory=dict)
    """By name, what was read when the files last had this fingerprint."""

    @classmethod
    def at(cls, runs: Path, studies: Sequence[Path] = ()) -> Site:
        """Return the site for a folder of runs, and for studies that lie elsewhere."""
        runs = runs.resolve()  # what is written into a run must hold wherever it is taken up again
        processes = Processes(runs / ".web" / "processes")
        return cls(Library(runs), processes, Studies(runs, processes, studies))

    @cached_property
    def work(self) -> Work:
        """What is at work, read for all open pages together."""
        from aidsr.apps.web.work import Work

        return Work(self)

    @property
    def own(self) -> Path:
        """Folder for what belongs to the web app and to no run."""
        return self.library.path / ".web"

    def run(self, name: str) -> Run:
        """Return a run by its name, or a run of a study by its name there.

        Raises:
            UserError: There is none.
        """
        return self.studies.run(name) if self.studies.study_of(name) else self.library.run(name)

    def way_to(self, name: str) -> tuple[tuple[str, str], ...]:
        """Return text and address of the pages above that of a run: all runs, or its study."""
        study = self.studies.study_of(name)
        return (("Runs", "/"), (study, f"/study/{study}")) if study else (("Runs", "/"),)

    def view(self, run: Run) -> RunView:
        """Return the state of a run; read again only when its files changed.

        Raises:
            UserError: The folder is not a run, or one of its files is damaged.
        """
        name, mark = run.name, fingerprint(run)
        known = self._read.get(name)
        if known is None or known[0] != mark:
            status = read_status(run)
            designs = tuple(_design(run, run.design(each.number), each) for each in status.designs)
            known = self._read[name] = (mark, status, designs)
        _, status, designs = known
        shown: Shown = status.state
        prompts = 0
        if shown == "running" and not self.is_at_work(run):
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

    def is_at_work(self, run: Run) -> bool:
        """Whether a process is at work on a run, started here or in a terminal."""
        return self.processes.is_alive(run.name) or bool(at_work(run.events))

    def refuse_at_work(self, run: Run) -> None:
        """Refuse what must not be done to a run while a process works on it.

        Raises:
            UserError: A process works on it.
        """
        if self.is_at_work(run):
            raise UserError(f"{run.name} is already running; wait for it, or stop it first")

    def resume(self, run: Run) -> None:
        """Start a process that works on a run until it is finished.

        Raises:
            UserError: One is at work already.
        """
        self.refuse_at_work(run)
        self.processes.start(run.name, ["resume", str(run.path)])

    def design(self, run_name: str, number: int) -> tuple[Run, DesignFolder]:
        """Return a design by the names of an address.

        Raises:
            UserError: There is no such run or design.
        """
        run = self.run(run_name)
        design = run.design(number)
        if not design.path.is_dir():
            raise UserError(f"{run_name} has no design {number} yet")
        return run, design

    def trash(self, name: str) -> None:
        """Move a run that no process works on to the trash.

        Raises:
            UserError: There is no such run, or a process designs, trains or exports there.
        """
        run = self.library.run(name)
        self.refuse_at_work(run)
        for job in (job for each in run.designs for job in self._jobs(run, each.number, trainings_of(each))):
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
"""Of an objective where it stands for the run. Our choice: one line."""


def shortened(words: str) -> str:
    """Return a text of people or models cut to the length of a title."""
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
        attempts=attempts(design, status),
        picture=picture.relative_to(run.path).as_posix() if picture else "",
        motion=motion.relative_to(run.path).as_posix() if motion else "",
        trainings=trainings,
        trained=len(verdicts),
        valid=best is not None and best.valid,
        successful=best is not None and best.successful,
        held_out=(sum(each.ended == "succeeded" for each in best.episodes), len(best.episodes)) if best else None,
        warnings=len(report.warnings) if report else 0,
        since=_changed(design.events),
    )


def _changed(log: Path) -> str:
    """When a log was last written to; a page lets a clock run from there."""
    try:
        return datetime.fromtimestamp(log.stat().st_mtime, UTC).isoformat(timespec="seconds")
    except FileNotFoundError:
        return ""


def state_of(shown: Shown, design: DesignView) -> str:
    """Return the state of a design without an outcome: what its files call running may be interrupted, or wait."""
    state = design.status.state
    return shown if state == "running" and shown in ("interrupted", "waiting") else state


def model_in_words(model: str) -> str:
    """Return a model's name as pages show it: of prompts answered by hand not the folder they wait in."""
    return "by hand" if prompts_directory(model) else model
