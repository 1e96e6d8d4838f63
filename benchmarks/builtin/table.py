"""How many designs of the built-in team are valid and successful, task by task.

    python benchmarks/builtin/table.py --designs 5 --steps 300000 --jobs 2

A study (aidsr.studies) with one concept a run: the n-th design of a task is the first concept of seed n - 1. Every
task gets its first design before any gets its second, so the table means something whenever it is stopped. Raw outcomes
go to results.jsonl beside this file and the table made of them to results.md, or to files of another name
(`--out mine`). The same command goes on with what is left, on this machine or another one: a design whose outcome is in
the .jsonl is not trained again. To train all yourself, name files that are not there yet.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from statistics import fmean, median
from typing import Any

from pydantic import Field

from aidsr.core.artifacts import Artifact
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.core.rates import Rate
from aidsr.learn.rl.recipe import Recipe
from aidsr.learn.rl.training import BUDGET_STEPS
from aidsr.learn.rl.training_folder import TrainingFolder
from aidsr.runs.files import replace_file
from aidsr.studies.jobs import training_folder_of
from aidsr.studies.outcomes import DesignRow, read_outcomes
from aidsr.studies.pool import LocalPool
from aidsr.studies.runner import Progress, run_study
from aidsr.studies.study import Arm, Cell, Study, StudyPlan, create_study, versions_now
from aidsr.studies.tables import PAPER
from aidsr.tasks import load_task, task_names

HOME = Path(__file__).parent
_RECIPE = Recipe().model_dump(mode="json")
"""What policies are trained with today."""


class Row(Artifact):
    """What came of one design: a policy that was judged, or no policy because the design was not approved."""

    task: str
    level: str
    design: int
    family: str
    outcome: str
    """As in outcome.json of the design."""
    valid: bool
    successful: bool
    success_share: float
    """Of the held-out episodes; 0 where the policy is not valid."""
    steps: int
    training_s: float
    benchmark_version: int
    most_steps: int
    """Control steps a policy, at most."""
    recipe: dict[str, Any] | None = None
    """As it was then, with the fields it had then; None where it was not written down."""
    mujoco: str
    scene_sha256: str = ""
    """Of the scene it was trained in, by which it can be told whether today's team would make the same."""
    episodes: dict[str, int] = Field(default_factory=dict)
    """How many held-out episodes ended in which way."""
    best_progress: float | None = None
    """Mean of the furthest that each held-out episode came."""
    failed_checks: dict[str, str] = Field(default_factory=dict)
    """Checks of plausibility that failed, with what they say."""


