"""How many designs of the built-in team are valid and successful, task by task.

    python benchmarks/builtin/table.py --designs 3 --steps 300000 --jobs 2

Policies are trained by protocol `best`; successful ones are also played in perturbed scenes. All 18 tasks are used
unless some are named. The table has separate totals for the 14 tasks that the rules were written with in view (in
sample) and for the 4 that came later (out of sample). The command runs a study (aidsr.studies) with one concept per
run: the n-th design of a task is the first concept of seed n - 1. Every task gets its first design before any task gets
its second, so a table that is stopped early is still useful. Raw outcomes are written to results-version8.jsonl beside
this file and the table made from them to results-version8.md, or to files of another name (`--out mine`). The same
command continues a stopped study, on this machine or another one: a policy whose outcome is in the .jsonl is not
trained again. To train everything yourself, name files that do not exist yet.

`--seeds 3` trains three policies per design; a design then counts as valid or successful if most of its policies do.
`--publish` copies policies and scenes to a folder that `aidsr evaluate` can read. `--write-only` also rewrites tables
of earlier versions of the benchmark from their .jsonl.
"""

from __future__ import annotations

import argparse
import io
import sys
import zipfile
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from statistics import fmean, median
from typing import Any

from pydantic import Field

from aidsr.core.artifacts import Artifact, Evaluation
from aidsr.core.config import BUDGET_STEPS, VERDICT_EPISODES, Protocol, RunConfig
from aidsr.core.errors import UserError
from aidsr.core.provenance import commit, processor
from aidsr.core.rates import Rate
from aidsr.learn.rl.policy import without_critics
from aidsr.learn.rl.recipe import PROTOCOLS, Recipe
from aidsr.learn.rl.training_folder import TrainingFolder
from aidsr.runs.files import replace_file
from aidsr.studies.jobs import Job
from aidsr.studies.outcomes import DesignRow, read_outcomes
from aidsr.studies.planned import training_folder_of
from aidsr.studies.pool import LocalPool
from aidsr.studies.runner import Progress, run_study
from aidsr.studies.study import Arm, Cell, Study, StudyPlan, create_study, versions_now
from aidsr.studies.tables import PAPER, sample_in_words
from aidsr.tasks import BENCHMARK_VERSION, TASKS, TASKS_IN_SAMPLE, TASKS_OUT_OF_SAMPLE, is_current, load_task

HOME = Path(__file__).parent
_OUT = f"results-version{BENCHMARK_VERSION}"
_FIRST_OUT = "results"
"""Name of the table of version 3, when file names did not carry the version."""
_SHARES = (0.5, 0.8, 0.95)
"""Shares of episodes won that are counted. The first gives the paper's binary rate; the others distinguish a reliable
policy from a lucky one."""
_PUBLISHED = ("config.json", "scene.xml", "normalisation.json", "training.json", "evaluation.json")
_PENALTY = "overlap_penalty"
_PROTOCOL: Protocol = "best"
"""Protocol that policies are trained by today."""


class Row(Artifact):
    """Result of one evaluated policy of a design, or of a design without a policy because it was not approved."""

    task: str
    level: str
    design: int
    family: str
    outcome: str
    """Outcome in the design's outcome.json."""
    valid: bool
    successful: bool
    success_share: float
    """Share of held-out episodes that succeeded; 0 if the policy is not valid."""
    steps: int
    training_s: float
    resumed: int = 0
    """How often the training resumed after it was killed while learning. A resumed training gives another policy than
    an undisturbed one. In rows older than this field it is unknown and reads 0."""
    benchmark_version: int
    most_steps: int
    """Limit of control steps per policy."""
    recipe: dict[str, Any] | None = None
    """Recipe at the time of training, with the fields of that time; None if it was not recorded."""
    mujoco: str
    policy_seed: int = 0
    commit: str = ""
    """Commit of the source that evaluated. This field and those below are empty in rows older than the fields."""
    processor: str = ""
    versions: dict[str, str] = Field(default_factory=dict)
    scene_sha256: str = ""
    """SHA-256 of the training scene; shows whether today's team would make the same scene."""
    policy_sha256: str = ""
    episodes: dict[str, int] = Field(default_factory=dict)
    """Number of held-out episodes for each way to end."""
    best_progress: float | None = None
    """Mean, over the held-out episodes, of the best progress of each."""
    penalized_share: float | None = None
    """Share of the time of successful episodes in which the task's penalty applied, for example because of too large a
    force; None in older rows and if no episode is won."""
    kept_perturbed: dict[str, float] = Field(default_factory=dict)
    """Share of successes kept, by kind of perturbed scene; empty if the policy is not successful."""
    failed_checks: dict[str, str] = Field(default_factory=dict)
    """Failed plausibility checks with their messages."""


