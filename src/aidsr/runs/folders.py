"""Classes for the folders of a run, with properties for their files.

    Run -> DesignFolder -> IterationFolder

`aidsr.runs.layout` lists all files that other programs may rely on.
"""

from __future__ import annotations

import re
import secrets
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from aidsr.core.arguments import check_type
from aidsr.core.artifacts import (
    Brief,
    Concept,
    Critique,
    Decision,
    Outcome,
    Placement,
    Repairs,
    Robot,
    Scene,
    TaskReport,
    ValidationReport,
)
from aidsr.core.calls import CallRecord
from aidsr.core.config import Budget
from aidsr.core.errors import UserError
from aidsr.core.numbered import numbered_in
from aidsr.core.plain_tree import require_plain_tree
from aidsr.runs.answered_calls import calls_in
from aidsr.runs.files import BytesFile, JsonFile, MjcfFile
from aidsr.runs.origin import mark_as_ours
from aidsr.runs.record import RunRecord

RUN_FILE = "run.json"
"""Name of the file by which a folder is known as a run."""


@dataclass(frozen=True)
class IterationFolder:
    """One iteration of a design: what changed in it, and the results."""

    path: Path

    @property
    def number(self) -> int:
        """Number of the iteration, counted from 1 within the design over all rounds."""
        return int(self.path.name)

    @property
    def concept(self) -> JsonFile[Concept]:
        """The concept; in iteration 1 and wherever the Designer revised it."""
        return JsonFile(self.path / "concept.json", Concept)

    @property
    def robot(self) -> MjcfFile[Robot]:
        """The robot after automatic fixes; in iterations in which the Coder wrote or changed it."""
        return MjcfFile(self.path, "robot", Robot)

    @property
    def robot_as_written(self) -> BytesFile:
        """The Coder's MJCF, where automatic fixes changed it."""
        return BytesFile(self.path / "robot_as_written.xml")

    @property
    def repairs(self) -> JsonFile[Repairs]:
        """The automatic fixes, where any were made."""
        return JsonFile(self.path / "repairs.json", Repairs)

    @property
    def robot_report(self) -> JsonFile[ValidationReport]:
        """The validator's report on the robot alone."""
        return JsonFile(self.path / "robot_report.json", ValidationReport)

    @property
    def placement(self) -> JsonFile[Placement]:
        """The placement; in iterations in which the Scene Integrator decided it."""
        return JsonFile(self.path / "placement.json", Placement)

    @property
    def scene(self) -> MjcfFile[Scene]:
        """The robot in the environment; absent when they could not be assembled."""
        return MjcfFile(self.path, "scene", Scene)

    @property
    def scene_report(self) -> JsonFile[ValidationReport]:
        """The report on the scene, by the assembly or the validator."""
        return JsonFile(self.path / "scene_report.json", ValidationReport)

    @property
    def preview(self) -> BytesFile:
        """A picture of the scene, or of the robot where there is no scene, as PNG."""
        return BytesFile(self.path / "preview.png")

    @property
    def critique(self) -> JsonFile[Critique]:
        """The Judge's verdict."""
        return JsonFile(self.path / "critique.json", Critique)

    @property
    def motion(self) -> BytesFile:
        """Moments of the scene while its actuators swing, as PNG."""
        return BytesFile(self.path / "motion.png")

    @property
    def task_report(self) -> JsonFile[TaskReport]:
        """Where the stable scene stopped on its task; only if it was tried."""
        return JsonFile(self.path / "task_report.json", TaskReport)

    @property
    def measured_again(self) -> JsonFile[TaskReport]:
        """A second task report, by seeds and variations other than those of the selection.

        Only where several scenes failed the task and one of them is kept.
        """
        return JsonFile(self.path / "measured_again.json", TaskReport)

    @property
    def decision(self) -> JsonFile[Decision]:
        """The person's decision."""
        return JsonFile(self.path / "decision.json", Decision)

    @property
    def calls(self) -> tuple[CallRecord, ...]:
        """All answered calls of this iteration."""
        return calls_in(self.path)


