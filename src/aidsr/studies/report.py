"""Report of a study as an HTML page, with the results as Markdown, CSV and JSON. It only reads stored results."""

from __future__ import annotations

import csv
import io
import json
import math
from collections import Counter
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path

from aidsr.core.config import BUILTIN
from aidsr.core.formatting import counted, format_cell
from aidsr.core.html import html_template
from aidsr.runs.files import replace_file
from aidsr.studies import plots
from aidsr.studies.gallery import gallery
from aidsr.studies.outcomes import DesignRow, count_repairs, evaluated_by, read_outcomes, read_repairs
from aidsr.studies.records import COLUMNS, record_of
from aidsr.studies.runner import read_failures
from aidsr.studies.study import Study, StudyPlan
from aidsr.studies.tables import (
    PAPER,
    TOO_FEW_RUNS,
    ArmLine,
    Difference,
    Line,
    arm_lines,
    chance_in_words,
    differences,
    line_of,
    sample_in_words,
    task_lines,
)


def write_report(study: Study) -> Path:
    """Write report.html, .md, .csv and .json into the study's folder, and return the path of the HTML page."""
    rows = read_outcomes(study)
    arms = arm_lines(rows, {arm.name: arm.config.model for arm in study.plan.arms})
    first = study.plan.arms[0].name
    tables = {arm.arm: task_lines(rows, arm.arm) for arm in arms}
    replace_file(study.path / "report.csv", raw_csv(rows).encode())
    replace_file(study.path / "report.md", _markdown(study, rows, arms, tables).encode())
    replace_file(study.path / "report.json", _json(study, rows, arms).encode())
    page = _page(study, rows, arms, tables, first)
    replace_file(study.path / "report.html", page.encode())
    return study.path / "report.html"


def table_markdown(lines: Sequence[Line], *, trained: bool = True) -> str:
    """Return results by task as a Markdown table, with Wilson intervals of the rates."""
    head = [f"| {' | '.join(_COLUMNS)} |", "|---|" + "---:|" * (len(_COLUMNS) - 1)]
    rows = (map(format_cell, _cells(line, trained).values()) for line in lines)
    return "\n".join([*head, *(f"| {' | '.join(row)} |" for row in rows)])