def main() -> None:
    """Run the remaining part of the study, and update its table after each job."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", type=Path, help="of the study; build/builtin-STEPS unless named")
    parser.add_argument("--tasks", nargs="+", default=list(TASKS), help="all unless named")
    parser.add_argument("--designs", type=int, default=3, help="of each task")
    parser.add_argument("--steps", type=int, default=BUDGET_STEPS, help="control steps a policy, at most")
    parser.add_argument("--jobs", type=int, default=2, help="side by side, one core each")
    parser.add_argument("--seeds", type=int, default=1, help="policies of each design")
    parser.add_argument("--out", default=_OUT, help="name of the table, without its ending")
    parser.add_argument("--publish", type=Path, help="folder to copy policies and scenes to")
    parser.add_argument("--write-only", action="store_true", help="write the table of what is there, do nothing else")
    asked = parser.parse_args()
    if asked.write_only and _write_earlier(asked.out):
        return
    folder = asked.folder or Path("build") / f"builtin-{asked.steps}"
    plan = StudyPlan(
        tasks=tuple(load_task(name).name for name in asked.tasks),
        arms=(Arm(name="builtin", config=RunConfig(model="builtin", concepts=1)),),
        runs=asked.designs,
        seeds=asked.seeds,
        steps=asked.steps,
        protocol=_PROTOCOL,
        probe=False,
        perturbed=True,
        versions=versions_now(),
    )
    published = kept(HOME / f"{asked.out}.jsonl", plan)
    study = create_study(folder, plan)
    if not asked.write_only:
        there = Counter((row.task, row.design) for row in published)
        without = {(row.task, row.design) for row in published if row.best_progress is None}
        elsewhere = {
            cell
            for cell in study.cells
            if there[cell.task, cell.number] >= plan.seeds or (cell.task, cell.number) in without
        }
        sys.stdout.write(f"{len(elsewhere)} of {_planned(plan)} designs are in {asked.out}.jsonl already\n")
        cells = {(cell.task, cell.number): cell for cell in study.cells}
        trained = {Job(cells[row.task, row.design], "train", 1, row.policy_seed) for row in published}
        kept_elsewhere = frozenset({*elsewhere, *trained})
        run_study(study, LocalPool(folder, asked.jobs), partial(_note, study, published, asked.out), kept_elsewhere)
    _write(study, published, asked.out)
    if asked.publish:
        publish(study, asked.publish)


def _write_earlier(out: str) -> bool:
    """Write the table of outcomes of an earlier version or another protocol; return False for today's outcomes."""
    rows = read_rows(HOME / f"{out}.jsonl")
    if not rows or _is_todays(plan := plan_of(rows)):
        return False
    replace_file(HOME / f"{out}.md", table(plan, rows, out).encode())
    return True


def _is_todays(plan: StudyPlan) -> bool:
    return (plan.benchmark_version, plan.protocol) == (BENCHMARK_VERSION, _PROTOCOL)


def _recipe(protocol: Protocol) -> dict[str, Any]:
    return PROTOCOLS[protocol].model_dump(mode="json")