@dataclass(frozen=True)
class DesignFolder:
    """Folder of one design: everything made from one concept."""

    path: Path

    @property
    def number(self) -> int:
        """Number of the design, counted from 1 within the run."""
        return int(self.path.name)

    @property
    def run(self) -> Run:
        """The run of the design, also if the path is relative to a folder inside the run, such as "."."""
        path = self.path if self.path.parent.name == "designs" else self.path.resolve()
        return Run(path.parent.parent)

    @property
    def events(self) -> Path:
        """The design's event log."""
        return self.path / "events.jsonl"

    @property
    def outcome(self) -> JsonFile[Outcome]:
        """How the design ended; written last."""
        return JsonFile(self.path / "outcome.json", Outcome)

    def reopen(self) -> None:
        """Rename the outcome of a design that ran out of budget, so that work on it can continue."""
        outcome = self.outcome.read()
        if outcome is not None and outcome.outcome == "out_of_budget":
            before = len(list(self.path.glob("outcome_before_*.json")))
            self.outcome.path.rename(self.path / f"outcome_before_{before + 1}.json")

    @property
    def final_scene(self) -> BytesFile:
        """MJCF of the approved scene."""
        return BytesFile(self.path / "final.xml")

    def require_whole(self) -> None:
        """Refuse a truncated final scene or robot, as after an interrupted copy.

        Raises:
            UserError: The end of the document is missing, or the file is not UTF-8 text.
        """
        for file in (self.final_scene, self.final_robot):
            content = file.read()
            if content is None:
                continue
            try:
                problem = "" if "</mujoco>" in content.decode() else "its document has no end"
            except UnicodeDecodeError:
                problem = "it is not UTF-8 text"
            if problem:
                raise UserError(f"{file.path} is damaged: {problem}; restore it, or start the design again")

    @property
    def final_robot(self) -> BytesFile:
        """MJCF of the approved robot alone."""
        return BytesFile(self.path / "final_robot.xml")

    @property
    def probe(self) -> Path:
        """File with the report of the design's probe, an `aidsr.learn.openloop.ProbeReport`."""
        return self.path / "probe.json"

    @property
    def probe_picture(self) -> Path:
        """Moments of the best motion of that probe, as PNG."""
        return self.probe.with_suffix(".png")

    @property
    def trainings(self) -> Path:
        """Folder of its trainings, see `aidsr.runs.trainings`."""
        return self.path / "training"

    def iteration(self, number: int) -> IterationFolder:
        """Return the folder of one iteration, which need not exist."""
        return IterationFolder(self.path / f"{number:02d}")

    @property
    def iterations(self) -> tuple[IterationFolder, ...]:
        """The iterations so far, in order."""
        return tuple(IterationFolder(path) for path in numbered_in(self.path))

    def leading_to(self, number: int | None = None) -> tuple[IterationFolder, ...]:
        """Return the iterations up to a given one, newest first.

        Each iteration holds only the files that changed in it, so the state of a design is found by searching these.

        Args:
            number: Last iteration to return. The default is the iteration that the outcome names, since the approved
                iteration need not be the last one, or the last iteration if there is no outcome.
        """
        if number is None and (outcome := self.outcome.read()):
            number = outcome.iteration
        return tuple(each for each in reversed(self.iterations) if number is None or each.number <= number)


