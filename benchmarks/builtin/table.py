"""How many designs of the built-in team are valid and successful, task by task.

    python benchmarks/builtin/table.py --designs 5 --steps 300000 --jobs 2

A study (aidsr.benchmark) with one concept a run: the n-th design of a task is the first concept of seed n - 1. Every
task gets its first design before any gets its second, so the table means something whenever it is stopped. The same
command goes on with what is left. The table goes to results.md and the raw outcomes to results.jsonl beside it, or to
files of another name (`--out longer`).
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from functools import partial
from pathlib import Path
from statistics import fmean

from aidsr.benchmark.driving import Progress, drive
from aidsr.benchmark.outcomes import DesignRow, read_outcomes
from aidsr.benchmark.pool import LocalPool
from aidsr.benchmark.statistics import Rate
from aidsr.benchmark.study import Arm, Study, StudyPlan, begin_study, versions_now
from aidsr.benchmark.tables import PAPER, line_of
from aidsr.rl.training import BUDGET_STEPS
from aidsr.runs import RunConfig
from aidsr.tasks import load_task, task_names

HOME = Path(__file__).parent


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
    study = begin_study(folder, plan)
    if not asked.write_only:
        drive(study, LocalPool(folder, asked.jobs), partial(_note, study, asked.out))
    _write(study, asked.out)


def _note(study: Study, out: str, progress: Progress) -> None:
    _write(study, out)
    if progress.last:
        said = progress.last.error or "done"
        sys.stdout.write(f"{progress.last.job.name}: {said} ({progress.last.wall_s:.0f} s)\n")
        sys.stdout.flush()


def _write(study: Study, out: str) -> None:
    raw = "".join(json.dumps(_raw(row, study.plan)) + "\n" for row in ended(study))
    (HOME / f"{out}.jsonl").write_text(raw, encoding="utf-8")
    (HOME / f"{out}.md").write_text(table(study, out), encoding="utf-8")


def ended(study: Study) -> list[DesignRow]:
    """Return the designs whose policy was judged, and those that were not approved and so have none."""
    return [row for row in read_outcomes(study) if row.evaluations or row.outcome not in ("unfinished", "approved")]


def _raw(row: DesignRow, plan: StudyPlan) -> dict[str, object]:
    facts: dict[str, object] = {
        "task": row.task,
        "level": plan.level,
        "design": row.run,
        "family": row.family,
        "outcome": row.outcome,
        "valid": row.valid,
        "successful": row.successful,
        "success_share": fmean(row.episodes) if row.episodes else 0.0,
        "steps": row.steps,
        "training_s": row.training_s,
    }
    for evaluation in row.evaluations:
        facts["episodes"] = Counter(episode.ended for episode in evaluation.episodes)
        facts["best_progress"] = round(fmean(episode.best_progress for episode in evaluation.episodes), 3)
        facts["failed_checks"] = {each.name: each.message for each in evaluation.checks if not each.passed}
    return facts


def table(study: Study, out: str = "results") -> str:
    """Return the study's table as Markdown; its rates are of the designs that ended, and it says how many did."""
    plan, rows = study.plan, ended(study)
    planned = len(plan.tasks) * plan.runs
    lines = [
        "# What the built-in team's robots learn",
        "",
        f"Made by `{_command(plan, out)}` with MuJoCo "
        f"{plan.versions['mujoco']}, version {plan.benchmark_version} of the benchmark, level {plan.level}, one seed, "
        f"at most {plan.steps:,} control steps a policy; the benchmark's budget is {BUDGET_STEPS:,}.",
        "",
        f"**{len(rows)} of {planned} planned designs came to an end**; the others are in no figure. A design ends "
        "when its policy is judged, or when it is not approved: then it counts as neither valid nor successful. "
        "Intervals: Wilson, 95 %. *Episodes won* counts those of invalid policies as lost; *progress* is the mean of "
        "the furthest that each held-out episode came, of valid and invalid policies alike.",
        "",
        "| task | ended | valid | successful | episodes won | progress | control steps | training, wall s | families |",
        "|---|---|---|---|---|---|---|---|---|",
        *(_line(task, [row for row in rows if row.task == task], plan.runs) for task in plan.tasks),
        _line("**all**", rows, planned),
        "",
        _comparison(rows, plan),
    ]
    return "\n".join(lines) + "\n"


def _command(plan: StudyPlan, out: str) -> str:
    tasks = "" if plan.tasks == task_names() else f" --tasks {' '.join(plan.tasks)}"
    named = "" if out == "results" else f" --out {out}"
    return f"python benchmarks/builtin/table.py --designs {plan.runs} --steps {plan.steps}{tasks}{named}"


def _line(name: str, rows: list[DesignRow], planned: int) -> str:
    found = line_of(name, rows)
    measured = [""] * 7
    if rows:
        measured = [
            _rate(found.valid, len(rows)),
            _rate(found.successful, len(rows)),
            f"{found.episodes_share:.0%}",
            _progress(rows),
            f"{found.steps:,.0f}",
            f"{found.training_s:.0f}",
            ", ".join(dict.fromkeys(row.family for row in rows)),
        ]
    return "| " + " | ".join([name, f"{len(rows)} of {planned}", *measured]) + " |"


def _progress(rows: list[DesignRow]) -> str:
    found = [each.best_progress for row in rows for evaluation in row.evaluations for each in evaluation.episodes]
    return f"{fmean(found):.2f}" if found else ""


def _rate(hits: int, of: int) -> str:
    interval = Rate(hits, of).interval
    return f"{hits} of {of} ({interval.low:.0%} to {interval.high:.0%})"


def _comparison(rows: list[DesignRow], plan: StudyPlan) -> str:
    tried, won = {row.task for row in rows}, {row.task for row in rows if row.successful}
    checks = Counter(
        check.name for row in rows for each in row.evaluations for check in each.checks if not check.passed
    )
    failed = ", ".join(f"{name} {count}" for name, count in checks.most_common()) or "none"
    return (
        f"{len(tried)} of {len(plan.tasks)} tasks have a design that ended, {len(won)} of them a successful one. "
        f"Checks of validity that failed, by designs: {failed}. Published, for orientation only: {PAPER.valid:.1%} "
        f"valid, {PAPER.successful_by_table:.1%} successful ({PAPER.source})."
    )


if __name__ == "__main__":
    main()