def _comparable(row: Row) -> dict[str, Any] | None:
    """Return a row's recipe as far as it decides whether the row fits a table.

    A script was found by the protocol's own search, because the plan gives none. Older recipes, without the field
    `correction`, get its default. Policies from before deep overlap was penalized stay in the table, which says how
    many there are.
    """
    if row.recipe is None:
        return None
    today = _recipe(_protocol_of(row))
    same = {name: today[name] for name in ("script", _PENALTY)}
    return Recipe().model_dump(mode="json", include={"correction"}) | row.recipe | same


def plan_of(rows: Sequence[Row]) -> StudyPlan:
    """Return the plan that rows follow, without those that no longer count.

    Raises:
        UserError: The rows differ in version, level, budget or protocol.
    """
    rows = counting(rows)
    found = sorted({(_version_of(row), row.level, row.most_steps, _protocol_of(row)) for row in rows})
    if len(found) > 1:
        told = "; ".join(f"version {v}, level {level}, {steps:,} steps, `{by}`" for v, level, steps, by in found)
        raise UserError(f"rows of one table differ in version, level, budget or protocol: {told}; keep one in the file")
    ((version, level, steps, protocol),) = found
    return StudyPlan(
        tasks=tuple(dict.fromkeys(row.task for row in rows)),
        level=level,
        arms=(Arm(name="builtin", config=RunConfig(model="builtin", concepts=1)),),
        runs=max(row.design for row in rows),
        seeds=1 + max(row.policy_seed for row in rows),
        steps=steps,
        protocol=protocol,
        perturbed=any(row.kept_perturbed for row in rows),
        benchmark_version=version,
    )


def counting(rows: Sequence[Row]) -> tuple[Row, ...]:
    """Return the rows whose tasks have not changed since; all rows in a table of an earlier version, without any."""
    return tuple(row for row in rows if _version_of(row) == BENCHMARK_VERSION) or tuple(rows)


def _version_of(row: Row) -> int:
    """Return the version of the benchmark in which a row counts: today's if its task has not changed since."""
    return BENCHMARK_VERSION if is_current(row.task, row.benchmark_version) else row.benchmark_version


def _protocol_of(row: Row) -> Protocol:
    """Return the protocol that a policy was trained by; the recipe's algorithm alone decides."""
    algorithm = (row.recipe or {}).get("algorithm", "ppo")
    return next(name for name, recipe in PROTOCOLS.items() if recipe.algorithm == algorithm)


def publish(study: Study, folder: Path) -> None:
    """Copy the files that `aidsr evaluate` needs to evaluate policies again, without the weights of the critics."""
    for cell in study.cells:
        run = study.run(cell)
        homes = [training_folder_of(run.design(1), seed) for seed in range(study.plan.seeds)] if run else []
        for seed, home in enumerate(homes):
            if not (home / "evaluation.json").exists():
                continue
            target = folder / cell.task.rpartition("/")[2] / f"{cell.number}-{seed}"
            target.mkdir(parents=True, exist_ok=True)
            for name in _PUBLISHED:
                replace_file(target / name, (home / name).read_bytes())
            with zipfile.ZipFile(home / "policy.zip") as trained, io.BytesIO() as weights:
                with zipfile.ZipFile(weights, "w", zipfile.ZIP_DEFLATED) as archive:
                    archive.writestr(zipfile.ZipInfo("policy.pth"), without_critics(trained.read("policy.pth")))
                replace_file(target / "policy.zip", weights.getvalue())


def _note(study: Study, published: Sequence[Row], out: str, progress: Progress) -> None:
    _write(study, published, out)
    if progress.last:
        said = progress.last.error or "done"
        sys.stdout.write(f"{progress.last.job.name}: {said} ({progress.last.wall_s:.0f} s)\n")
        sys.stdout.flush()


