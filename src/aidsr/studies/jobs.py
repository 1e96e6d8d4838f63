"""Pending jobs of a study, derived from the contents of its folder, and their execution.

A job is one stage of one run: all its designs, or the verification, one policy or the probe of one design. Its only
output are files that are written once, so repeating a job loses at most the work in progress, and it can run on any
machine.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Literal, Self, get_args

from aidsr.api import DesignedScene, evaluate, train_policy
from aidsr.core.artifacts import ValidationReport
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import AidsrError, BudgetError, Limit, UserError
from aidsr.loop.run import create_run, make_brief, parts_of, replace_budget
from aidsr.loop.runner import run_designs
from aidsr.runs import RUN_FILE, DesignFolder, Run, read_status
from aidsr.runs.files import JsonFile
from aidsr.runs.origin import MARK, mark_as_ours
from aidsr.runs.trainings import Training
from aidsr.studies.planned import (
    PROBE_SEED,
    planned_recipe,
    read_probe,
    robot_of,
    training_folder_of,
    unplanned_probe,
    unplanned_settings,
)
from aidsr.studies.study import Cell, Study, open_study
from aidsr.tasks import load_task
from aidsr.validation import validate

Stage = Literal["design", "verify", "train", "probe"]


@dataclass(frozen=True)
class Job:
    """One stage of one run.

    Attributes:
        cell: The run.
        stage: The stage to run.
        design: Number of the design, 0 for all designs of the run.
        seed: Seed of the policy.
        most_usd: Largest total cost of the run [USD], where the study has a limit; not part of the job's identity.
        most_tokens: Largest total number of tokens of the run; not part of the job's identity.
    """

    cell: Cell
    stage: Stage
    design: int = 0
    seed: int = 0
    most_usd: float | None = field(default=None, compare=False)
    most_tokens: int | None = field(default=None, compare=False)

    @property
    def name(self) -> str:
        """A unique, readable name."""
        detail = f" design {self.design}" if self.design else ""
        return f"{self.stage} {self.cell.name}{detail}" + (f" seed {self.seed}" if self.stage == "train" else "")

    def as_dict(self) -> dict[str, object]:
        """Return the job as plain values."""
        return asdict(self)

    @classmethod
    def of(cls, values: dict[str, object]) -> Self:
        """Return a job from plain values."""
        return cls(**{**values, "cell": Cell(**values["cell"])})  # type: ignore[arg-type]


def pending_in(study: Study, cell: Cell) -> Iterator[Job]:
    """Yield the jobs of one run that can be started now."""
    run = study.run(cell)
    if not is_finished(run):
        continued = study.continued_cell(cell)
        if continued is None or is_finished(study.run(continued)):
            yield Job(cell, "design")
        return
    assert run is not None, "a finished run was started"
    for design in run.designs:
        outcome = design.outcome.read()
        if outcome is None or outcome.outcome != "approved":
            continue
        if not (design.path / VERIFIED).exists():
            yield Job(cell, "verify", design.number)
        for seed in range(study.plan.seeds):
            judged = Training(training_folder_of(design, seed)).evaluation.path.exists()
            if not judged or unplanned_settings(study, cell, design, seed):
                yield Job(cell, "train", design.number, seed)
        if study.plan.probe and (not read_probe(design) or unplanned_probe(study, cell, design)):
            yield Job(cell, "probe", design.number)


def is_finished(run: Run | None) -> bool:
    """Return whether a run is finished, and no design was stopped by the study's limit."""
    return run is not None and read_status(run).state == "finished" and not exhausted_limits(run)


def format_limits(limits: Iterable[Limit]) -> str:
    """Return limits in words: "cost and tokens"."""
    return " and ".join("cost" if limit == "cost_usd" else "tokens" for limit in limits)


def exhausted_limits(run: Run) -> tuple[Limit, ...]:
    """Return the limits of the study of which a run used up its share; with a larger share it can resume."""
    if not run.larger_budget.exists():
        return ()
    outcomes = [outcome for design in run.designs if (outcome := design.outcome.read()) is not None]
    out_of_budget = [outcome for outcome in outcomes if outcome.outcome == "out_of_budget"]
    # outcomes written by earlier versions do not name the limit
    limits = {limit for outcome in out_of_budget for limit in outcome.limits or get_args(Limit)}
    return tuple(limit for limit in get_args(Limit) if limit in limits)


VERIFIED = "verified.json"
"""File with the report of a separate validation of the final scene: runs of the method without validation have no
other report."""


def output_of_job(study: Study, job: Job) -> Path:
    """Return the file or folder that a job writes; it is different for each job."""
    if job.stage == "design":
        return study.home(job.cell)
    design = _design_of(study, job)
    if job.stage == "train":
        return training_folder_of(design, job.seed)
    return design.path / VERIFIED if job.stage == "verify" else design.probe


def run_job(study: Path, job: Job) -> None:
    """Run one job, or resume it.

    Raises:
        BudgetError: The job's share of the study's limit was too small; with a larger share it can resume.
        AidsrError: The job failed; the message gives the reason.
    """
    found = open_study(study)
    match job.stage:
        case "design":
            _design(found, job)
        case "verify":
            _verify(found, job)
        case "train":
            _train(found, job)
        case "probe":
            _probe(found, job)