@dataclass(frozen=True, init=False)
class Run:
    """Folder of a run: all designs from one objective.

    Attributes:
        path: The folder.
        name: Name of the run in lists; by default the name of the folder.
    """

    path: Path
    name: str = field(compare=False)

    def __init__(self, path: str | Path, name: str = "") -> None:
        check_type(path, (str, Path), "a run must be given as the path of its folder")
        object.__setattr__(self, "path", Path(path))
        object.__setattr__(self, "name", name or Path(path).name)

    @property
    def record(self) -> JsonFile[RunRecord]:
        """The request: objective, task, configuration, versions."""
        return JsonFile(self.path / RUN_FILE, RunRecord)

    @property
    def events(self) -> Path:
        """The run's event log."""
        return self.path / "events.jsonl"

    @property
    def goal(self) -> BytesFile:
        """Definition of success, where a goal was given with the environment."""
        return BytesFile(self.path / "goal.toml")

    @property
    def concepts(self) -> JsonFile[tuple[Concept, ...]]:
        """The concepts as proposed."""
        return JsonFile(self.path / "concepts.json", tuple[Concept, ...])

    @property
    def summary(self) -> Path:
        """Overview page of the run."""
        return self.path / "summary.html"

    @property
    def calls(self) -> tuple[CallRecord, ...]:
        """The Designer's answered calls."""
        return calls_in(self.path)

    def design(self, number: int) -> DesignFolder:
        """Return the folder of one design, which need not exist."""
        return DesignFolder(self.path / "designs" / str(number))

    @property
    def designs(self) -> tuple[DesignFolder, ...]:
        """The designs so far, in order."""
        return tuple(DesignFolder(path) for path in numbered_in(self.path / "designs"))

    def asked(self) -> RunRecord:
        """Return the request of the run.

        Raises:
            UserError: The folder is not a run, its run.json is damaged, or it contains links or other special files.
        """
        if self.path.is_file():
            raise UserError(f"{self.path} is a file, not a run folder; give the folder of a run, as runs/…")
        require_plain_tree(self.path)
        record = self.record.read()
        if record is None:
            raise UserError(f"{self.path} is not a run folder: run.json not found; give the folder of a run, as runs/…")
        return record

    @property
    def larger_budget(self) -> Path:
        """File with a budget that was given after the run was created; a later budget replaces it."""
        return self.path / "budget.json"

    def budget(self) -> Budget:
        """Return the budget that is now in force."""
        return JsonFile(self.larger_budget, Budget).read() or self.asked().config.budget

    def brief(self) -> Brief:
        """Return the brief given to the team.

        Raises:
            UserError: A file of the run is missing or damaged.
        """
        facts = JsonFile(self.path / "brief.json", dict[str, Any]).read()
        environment = BytesFile(self.path / "environment.xml").read()
        if facts is None or environment is None:
            raise UserError(f"{self.path} lacks brief.json or environment.xml; start the design again")
        robot = BytesFile(self.path / "starting_robot.xml").read() or b""
        try:
            texts = {"environment": environment.decode(), "starting_robot": robot.decode()}
            return Brief.model_validate({**facts, **texts})
        except ValueError as error:  # from pydantic, or from decoding
            reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else error
            raise UserError(f"the brief in {self.path} cannot be read ({reason}); start the design again") from None


def as_run(run: str | Path | Run) -> Run:
    """Return a run that is given as an object or by its folder.

    Raises:
        TypeError: It is given as something else.
    """
    return run if isinstance(run, Run) else Run(run)


def new_run(runs: Path, record: RunRecord, brief: Brief, goal: bytes = b"") -> Run:
    """Create the folder of a new run under `runs`; run.json is written last, and the folder counts as a run from then.

    Raises:
        UserError: The folder cannot be created.
    """
    moment = datetime.fromisoformat(record.started).strftime("%Y-%m-%d_%H%M")
    name = _slug(record.task.rpartition("/")[2] or record.objective)
    path = runs / f"{moment}_{name}_{secrets.token_hex(2)}"
    try:
        path.mkdir(parents=True)
    except OSError as error:
        raise UserError(
            f"no run folder can be made at {path} ({error.strerror}); name another place to write"
        ) from None
    run = Run(path)
    BytesFile(path / "environment.xml").write(brief.environment.encode())
    if brief.starting_robot:
        BytesFile(path / "starting_robot.xml").write(brief.starting_robot.encode())
    if goal:
        run.goal.write(goal)
    facts = brief.model_dump(mode="json", exclude={"environment", "starting_robot"})
    JsonFile(path / "brief.json", dict[str, Any]).write(facts)
    run.record.write(record)
    mark_as_ours(run.record.path)
    return run


def _slug(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", text.lower())[:40].strip("_") or "run"