def _write(study: Study, published: Sequence[Row], out: str) -> None:
    rows = merged(study, published)
    rows = _in_order([*rows, *_superseded(HOME / f"{out}.jsonl", rows)], study.plan)
    raw = "".join(row.model_dump_json(exclude_none=True) + "\n" for row in rows)
    replace_file(HOME / f"{out}.jsonl", raw.encode())
    replace_file(HOME / f"{out}.md", table(study.plan, rows, out).encode())


def kept(path: Path, plan: StudyPlan) -> tuple[Row, ...]:
    """Return the outcomes in a file that count, none if there is no file.

    Raises:
        UserError: An outcome was made under other conditions than the plan's, or its design is not in the plan.
    """
    return tuple(_fitting(row, plan, path) for row in counting(read_rows(path)))


def _superseded(path: Path, rows: Sequence[Row]) -> list[Row]:
    """Return the outcomes in a file that no longer count and that no row replaces: they stay, in no figure."""
    before = read_rows(path)
    there = {_key(row) for row in (*rows, *counting(before))}
    return [row for row in before if _key(row) not in there]


def _key(row: Row) -> tuple[str, int, int]:
    return row.task, row.design, row.policy_seed


def read_rows(path: Path) -> tuple[Row, ...]:
    """Return the outcomes in a file, none if there is no file."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return tuple(Row.model_validate_json(line) for line in lines)


def merged(study: Study, published: Sequence[Row]) -> list[Row]:
    """Return the published outcomes and those of the study, by design number and task; published ones have precedence.

    Raises:
        UserError: An outcome of the study was made under other conditions than the plan's.
    """
    found = {_key(row): row for row in published}
    for design in read_outcomes(study):
        if design.evaluations or design.outcome not in ("unfinished", "approved"):
            for row in rows_of(design, study):
                found.setdefault(_key(row), _fitting(row, study.plan, study.path))
    return _in_order(found.values(), study.plan)


def _in_order(rows: Iterable[Row], plan: StudyPlan) -> list[Row]:
    """Return rows by design number, then as the plan orders the tasks."""
    places = {task: place for place, task in enumerate(plan.tasks)}
    return sorted(rows, key=lambda row: (row.design, places.get(row.task, len(places)), row.policy_seed))


def _fitting(row: Row, plan: StudyPlan, where: Path) -> Row:
    conditions = (_version_of(row), row.level, row.most_steps, _comparable(row))
    recipe = _recipe(plan.protocol)
    asked = conditions == (plan.benchmark_version, plan.level, plan.steps, recipe)
    if not asked or row.task not in plan.tasks or row.design > plan.runs or row.policy_seed >= plan.seeds:
        raise UserError(
            f"{where} holds design {row.design} of {row.task} with version {row.benchmark_version} of the "
            f"benchmark, level {row.level}, {row.most_steps:,} steps, recipe {row.recipe}; the table asked for has no "
            f"place for it: version {plan.benchmark_version}, level {plan.level}, {plan.steps:,} steps, recipe "
            f"{recipe}, {plan.runs} designs of {len(plan.tasks)} tasks. Name another file with --out, another folder "
            "with --folder"
        )
    return row


def rows_of(design: DesignRow, study: Study) -> list[Row]:
    """Return the rows of a finished design: one for each evaluated policy, or a single row if there is none."""
    plan, run = study.plan, study.run(Cell(design.arm, design.task, design.run))
    assert run is not None, "it came to its end"
    homes = [TrainingFolder(training_folder_of(run.design(design.design), seed)) for seed in range(plan.seeds)]
    judged = [home for home in homes if (home / "evaluation.json").exists()]
    facts = {
        "task": design.task,
        "level": plan.level,
        "design": design.run,
        "family": design.family,
        "outcome": design.outcome,
    }
    if not judged:
        return [_untrained(facts, plan)]
    return [_trained(facts, home) for home in judged]


def _untrained(facts: dict[str, Any], plan: StudyPlan) -> Row:
    return Row(
        **facts,
        valid=False,
        successful=False,
        success_share=0.0,
        steps=0,
        training_s=0.0,
        benchmark_version=plan.benchmark_version,
        most_steps=plan.steps,
        recipe=_recipe(plan.protocol),
        mujoco=plan.versions["mujoco"],
        commit=commit(),
        processor=processor(),
        versions=plan.versions,
    )


def _trained(facts: dict[str, Any], home: TrainingFolder) -> Row:
    config, evaluation = home.read_json("config.json"), home.read("evaluation.json", Evaluation)
    result = home.read_json("training.json")
    return Row(
        **facts,
        valid=evaluation.valid,
        successful=evaluation.successful,
        success_share=evaluation.success_share if evaluation.valid else 0.0,
        steps=result["steps"],
        training_s=result["wall_s"],
        resumed=result.get("resumed", 0),
        benchmark_version=config["benchmark_version"],
        most_steps=config["steps"],
        recipe=config["recipe"],
        mujoco=config["versions"]["mujoco"],
        policy_seed=config["seed"],
        commit=evaluation.commit,
        processor=evaluation.processor,
        versions=evaluation.versions,
        scene_sha256=config["scene_sha256"],
        policy_sha256=evaluation.policy_sha256,
        episodes=Counter(each.ended for each in evaluation.episodes),
        best_progress=fmean(each.best_progress for each in evaluation.episodes),
        penalized_share=evaluation.penalized_share,
        kept_perturbed={each.kind: share for each in evaluation.perturbed if (share := each.kept_share) is not None},
        failed_checks={each.name: each.message for each in evaluation.checks if not each.passed},
    )


def table(plan: StudyPlan, rows: Sequence[Row], out: str = _OUT) -> str:
    """Return outcomes as a Markdown table. Rates cover the designs that ended; the page states how many ended.

    Outcomes that no longer count are in no figure; the page states how many there are.
    """
    every, rows = rows, counting(rows)
    mujoco = " and ".join(sorted({row.mujoco for row in rows})) or plan.versions["mujoco"]
    counts = sorted({sum(row.episodes.values()) for row in rows if row.episodes}) or [VERDICT_EPISODES]
    designs = _designs(rows)
    lines = [
        "# What the built-in team's robots learn",
        "",
        f"Made by `{_command(plan, out)}` with MuJoCo {mujoco}, version {plan.benchmark_version} of the benchmark, "
        f"level {plan.level}, {'one seed' if plan.seeds == 1 else f'{plan.seeds} policies a design'}, "
        f"at most {plan.steps:,} control steps a policy{_protocol_in_words(plan)}; "
        f"the benchmark's budget is {BUDGET_STEPS:,}. "
        f"A policy is judged on {' or '.join(map(str, counts))} held-out episodes.{_made_with(rows)}"
        f"{_unaware_of_overlap(rows)}{_motions(rows)}{_no_longer(len(every) - len(rows))}",
        "",
        f"{sample_in_words(plan.tasks)}{_earlier(plan)}",
        "",
        f"**{len(designs)} of {_planned(plan)} planned designs came to an end**; any others are in no figure. A design "
        "ends when its policy is judged, or when it is not approved: then it counts as neither valid nor successful. "
        "*Successful* is valid with at least 50 % of the episodes won, the paper's binary rate; beside it the designs "
        "with at least 80 and 95 %. Intervals: Wilson, 95 %. *Episodes won* counts those of invalid policies as lost; "
        "*progress* is the mean of the furthest that each held-out episode came, of valid and invalid policies alike. "
        "Progress and steps are means over the policies that were trained; time is their median wall time, longer "
        f"where other work ran beside.{_PERTURBED * plan.perturbed}",
        "",
        _head(plan),
        "|---" * _head(plan).count(" |") + "|",
        *(_line(task, rows, (task,), plan) for task in plan.tasks),
        *_subtotals(rows, plan),
        _line("**all**", rows, plan.tasks, plan),
        "",
        _comparison(rows, plan),
    ]
    return "\n".join(lines) + "\n"


_PERTURBED = (
    " *Perturbed, kept* is of successful policies alone: the share of their successes that they keep in the same "
    "variations with parameters, delay and cable friction off (docs/learning.md), mean over kinds and policies. "
    "*Penalized* is the share of the time of their successful episodes in which the task's penalty applied, for "
    "example because of too large a force; success does not test it unless the task says so; empty where rows do not "
    "record it."
)


def _head(plan: StudyPlan) -> str:
    kept = "| perturbed, kept | penalized " * plan.perturbed
    return (
        f"| task | ended | valid | successful | 80 % | 95 % | episodes won {kept}| progress | control steps "
        "| training, wall s | families |"
    )


def _subtotals(rows: Sequence[Row], plan: StudyPlan) -> list[str]:
    """Return a line for the tasks in sample and one for those out of sample, if a table has both."""
    samples = {
        "**in sample**": [task for task in plan.tasks if task not in TASKS_OUT_OF_SAMPLE],
        "**out of sample**": [task for task in plan.tasks if task in TASKS_OUT_OF_SAMPLE],
    }
    return [_line(name, rows, tasks, plan) for name, tasks in samples.items()] if all(samples.values()) else []


def _protocol_in_words(plan: StudyPlan) -> str:
    """Return the protocol in words; empty for earlier versions (version 3 and before had only one)."""
    return f" by protocol `{plan.protocol}`" if plan.benchmark_version == BENCHMARK_VERSION else ""


def _made_with(rows: Sequence[Row]) -> str:
    """Return sentences on the commits and processors of the evaluations and on resumed trainings; empty if unknown."""
    commits, processors = (sorted({getattr(row, of) for row in rows} - {""}) for of in ("commit", "processor"))
    resumed = sum(row.resumed > 0 for row in rows)
    again = f" {resumed} of the policies resumed while learning, after their process was killed." if resumed else ""
    return (f" Evaluated at commit {', '.join(commits)} on {', '.join(processors)}." if commits else "") + again


def _unaware_of_overlap(rows: Sequence[Row]) -> str:
    """Return a sentence on the policies of `best` that deep overlap cost nothing; empty if there are none."""
    unaware = [row for row in rows if row.steps and row.recipe and not row.recipe.get(_PENALTY)]
    count = sum(_protocol_of(row) == "best" for row in unaware)
    return f" {count} of the policies were trained before `best` penalized deep overlap." if count else ""


def _motions(rows: Sequence[Row]) -> str:
    """Return a sentence on the policies that are a motion of the protocol's search; empty if there are none."""
    count = sum(bool(row.recipe and row.recipe.get("script")) for row in rows)
    return f" {count} of the policies are an open-loop motion of a probe that learning did not beat." if count else ""