def raw_csv(rows: Sequence[DesignRow]) -> str:
    """Return the raw rows as CSV, one for each design, with its evaluations aggregated."""
    out = io.StringIO()
    writer = csv.DictWriter(out, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows({**record_of(row), "training_s": round(row.training_s, 1)} for row in rows)
    return out.getvalue()


def percent(value: float | None) -> str:
    """Return a share as text in percent; a dash for None and NaN."""
    return "–" if value is None or math.isnan(value) else f"{100 * value:.0f} %"


def format_rate(line: Line, of: str) -> str:
    """Return one of a line's counts with its Wilson interval: 3/5 (23-88 %)."""
    found = line.rate(of)
    return f"{found.hits}/{found.of} ({percent(found.interval.low)[:-2]}–{percent(found.interval.high)})"


def taken_in_words(line: Line) -> tuple[str, str, str]:
    """Return the mean tokens, cost and latency of a design as text; dashes before any design has ended."""
    if not line.ended:
        return "–", "–", "–"
    tokens = f"{line.tokens:,.0f}" + (" est." if line.tokens_estimated else "")
    return tokens, "unknown" if line.cost_usd is None else f"${line.cost_usd:.2f}", f"{line.latency_s:.0f} s"


_COLUMNS: dict[str, Callable[[Line], str]] = {
    "task": lambda line: line.task,
    "designs": lambda line: str(line.attempted),
    "stable": lambda line: format_rate(line, "stable"),
    "valid": lambda line: format_rate(line, "valid"),
    "successful": lambda line: format_rate(line, "successful"),
    "at 80, 95 %": lambda line: f"{line.won_80}, {line.won_95}",
    "episodes": lambda line: percent(line.episodes_share),
    "probe": lambda line: percent(line.probe_progress),
    "tokens": lambda line: taken_in_words(line)[0],
    "cost": lambda line: taken_in_words(line)[1],
    "latency": lambda line: taken_in_words(line)[2],
}
"""Columns of the tables of tasks: the head of each, and the text of its cell."""

_AT_80_95 = (
    "*At 80, 95 %*: number of designs most of whose policies are valid and win at least this share of the held-out "
    "episodes; *successful* asks for half."
)
_OF_POLICIES = ("valid", "successful", "at 80, 95 %", "episodes")
"""Columns that are empty in a study without training."""


def _cells(line: Line, trained: bool = True) -> dict[str, str]:
    """Return the cells of a row by the heads of their columns."""
    return {head: text(line) if trained or head not in _OF_POLICIES else "–" for head, text in _COLUMNS.items()}


ARM_HEADS = (
    "arm",
    "changes",
    "approved",
    "stable",
    "valid",
    "successful",
    "episodes (95 % CI)",
    "iterations",
    "tokens",
)


def _arm_cells(study: Study, arm: ArmLine) -> list[str]:
    trained = study.plan.seeds > 0
    cells = _cells(arm.line, trained)
    interval = f" ({_between(arm.success_low, arm.success_high)})" if trained else ""
    return [
        arm.arm,
        study.arm(arm.arm).settings or "–",
        format_rate(arm.line, "approved"),
        cells["stable"],
        cells["valid"],
        cells["successful"],
        cells["episodes"] + interval,
        f"{arm.line.iterations:.1f}" if arm.line.ended else "–",
        cells["tokens"],
    ]


def _between(low: float | None, high: float | None) -> str:
    return TOO_FEW_RUNS if low is None or high is None else f"{percent(low)} to {percent(high)}"


def _markdown(
    study: Study, rows: Sequence[DesignRow], arms: Sequence[ArmLine], tables: dict[str, tuple[Line, ...]]
) -> str:
    head = [f"# Study {format_cell(study.path.name)}", _standing(study, rows)]
    if len(arms) > 1:
        compared = [f"| {' | '.join(ARM_HEADS)} |", "|---|---|" + "---:|" * (len(ARM_HEADS) - 2)]
        compared += [f"| {' | '.join(map(format_cell, _arm_cells(study, arm)))} |" for arm in arms]
        head += ["## Arms", "\n".join(compared)]
        against = differences(rows, arms[0].arm)
        real = [f"{d.arm} {d.what} {_change(d)}" for d in against if d.real]
        told = f"Significant differences from {arms[0].arm}: {'; '.join(real) or 'none'}."
        head += [f"{told} {chance_in_words(len(against))}".strip()]
    parts = [
        f"## {arm.arm} ({format_cell(arm.model)})\n\n"
        f"{table_markdown([*tables[arm.arm], arm.line], trained=study.plan.seeds > 0)}\n"
        for arm in arms
    ]
    legend = f"\n{_AT_80_95}\n" if study.plan.seeds else ""
    return "\n\n".join(head) + "\n\n" + "\n".join(parts) + f"{legend}\n{_paper_in_words(study)}\n"


def _standing(study: Study, rows: Sequence[DesignRow]) -> str:
    plan = study.plan
    return (
        f"{counted(len(plan.tasks), 'task')}, level {plan.level}, benchmark version {plan.benchmark_version}; "
        f"{format_training(plan.seeds, plan.steps, plan.protocol)}{_perturbed(plan)}. "
        f"{' '.join([_reached(study, line_of('all', rows)), *_notes(study, rows)])}"
    )


def _perturbed(plan: StudyPlan) -> str:
    """Return the end of a sentence, that successful policies were evaluated in perturbed scenes; empty if not so."""
    return "; successful policies also evaluated in perturbed scenes" if plan.seeds and plan.perturbed else ""


def _reached(study: Study, whole: Line) -> str:
    """Describe the progress of a study."""
    summary = f"{whole.ended} of {whole.attempted} designs finished."
    if study.plan.seeds and whole.complete < whole.ended:
        summary = f"{summary[:-1]}, {whole.complete} of them with every policy evaluated."
    if whole.complete < whole.attempted:
        summary += " Unfinished and failed designs are included in every denominator and count as failures."
    return summary


def _notes(study: Study, rows: Sequence[DesignRow]) -> list[str]:
    """Return a sentence for each fact that limits what the results of the policies mean."""
    notes = (
        resumed_in_words(rows),
        other_episodes_in_words(study.plan, rows),
        _unlike_software_in_words(rows),
        *_unneeded_in_words(rows),
    )
    return [note for note in notes if note]


def resumed_in_words(rows: Sequence[DesignRow]) -> str:
    """Return a sentence with the number of policies whose training was interrupted and resumed; empty if none."""
    resumed = sum(row.resumed for row in rows)
    if not resumed:
        return ""
    return f"{counted(resumed, 'policy')} resumed after an interruption, which changes the result of training."


def other_episodes_in_words(plan: StudyPlan, rows: Sequence[DesignRow]) -> str:
    """Return a sentence with the number of policies judged on fewer or more episodes than a verdict; empty if none."""
    other = sum(len(each.episodes) != plan.verdict_episodes for row in rows for each in row.evaluations)
    if not other:
        return ""
    return (
        f"{counted(other, 'policy')} evaluated on another number of held-out episodes than {plan.verdict_episodes}: "
        "not comparable; evaluate again with aidsr evaluate without --episodes."
    )


def _unlike_software_in_words(rows: Sequence[DesignRow]) -> str:
    """Return a sentence with the versions of the software that evaluated the policies; empty if it was only one."""
    found = evaluated_by(rows).most_common()
    if len(found) < 2:
        return ""
    counts = "; ".join(f"{count} by {software}" for software, count in found)
    return (
        f"Policies were evaluated by {len(found)} versions of the software, which can change their results: {counts}."
    )


def _unneeded_in_words(rows: Sequence[DesignRow]) -> list[str]:
    """Return a sentence on successful policies that are open-loop motions, and one on those that are not needed."""
    of = counted(sum(each.successful for row in rows for each in row.evaluations), "successful policy")
    motions, constant = sum(row.motions for row in rows), sum(row.won_by_mean_action for row in rows)
    found = []
    if motions:
        verb = "plays" if motions == 1 else "play"
        found.append(
            f"{motions} of {of} {verb} an open-loop motion, which learning did not beat (column motions of report.csv)."
        )
    if constant:
        found.append(
            f"In {constant} of {of} the constant mean action wins at least half of the replayed episodes, so no policy "
            "is needed (column won_by_mean_action of report.csv)."
        )
    return found


def format_training(seeds: int, steps: int, protocol: str) -> str:
    """Return in words how designs are trained: number of policies, budget and protocol."""
    if not seeds:
        return "not trained"
    return f"{counted(seeds, 'policy')} per design, at most {steps:,} control steps, protocol {protocol}"


def _change(found: Difference) -> str:
    """Return a difference with its interval as text."""
    value, interval = found.in_words
    return f"{value} ({interval})"


_PAPER_IN_WORDS = (
    f"Published, for orientation ({PAPER.source}): {100 * PAPER.valid:.1f} % valid, {100 * PAPER.successful:.1f} % "
    f"successful ({100 * PAPER.successful_by_table:.1f} % according to its table), {PAPER.tokens:,} tokens, "
    f"${PAPER.cost_usd:.2f} and {PAPER.latency_s:.0f} s per design."
)


def _paper_in_words(study: Study) -> str:
    rules = any(arm.config.model == BUILTIN for arm in study.plan.arms)
    return f"{_PAPER_IN_WORDS} {sample_in_words(study.plan.tasks)}" if rules else _PAPER_IN_WORDS


def _json(study: Study, rows: Sequence[DesignRow], arms: Sequence[ArmLine]) -> str:
    content = {
        "plan": study.plan.model_dump(mode="json"),
        "arms": [arm.model_dump(mode="json") for arm in arms],
        "designs": [row.model_dump(mode="json") for row in rows],
    }
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def _page(
    study: Study, rows: Sequence[DesignRow], arms: Sequence[ArmLine], tables: dict[str, tuple[Line, ...]], first: str
) -> str:
    seen, cured = read_repairs(study)
    cures = Counter((repair.code, repair.changed) for repair in cured)
    tasks = tuple(dict.fromkeys(row.task for row in rows))
    curves = {task: plots.curves_of_task(study, [row for row in rows if row.task == task]) for task in tasks}
    against = differences(rows, first)
    return html_template(Path(__file__).with_name("report.html.j2")).render(
        study=study,
        arms=arms,
        settings={arm.name: arm.settings for arm in study.plan.arms},
        arm_heads=ARM_HEADS,
        arm_rows=[_arm_cells(study, arm) for arm in arms],
        change=_change,
        heads=tuple(_COLUMNS),
        tables={arm: [_cells(line, study.plan.seeds > 0) for line in lines] for arm, lines in tables.items()},
        totals={arm.arm: _cells(arm.line, study.plan.seeds > 0) for arm in arms},
        percent=percent,
        between=_between,
        bars=plots.success_by_task(tables[first]) if tables else "",
        cost_plot=plots.cost_and_success(arms),
        colours=plots.arm_colours(study),
        curves={task: curve for task, curve in curves.items() if curve},
        untrained=[task for task, curve in curves.items() if not curve],
        cards=gallery(study, rows),
        differences=against,
        chance=chance_in_words(len(against)),
        faults=[(code, count, {how: cures[code, how] for how in _HOWS}) for code, count in seen.most_common()],
        hows=_HOWS,
        fixed=count_repairs(study).most_common(),
        policies=_policies(rows),
        unmet=_unmet(rows),
        failures=read_failures(study),
        paper=_paper_in_words(study),
        published=_published(),
        whole=line_of("all", rows),
        reached=_reached(study, line_of("all", rows)),
        notes=_notes(study, rows),
        count=counted,
        evaluated_by=evaluated_by(rows).most_common(),
        perturbed=_perturbed(study.plan),
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    )


_HOWS = ("concept", "robot", "placement")


def _policies(rows: Sequence[DesignRow]) -> list[tuple[str, dict[str, int]]]:
    """Return for each task how many held-out episodes ended in which way, including those of invalid policies."""
    found = {task: Counter[str]() for task in dict.fromkeys(row.task for row in rows)}
    for row in rows:
        found[row.task].update(episode.ended for each in row.evaluations for episode in each.episodes)
    return [(task, dict(counts)) for task, counts in found.items() if counts]


def _unmet(rows: Sequence[DesignRow]) -> list[tuple[str, int]]:
    """Return the plausibility checks that policies failed, and how often, most frequent first."""
    checks = (check for row in rows for each in row.evaluations for check in each.checks)
    return Counter(check.name for check in checks if not check.passed).most_common()


def _published() -> list[str]:
    """Return the paper's published results as a row of the table of tasks."""
    cells = {
        "task": "published, with GPT-5 on other tasks",
        "valid": f"{100 * PAPER.valid:.1f} %",
        "successful": f"{100 * PAPER.successful_by_table:.1f} %",
        "tokens": f"{PAPER.tokens:,}",
        "cost": f"${PAPER.cost_usd:.2f}",
        "latency": f"{PAPER.latency_s:.0f} s",
    }
    return [cells.get(head, "") for head in _COLUMNS]
