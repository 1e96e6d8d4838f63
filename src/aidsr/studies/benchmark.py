"""`benchmark`: run a study, or resume it, and write its report."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from aidsr.core.arguments import as_names, check_type, check_whole_number
from aidsr.core.config import BUDGET_STEPS, BUILTIN, Budget, Protocol, RunConfig, StudyMethod
from aidsr.core.errors import UserError
from aidsr.core.extras import require_extra
from aidsr.loop.teams import check_model
from aidsr.studies.arms import Baseline, make_plan
from aidsr.studies.budget import check_budget, read_budget, set_budget
from aidsr.studies.cluster import RayPool
from aidsr.studies.pool import LocalPool
from aidsr.studies.report import write_report
from aidsr.studies.runner import Progress, run_study
from aidsr.studies.study import STUDY_FILE, Study, StudyPlan, create_study, open_study, require_study_is_ours

if TYPE_CHECKING:
    from aidsr.tasks import Level

_MOST_JOBS = 512


def benchmark(
    study: str | Path,
    *,
    tasks: str | Collection[str] = "all",
    level: Level = "standard",
    model: str | Collection[str] = BUILTIN,
    method: StudyMethod | Collection[StudyMethod] = "full",
    feedback: str | Path = "",
    baseline: Baseline | Collection[Baseline] = (),
    search_robots: int = RunConfig.model_fields["search_robots"].default,
    designs: int = 15,
    concepts: int = RunConfig.model_fields["concepts"].default,
    seeds: int = 1,
    steps: int = BUDGET_STEPS,
    protocol: Protocol = "best",
    probe: bool = True,
    perturbed: bool = False,
    budget: Budget | None = None,
    jobs: int = 2,
    ray: str = "",
    resume: bool = False,
    trust: bool = False,
    listen: Callable[[Progress], None] = lambda _progress: None,
) -> Study:
    """Run a study and return it: design, train and evaluate robots for many tasks, and write the report.

    Repeat the same call to resume a stopped study, or name only its folder with `resume`. A job that fails three times
    is left out (failures.jsonl in the study's folder), and so is one that does not fit in the budget: its design is
    "unfinished" in `aidsr.outcomes`.

        study = aidsr.benchmark("studies/first", tasks=["button_pushing", "gap"], designs=3)
        rows = aidsr.outcomes(study)                    # pandas.DataFrame(rows) is a table of all designs
        study = aidsr.benchmark("studies/first", resume=True, jobs=4)

    Args:
        study: Folder of the study.
        tasks: Names of tasks, or "all".
        level: Level of the tasks.
        model: Names of the models to compare; each is an arm of the study.
        method: Methods to compare: the full method, or variants with parts removed or added (docs/studies.md). Each is
            an arm for each model.
        feedback: TOML file with a person's feedback on the designs of each task, for the methods "human" and
            "human_only".
        baseline: "reference" for robots designed by hand, "search" for CMA-ES over the parameters of a built-in family;
            each is an arm.
        search_robots: Number of robots that "search" tries for each design, a multiple of eight.
        designs: Number of designs for each task and arm, in runs of `concepts`.
        concepts: Number of concepts of each run.
        seeds: Number of policies to train for each approved design; 0 trains none.
        steps: Maximum control steps of each policy.
        protocol: "best" is soft actor-critic with held actions; "paper" is PPO, for comparison.
        probe: Whether to also probe each approved design without learning.
        perturbed: Whether to also run successful policies in perturbed scenes; the verdict does not change.
        budget: Limits of cost and tokens for the whole study, including what is already spent; they replace earlier
            ones. None: the earlier limits hold.
        jobs: Number of parallel jobs on this machine; each is a process on one core.
        ray: Address of a Ray cluster that runs the jobs, or "auto" for the cluster that runs here; requires the extra
            "ray".
        resume: Whether to resume the study with the plan in its folder.
        trust: Whether a study that was not made on this machine may send its prompts, and keys, to the addresses in its
            study.toml; see docs/safety.md.
        listen: Called before each wait for a job, and at the end.

    Raises:
        TypeError: An argument has the wrong type.
        UserError: A name is unknown, a number is out of range, options contradict each other, the folder holds a study
            with another plan or none to resume, or an extra is missing.
        ForeignFolderError: The study was not made on this machine, its prompts leave it, and `trust` is false.
    """
    values = dict(locals())
    check_type(study, (str, Path), "study must be the path of a folder")
    check_type(feedback, (str, Path), "feedback must be the path of a TOML file")
    check_whole_number("jobs", jobs, least=1)
    if jobs > _MOST_JOBS:
        raise UserError(f"jobs must be at most {_MOST_JOBS}: {jobs}")
    given = [name for name, default in _PLAN.items() if values[name] != default]
    if resume and given:
        raise UserError(
            f"resume cannot be combined with {', '.join(given)}: the plan is read from {Path(study) / 'study.toml'}"
        )
    for name, least in (("search_robots", 8), ("designs", 1), ("concepts", 1), ("seeds", 0), ("steps", 1)):
        check_whole_number(name, values[name], least=least)
    plan = make_plan(
        _names("tasks", tasks),
        _names("model", model),
        _names("method", method),  # type: ignore[arg-type]  # make_plan refuses unknown names
        level=level,
        feedback=Path(feedback) if feedback else None,
        baselines=_names("baseline", baseline),  # type: ignore[arg-type]
        search_robots=search_robots,
        designs=designs,
        concepts=concepts,
        seeds=seeds,
        steps=steps,
        protocol=protocol,
        probe=probe,
        perturbed=perturbed,
    )
    found = find_study(Path(study), None if resume else plan)
    limit = read_budget(found) if budget is None else budget
    check_budget(found, limit)
    check_machine(found, ray)
    require_study_is_ours(found, trust=trust)
    run_jobs(found, limit, jobs=jobs, ray=ray, listen=listen)
    write_report(found)
    return found


_PLAN = {
    name: parameter.default
    for name, parameter in inspect.signature(benchmark).parameters.items()
    if name not in ("study", "budget", "jobs", "ray", "resume", "trust", "listen")
}
"""Arguments of `benchmark` that define the plan of a study, with their defaults."""


def find_study(path: Path, plan: StudyPlan | None) -> Study:
    """Return the study with a plan, whose folder may not exist yet, or without a plan the study in the folder.

    Raises:
        UserError: The folder holds a study with another plan, or there is no study to resume.
    """
    if plan is None:
        return open_study(path)
    return create_study(path, plan) if (path / STUDY_FILE).exists() else Study(path, plan)


def check_machine(study: Study, ray: str = "") -> None:
    """Check that the jobs of a study can run on this machine, or that a Ray cluster can be reached from it.

    Raises:
        UserError: A model cannot be called, or an extra is not installed.
    """
    if ray:
        require_extra("ray", "a Ray cluster")
        return
    for arm in study.plan.arms:
        check_model(arm.config, arm.config.budget)
    if study.plan.seeds:
        require_extra("rl", "training")


def run_jobs(
    study: Study,
    limit: Budget,
    *,
    jobs: int,
    ray: str = "",
    listen: Callable[[Progress], None] = lambda _progress: None,
) -> Progress:
    """Create the folder of a study if there is none, and run its pending jobs within a limit.

    Args:
        study: The study, from `find_study`.
        limit: Limits of cost and tokens for the whole study; they replace earlier ones.
        jobs: Number of parallel jobs on this machine.
        ray: Address of a Ray cluster that runs the jobs instead; see `benchmark`.
        listen: As in `run_study`.

    Raises:
        UserError: The folder holds a study with another plan, or one of another benchmark version.
    """
    create_study(study.path, study.plan)
    if limit != read_budget(study):
        set_budget(study, limit)
    return run_study(study, RayPool(study.path, ray) if ray else LocalPool(study.path, jobs), listen)


def _names(what: Literal["tasks", "model", "method", "baseline"], given: str | Collection[str]) -> tuple[str, ...]:
    sentence = f"{what} must be a name or a list of names"
    check_type(given, (str, Collection), sentence)
    for name in as_names(given):
        check_type(name, str, sentence)
    return as_names(given)