def _no_longer(count: int) -> str:
    """Return a sentence on the outcomes that no longer count; empty if there are none."""
    return f" {count} older outcomes, of tasks that have changed since, are in no figure." if count else ""


def _earlier(plan: StudyPlan) -> str:
    if plan.benchmark_version == BENCHMARK_VERSION:
        if plan.protocol == _PROTOCOL:
            return ""
        return (
            f" These policies were trained by protocol `{plan.protocol}`; the command trains by `{_PROTOCOL}` today, "
            "and figures of the two do not mix."
        )
    return (
        f" These are results of version {plan.benchmark_version} of the benchmark, which did not ask whether cables "
        f"and a soft body do the work; today's is version {BENCHMARK_VERSION}, and its figures are not comparable."
    )


def _designs(rows: Sequence[Row]) -> list[list[Row]]:
    """Return rows by design."""
    found: dict[tuple[str, int], list[Row]] = {}
    for row in rows:
        found.setdefault((row.task, row.design), []).append(row)
    return list(found.values())


def _most(designs: Sequence[Sequence[Row]], least: float) -> int:
    """Return the number of designs most of whose policies are valid and win at least this share of their episodes."""
    won = ([row.valid and row.success_share >= least for row in policies] for policies in designs)
    return sum(2 * sum(policies) > len(policies) for policies in won)


