"""`aidsr benchmark`, `report`, `compare` and `submit`: studies of many runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

if TYPE_CHECKING:
    from aidsr.benchmark.pool import Pool
    from aidsr.benchmark.study import Arm, StudyPlan

Way = Literal[
    "full",
    "human",
    "human_only",
    "no_judge",
    "no_integrator",
    "no_judge_or_integrator",
    "no_validation",
    "direct",
    "no_repairs",
    "no_groups",
    "task_feedback",
]
"""As `aidsr.benchmark.arms.Way`, which would load what a command line without a command does not need."""

__all__ = ["benchmark", "compare", "report", "submit"]


def benchmark(
    study: Path,
    /,
    *,
    tasks: Annotated[list[str] | None, Parameter(negative="", consume_multiple=True)] = None,
    level: Literal["standard", "hard"] = "standard",
    model: Annotated[list[str] | None, Parameter(negative="", consume_multiple=True)] = None,
    method: Annotated[list[Way] | None, Parameter(negative="", consume_multiple=True)] = None,
    feedback: Path | None = None,
    baseline: Annotated[
        list[Literal["reference", "search"]] | None, Parameter(negative="", consume_multiple=True)
    ] = None,
    designs: Annotated[int, Parameter(validator=Number(gte=1))] = 15,
    concepts: Annotated[int, Parameter(validator=Number(gte=1, lte=20))] = 3,
    seeds: Annotated[int, Parameter(validator=Number(gte=0, lte=100))] = 1,
    steps: Annotated[int, Parameter(validator=Number(gte=1))] = 300_000,
    probe: bool = True,
    jobs: Annotated[int, Parameter(validator=Number(gte=1, lte=512))] = 2,
    ray: str = "",
    resume: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    dry_run: Annotated[bool, Parameter(negative="", show_default=False)] = False,
) -> int:
    """Design, train and judge robots for many tasks, and write the tables.

    A study is a folder with a frozen plan. The same command goes on with it after anything; --resume does so without
    saying the plan again.

        aidsr benchmark studies/first --tasks button_pushing flat_ground --designs 3 --steps 50000

        aidsr benchmark studies/first --resume --jobs 4

    Exit code 0 means that all jobs were done, 1 that some were given up (see failures.jsonl), 130 an interruption.

    Parameters
    ----------
    study
        Folder of the study.
    tasks
        Names of tasks, or "all".
    level
        Level of the tasks.
    model
        One or more models to compare, "builtin" for the rules; each is an arm of the study.
    method
        The full method, or ways of leaving something out of it or adding to it; each is an arm for each model.
    feedback
        TOML file with what a person says to the designs of each task, for the methods "human" and "human_only".
    baseline
        What they are measured against: "reference" for robots designed by hand, one a task, "search" for CMA-ES over
        the numbers of a built-in family, one design a run (extra "search"); each is an arm.
    designs
        Designs of each task and model, in runs of --concepts.
    concepts
        Concepts of each run.
    seeds
        Policies trained for each approved design; 0 trains none.
    steps
        Budget of control steps a policy.
    probe
        Also probe each approved design without learning.
    jobs
        How many jobs at a time on this machine; each uses one core.
    ray
        Address of a Ray cluster to do the jobs on, "auto" for the one that is running here; needs the extra "ray".
    resume
        Go on with the study as its plan says.
    dry_run
        Say what it would take, and begin nothing.
    """
    from rich.console import Console

    from aidsr.benchmark.driving import drive
    from aidsr.benchmark.report import write_report
    from aidsr.benchmark.study import Study, begin_study, open_study
    from aidsr.cli.studies import StudyTable, say_forecast

    console = Console(highlight=False)
    if resume:
        found = open_study(study)
    else:
        arms = partial(_arms, model or ["builtin"], method or ["full"], concepts, feedback, baseline or [])
        plan = _plan(tasks, level, arms, designs, concepts, seeds, steps, probe)
        found = Study(study, plan) if dry_run else begin_study(study, plan)
    say_forecast(console, found)
    if dry_run:
        return 0
    try:
        with StudyTable(console, found) as table:
            progress = drive(found, _pool(study, jobs, ray), table.listen)
    except KeyboardInterrupt:
        console.print(f"\nInterrupted; aidsr benchmark {study} --resume goes on", soft_wrap=True)
        return 130
    console.print(f"Report: {write_report(found)}", soft_wrap=True)
    return 1 if progress.failed else 0


def report(study: Path, /) -> int:
    """Write the report of a study as it stands: report.html, .md, .csv and .json in its folder.

        aidsr report studies/first

    Parameters
    ----------
    study
        Folder of the study.
    """
    from rich.console import Console

    from aidsr.benchmark.report import write_report
    from aidsr.benchmark.study import open_study

    Console(highlight=False).print(str(write_report(open_study(study))), soft_wrap=True)
    return 0


def compare(one: Path, other: Path, /) -> int:
    """Say whether one study is better than another by more than noise.

    Designs are paired by task, run and number; the first arm of each study is compared.

        aidsr compare studies/before studies/after

    Parameters
    ----------
    one
        Folder of a study.
    other
        Folder of another.
    """
    from rich.console import Console

    from aidsr.benchmark.study import open_study
    from aidsr.cli.studies import say_comparison

    return say_comparison(Console(highlight=False), open_study(one), open_study(other))


def submit(study: Path, /, *, out: Path | None = None) -> int:
    """Write a study's results into one small file that others can check and merge.

        aidsr submit studies/first --out first.json

    Parameters
    ----------
    study
        Folder of the study.
    out
        The file; submission.json in the study's folder unless named.
    """
    from rich.console import Console

    from aidsr.benchmark.study import open_study
    from aidsr.benchmark.submitting import read_submission
    from aidsr.benchmark.submitting import submit as write

    path = out if out is not None else study / "submission.json"
    write(open_study(study), path)
    found = read_submission(path)
    Console(highlight=False).print(f"{path}: {len(found.designs)} designs, sha256 {found.sha256}", soft_wrap=True)
    return 0


def _plan(
    tasks: list[str] | None,
    level: Literal["standard", "hard"],
    arms: Callable[[Sequence[str]], tuple[Arm, ...]],
    designs: int,
    concepts: int,
    seeds: int,
    steps: int,
    probe: bool,
) -> StudyPlan:
    """Return the plan that the options ask for.

    Raises:
        UserError: A task is not known, or the designs do not make whole runs.
    """
    from aidsr.benchmark.study import StudyPlan, versions_now
    from aidsr.errors import UserError
    from aidsr.tasks import load_task, task_names

    if designs % concepts:
        raise UserError(
            f"--designs must be whole runs of --concepts {concepts}, found {designs}; {designs // concepts * concepts} "
            f"or {(designs // concepts + 1) * concepts} would do"
        )
    chosen = task_names() if tasks in (None, ["all"]) else tuple(load_task(name).name for name in tasks or ())
    return StudyPlan(
        tasks=chosen,
        level=level,
        arms=arms(chosen),
        runs=designs // concepts,
        seeds=seeds,
        steps=steps,
        probe=probe,
        versions=versions_now(),
    )


def _arms(
    models: list[str],
    ways: list[Way],
    concepts: int,
    feedback: Path | None,
    baselines: list[Literal["reference", "search"]],
    tasks: Sequence[str],
) -> tuple[Arm, ...]:
    from aidsr.benchmark.arms import arms_of, read_feedback

    said = read_feedback(feedback, tasks) if feedback else {}
    return arms_of(models, ways, concepts=concepts, feedback=said, baselines=baselines)


def _pool(study: Path, jobs: int, ray: str) -> Pool:
    from aidsr.benchmark.cluster import RayPool
    from aidsr.benchmark.pool import LocalPool
    from aidsr.errors import UserError

    if ray:
        try:
            return RayPool(study, ray)
        except ModuleNotFoundError as error:
            raise UserError(f'--ray needs {error.name}; install it with: pip install "aidsr[ray]"') from None
    return LocalPool(study, jobs)