def main() -> None:
    """Do what is left of the study, writing its table as it goes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, help="of the study; build/builtin-STEPS unless named")
    parser.add_argument("--tasks", nargs="+", default=list(task_names()), help="all unless named")
    parser.add_argument("--designs", type=int, default=5, help="of each task")
    parser.add_argument("--steps", type=int, default=BUDGET_STEPS, help="control steps a policy, at most")
    parser.add_argument("--jobs", type=int, default=2, help="side by side, one core each")
    parser.add_argument("--out", default="results", help="name of the table, without its ending")
    parser.add_argument("--write-only", action="store_true", help="write the table of what is there, do nothing else")
    asked = parser.parse_args()
    folder = asked.folder or Path("build") / f"builtin-{asked.steps}"
    plan = StudyPlan(
        tasks=tuple(load_task(name).name for name in asked.tasks),
        arms=(Arm(name="builtin", config=RunConfig(model="builtin", concepts=1)),),
        runs=asked.designs,
        steps=asked.steps,
        probe=False,
        versions=versions_now(),
    )
    published = kept(HOME / f"{asked.out}.jsonl", plan)
    study = create_study(folder, plan)
    if not asked.write_only:
        there = {(row.task, row.design) for row in published}
        elsewhere = frozenset(cell for cell in study.cells if (cell.task, cell.number) in there)
        sys.stdout.write(f"{len(elsewhere)} of {_planned(plan)} designs are in {asked.out}.jsonl already\n")
        run_study(study, LocalPool(folder, asked.jobs), partial(_note, study, published, asked.out), without=elsewhere)
    _write(study, published, asked.out)


def _note(study: Study, published: Sequence[Row], out: str, progress: Progress) -> None:
    _write(study, published, out)
    if progress.last:
        said = progress.last.error or "done"
        sys.stdout.write(f"{progress.last.job.name}: {said} ({progress.last.wall_s:.0f} s)\n")
        sys.stdout.flush()


def _write(study: Study, published: Sequence[Row], out: str) -> None:
    rows = merged(study, published)
    raw = "".join(row.model_dump_json(exclude_none=True) + "\n" for row in rows)
    replace_file(HOME / f"{out}.jsonl", raw.encode())
    replace_file(HOME / f"{out}.md", table(study.plan, rows, out).encode())


def kept(path: Path, plan: StudyPlan) -> tuple[Row, ...]:
    """Return the outcomes in a file, none where there is no file.

    Raises:
        UserError: One is of other conditions than today's, or of a design that the plan does not ask for.
    """
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return tuple(_fitting(Row.model_validate_json(line), plan, path) for line in lines)


def merged(study: Study, published: Sequence[Row]) -> list[Row]:
    """Return every outcome there is, in the order of the tasks; what is published stays as it is.

    Raises:
        UserError: One of the study is of other conditions than today's.
    """
    found = {(row.task, row.design): row for row in published}
    for row in read_outcomes(study):
        if (row.evaluations or row.outcome not in ("unfinished", "approved")) and (row.task, row.run) not in found:
            found[row.task, row.run] = _fitting(row_of(row, study), study.plan, study.path)
    places = {task: place for place, task in enumerate(study.plan.tasks)}
    return sorted(found.values(), key=lambda row: (row.design, places[row.task]))


def _fitting(row: Row, plan: StudyPlan, where: Path) -> Row:
    conditions = (row.benchmark_version, row.level, row.most_steps, row.recipe)
    asked = conditions == (plan.benchmark_version, plan.level, plan.steps, _RECIPE)
    if not asked or row.task not in plan.tasks or row.design > plan.runs:
        raise UserError(
            f"{where} holds design {row.design} of {row.task} with version {row.benchmark_version} of the "
            f"benchmark, level {row.level}, {row.most_steps:,} steps, recipe {row.recipe}; the table asked for has no "
            f"place for it: version {plan.benchmark_version}, level {plan.level}, {plan.steps:,} steps, recipe "
            f"{_RECIPE}, {plan.runs} designs of {len(plan.tasks)} tasks. Name another file with --out, another folder "
            "with --folder"
        )
    return row


def row_of(row: DesignRow, study: Study) -> Row:
    """Return what is kept of a design that came to its end."""
    (evaluation,) = row.evaluations or (None,)
    plan, run = study.plan, study.run(Cell(row.arm, row.task, row.run))
    assert run is not None, "it came to its end"
    facts: dict[str, Any] = {
        "benchmark_version": plan.benchmark_version,
        "most_steps": plan.steps,
        "recipe": _RECIPE,
        "mujoco": plan.versions["mujoco"],
    }
    if evaluation:
        config = TrainingFolder(training_folder_of(run.design(row.design), 0)).read_json("config.json")
        facts = {
            "benchmark_version": config["benchmark_version"],
            "most_steps": config["steps"],
            "recipe": config["recipe"],
            "mujoco": config["versions"]["mujoco"],
            "scene_sha256": config["scene_sha256"],
            "episodes": Counter(each.ended for each in evaluation.episodes),
            "best_progress": fmean(each.best_progress for each in evaluation.episodes),
            "failed_checks": {each.name: each.message for each in evaluation.checks if not each.passed},
        }
    return Row(
        task=row.task,
        level=plan.level,
        design=row.run,
        family=row.family,
        outcome=row.outcome,
        valid=row.valid,
        successful=row.successful,
        success_share=row.episodes_share,
        steps=row.steps,
        training_s=row.training_s,
        **facts,
    )


def table(plan: StudyPlan, rows: Sequence[Row], out: str = "results") -> str:
    """Return outcomes as a Markdown table; its rates are of the designs that ended, and it says how many did."""
    mujoco = " and ".join(sorted({row.mujoco for row in rows})) or plan.versions["mujoco"]
    lines = [
        "# What the built-in team's robots learn",
        "",
        f"Made by `{_command(plan, out)}` with MuJoCo {mujoco}, version {plan.benchmark_version} of the benchmark, "
        f"level {plan.level}, one seed, "
        f"at most {plan.steps:,} control steps a policy; the benchmark's budget is {BUDGET_STEPS:,}.",
        "",
        f"**{len(rows)} of {_planned(plan)} planned designs came to an end**; any others are in no figure. A design "
        "ends when its policy is judged, or when it is not approved: then it counts as neither valid nor successful. "
        "Intervals: Wilson, 95 %. *Episodes won* counts those of invalid policies as lost; *progress* is the mean of "
        "the furthest that each held-out episode came, of valid and invalid policies alike. Progress and steps are "
        "means over the designs that were trained; time is their median wall time, longer where other work ran beside.",
        "",
        "| task | ended | valid | successful | episodes won | progress | control steps | training, wall s | families |",
        "|---|---|---|---|---|---|---|---|---|",
        *(_line(task, [row for row in rows if row.task == task], plan.runs) for task in plan.tasks),
        _line("**all**", rows, _planned(plan)),
        "",
        _comparison(rows, plan),
    ]
    return "\n".join(lines) + "\n"


def _planned(plan: StudyPlan) -> int:
    return len(plan.tasks) * plan.runs


def _command(plan: StudyPlan, out: str) -> str:
    tasks = "" if plan.tasks == task_names() else f" --tasks {' '.join(plan.tasks)}"
    named = "" if out == "results" else f" --out {out}"
    return f"python benchmarks/builtin/table.py --designs {plan.runs} --steps {plan.steps}{tasks}{named}"


def _line(name: str, rows: Sequence[Row], planned: int) -> str:
    measured = [""] * 7
    if rows:
        trained = [row for row in rows if row.best_progress is not None]
        measured = [
            _rate(sum(row.valid for row in rows), len(rows)),
            _rate(sum(row.successful for row in rows), len(rows)),
            f"{fmean(row.success_share for row in rows):.0%}",
            f"{fmean(row.best_progress or 0.0 for row in trained):.2f}" if trained else "",
            f"{fmean(row.steps for row in trained):,.0f}" if trained else "",
            f"{median(row.training_s for row in trained):.0f}" if trained else "",
            ", ".join(dict.fromkeys(row.family for row in rows)),
        ]
    return "| " + " | ".join([name, f"{len(rows)} of {planned}", *measured]) + " |"


def _rate(hits: int, of: int) -> str:
    interval = Rate(hits, of).interval
    return f"{hits} of {of} ({interval.low:.0%} to {interval.high:.0%})"


def _comparison(rows: Sequence[Row], plan: StudyPlan) -> str:
    tried, won = {row.task for row in rows}, {row.task for row in rows if row.successful}
    checks = Counter(name for row in rows for name in row.failed_checks)
    failed = ", ".join(f"{name} {count}" for name, count in checks.most_common()) or "none"
    return (
        f"{len(tried)} of {len(plan.tasks)} tasks have a design that ended, {len(won)} of them a successful one. "
        f"Checks of validity that failed, by designs: {failed}. Published, for orientation only: {PAPER.valid:.1%} "
        f"valid, {PAPER.successful:.1%} successful, {PAPER.successful_by_table:.1%} by its own table ({PAPER.source})."
    )


if __name__ == "__main__":
    try:
        main()
    except UserError as error:
        sys.exit(str(error))