def _planned(plan: StudyPlan) -> int:
    return len(plan.tasks) * plan.runs


def _command(plan: StudyPlan, out: str) -> str:
    every = tuple(TASKS) if plan.benchmark_version == BENCHMARK_VERSION else TASKS_IN_SAMPLE
    tasks = "" if plan.tasks == every else f" --tasks {' '.join(plan.tasks)}"
    seeds = "" if plan.seeds == 1 else f" --seeds {plan.seeds}"
    named = "" if out in (_OUT, _FIRST_OUT) else f" --out {out}"
    return f"python benchmarks/builtin/table.py --designs {plan.runs} --steps {plan.steps}{seeds}{tasks}{named}"


def _line(name: str, every: Sequence[Row], tasks: Sequence[str], plan: StudyPlan) -> str:
    rows = [row for row in every if row.task in tasks]
    measured, designs = [""] * (9 + 2 * plan.perturbed), _designs(rows)
    if rows:
        trained = [row for row in rows if row.best_progress is not None]
        reached = [_most(designs, least) for least in _SHARES]
        measured = [
            _rate(_most(designs, 0.0), len(designs)),
            _rate(reached[0], len(designs)),
            *(f"{count} of {len(designs)}" for count in reached[1:]),
            f"{fmean(row.success_share for row in rows):.0%}",
            *[_kept(rows), _penalized(rows)] * plan.perturbed,
            f"{fmean(row.best_progress or 0.0 for row in trained):.2f}" if trained else "",
            f"{fmean(row.steps for row in trained):,.0f}" if trained else "",
            f"{median(row.training_s for row in trained):.0f}" if trained else "",
            ", ".join(dict.fromkeys(row.family for row in rows)),
        ]
    return "| " + " | ".join([name, f"{len(designs)} of {len(tasks) * plan.runs}", *measured]) + " |"