def _design(study: Study, job: Job) -> None:
    cell, run = job.cell, study.run(job.cell)
    if run is None:
        home = study.home(cell)
        shutil.rmtree(home, ignore_errors=True)  # leftovers of a run that was killed before it wrote run.json
        config = study.arm(cell.arm).config
        # runs of the same number have the same seed in every arm, so that arms can be compared run by run
        config = config.model_copy(update={"seed": config.seed + cell.number - 1})
        config = config.model_copy(update={"feedback": study.arm(cell.arm).feedback.get(cell.task, "")})
        continued = study.continued_cell(cell)
        if continued is not None:
            run = _continue_run(study, continued, home, config)
        else:
            run = create_run(
                make_brief(task=cell.task, level=study.plan.level), config, level=study.plan.level, runs=home
            )
    _require_model_of_arm(run, study.arm(cell.arm).config.model)
    limit = Budget(cost_usd=job.most_usd, tokens=job.most_tokens)
    if limit != Budget() or run.larger_budget.exists():
        replace_budget(run, limit)
    try:
        status = read_status(run_designs(run, parts_of(run, trust=True)))
    except BudgetError as error:
        if limit == Budget():  # the arm's own budget is too small, so a retry cannot help
            raise AidsrError(str(error)) from error
        raise
    if limits := exhausted_limits(run):
        raise BudgetError(f"{cell.name} used up its share of the study's limit on {format_limits(limits)}", *limits)
    if status.state != "finished":
        raise AidsrError(status.why_unfinished)


def _require_model_of_arm(run: Run, model: str) -> None:
    """Refuse a run that sends its prompts elsewhere than its arm, whose model the study's user confirmed.

    Raises:
        UserError: The run names another model.
    """
    named = run.asked().config.model
    if named != model:
        raise UserError(
            f'{run.record.path} names the model "{named}", and its arm in study.toml "{model}"; delete the folder '
            f"{run.path}, and its designs are made again"
        )


_NOT_DESIGNING = (
    RUN_FILE,
    "budget.json",
    "summary.html",
    "outcome.json",
    "final*.xml",
    VERIFIED,
    "training",
    "probe.json",
    "*.part",
)
"""Files of a run that are not copied when another arm continues it: its record and budget, which are written anew, and
final results with everything computed from them."""


def _continue_run(study: Study, continued: Cell, home: Path, config: RunConfig) -> Run:
    """Return a copy of another arm's run with another configuration; recorded answers and their cost are kept.

    Raises:
        AidsrError: The other arm's run has not started.
    """
    origin = study.run(continued)
    if origin is None:
        raise AidsrError(f"{continued.name} must be designed before {home}")
    copy = Run(home / origin.path.name)
    shutil.copytree(origin.path, copy.path, ignore=shutil.ignore_patterns(*_NOT_DESIGNING))
    (copy.path / MARK).unlink(missing_ok=True)
    copy.record.write(origin.asked().model_copy(update={"config": config}))
    mark_as_ours(copy.record.path)
    return copy


def _verify(study: Study, job: Job) -> None:
    design = _design_of(study, job)
    task = load_task(job.cell.task, study.plan.level)
    report = validate(design.final_scene.path, needs_contact=task.needs_contact)
    JsonFile(design.path / VERIFIED, ValidationReport).write(report)


def _train(study: Study, job: Job) -> None:
    design, arm = _design_of(study, job), study.arm(job.cell.arm)
    groups = robot_of(design).actuator_groups
    scene = DesignedScene(design.final_scene.path, job.cell.task, study.plan.level, groups, design.path)
    folder = training_folder_of(design, job.seed)
    _refuse_unplanned(folder, unplanned_settings(study, job.cell, design, job.seed))
    train_policy(
        scene,
        folder.parent,
        grouping=arm.grouping,
        number=folder.name,
        steps=study.plan.steps,
        seed=job.seed,
        recipe=planned_recipe(study, job.cell, design),
        threads=1,
    )
    evaluate(folder, threads=1, perturbed="successful" if study.plan.perturbed else False)


def _probe(study: Study, job: Job) -> None:
    from aidsr.learn.openloop import ProbeReport, probe

    design = _design_of(study, job)
    _refuse_unplanned(design.probe, unplanned_probe(study, job.cell, design))
    report = probe(
        design.final_scene.path,
        job.cell.task,
        level=study.plan.level,
        groups=robot_of(design).actuator_groups,
        grouping=study.arm(job.cell.arm).grouping,
        seed=PROBE_SEED,
        threads=1,
    )
    JsonFile(design.probe, ProbeReport).write(report)


def _refuse_unplanned(made: Path, differing: Sequence[str]) -> None:
    """Refuse to work where another command left a result with other settings than the plan's.

    Raises:
        UserError: There is such a result.
    """
    if differing:
        raise UserError(
            f"{made} is not by the plan of the study: it differs in {', '.join(differing)}; move or delete it, and "
            "resume the study"
        )


def _design_of(study: Study, job: Job) -> DesignFolder:
    run = study.run(job.cell)
    if run is None:
        raise ValueError(f"{job.name} needs a run that was designed before")
    return run.design(job.design)