def _kept(rows: Sequence[Row]) -> str:
    """Return the mean share of success that policies keep in perturbed scenes; empty if none was played in them."""
    kept = [fmean(row.kept_perturbed.values()) for row in rows if row.kept_perturbed]
    return f"{fmean(kept):.0%}" if kept else ""


def _penalized(rows: Sequence[Row]) -> str:
    """Return successful policies' mean share of time in which the task's penalty applied; empty if not recorded."""
    shares = [row.penalized_share for row in rows if row.successful and row.penalized_share is not None]
    return f"{fmean(shares):.0%}" if shares else ""


def _rate(hits: int, of: int) -> str:
    interval = Rate(hits, of).interval
    return f"{hits} of {of} ({interval.low:.0%} to {interval.high:.0%})"


def _comparison(rows: Sequence[Row], plan: StudyPlan) -> str:
    tried, won = {row.task for row in rows}, {row.task for row in rows if row.successful}
    checks = Counter(name for row in rows for name in row.failed_checks)  # one row per policy
    failed = ", ".join(f"{name} {count}" for name, count in checks.most_common()) or "none"
    return (
        f"{len(tried)} of {len(plan.tasks)} tasks have a design that ended, {len(won)} of them a successful one. "
        f"Checks of validity that failed, by policies: {failed}. Published, for orientation only: {PAPER.valid:.1%} "
        f"valid, {PAPER.successful:.1%} successful, {PAPER.successful_by_table:.1%} by its own table ({PAPER.source}); "
        "not comparable with rules that were written with these tasks in view."
    )


if __name__ == "__main__":
    try:
        main()
    except UserError as error:
        sys.exit(str(error))
