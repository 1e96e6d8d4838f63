"""A study as one page, and its figures as Markdown, CSV and JSON beside it. Nothing here is measured: all is read."""

from __future__ import annotations

import csv
import io
import json
import math
from collections import Counter
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from aidsr.benchmark import pictures
from aidsr.benchmark.driving import failures_of
from aidsr.benchmark.outcomes import DesignRow, read_outcomes, read_repairs
from aidsr.benchmark.study import Study
from aidsr.benchmark.tables import PAPER, ArmLine, Line, arm_lines, differences, line_of, task_lines
from aidsr.runs.files import replace_file

__all__ = ["raw_csv", "table_markdown", "write_report"]

_GALLERY = 3
"""Designs of a task in the gallery, the best ones. Our choice: a page that can still be sent by mail."""


def write_report(study: Study) -> Path:
    """Write report.html, .md, .csv and .json into the study's folder, and return the page's path."""
    rows = read_outcomes(study)
    arms = arm_lines(rows, {arm.name: arm.config.model for arm in study.plan.arms})
    first = study.plan.arms[0].name
    tables = {arm.arm: task_lines(rows, arm.arm) for arm in arms}
    replace_file(study.path / "report.csv", raw_csv(rows).encode())
    replace_file(study.path / "report.md", _markdown(arms, tables).encode())
    replace_file(study.path / "report.json", _json(study, rows, arms).encode())
    page = _page(study, rows, arms, tables, first)
    replace_file(study.path / "report.html", page.encode())
    return study.path / "report.html"


def table_markdown(lines: Sequence[Line]) -> str:
    """Return figures by task as a Markdown table, the rates with their Wilson intervals."""
    head = (
        "| task | designs | stable | valid | successful | episodes | probe | tokens | cost | latency |\n"
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
    )
    return "\n".join([head, *("| " + " | ".join(_cells(line)) + " |" for line in lines)])


def raw_csv(rows: Sequence[DesignRow]) -> str:
    """Return the raw rows, one a design, its evaluations summed up."""
    out = io.StringIO()
    fields = ["arm", "task", "run", "design", "family", "outcome", "stable", "valid", "successful", "episodes_share"]
    fields += ["probe_progress", "iterations", "input_tokens", "output_tokens", "cost_usd", "latency_s", "steps"]
    writer = csv.DictWriter(out, [*fields, "training_s"], lineterminator="\n")
    writer.writeheader()
    for row in rows:
        plain = {name: getattr(row, name) for name in fields if hasattr(row, name)}
        usage = {name: getattr(row.usage, name) for name in ("input_tokens", "output_tokens", "cost_usd")}
        share = sum(row.episodes) / len(row.episodes) if row.episodes else ""
        writer.writerow({**plain, **usage, "episodes_share": share, "training_s": round(row.training_s, 1)})
    return out.getvalue()


def percent(value: float | None) -> str:
    """Return a share as a person reads it."""
    return "–" if value is None or math.isnan(value) else f"{100 * value:.0f} %"


def _cells(line: Line) -> list[str]:
    def rate(of: str) -> str:
        found = line.rate(of)
        interval = found.interval
        return f"{found.hits}/{found.of} ({percent(interval.low)[:-2]}–{percent(interval.high)})"

    tokens = f"{line.tokens:,.0f}" + (" est." if line.tokens_estimated else "")
    return [
        line.task,
        str(line.attempted),
        *(rate(of) for of in ("stable", "valid", "successful")),
        percent(line.episodes_share),
        percent(line.probe_progress),
        tokens,
        "unknown" if line.cost_usd is None else f"${line.cost_usd:.2f}",
        f"{line.latency_s:.0f} s",
    ]


def _markdown(arms: Sequence[ArmLine], tables: dict[str, tuple[Line, ...]]) -> str:
    parts = [f"## {arm.arm} ({arm.model})\n\n{table_markdown([*tables[arm.arm], arm.line])}\n" for arm in arms]
    return "# Study\n\n" + "\n".join(parts) + f"\n{_PAPER_IN_WORDS}\n"


_PAPER_IN_WORDS = (
    f"Published, for orientation ({PAPER.source}): {100 * PAPER.valid:.1f} % valid, {100 * PAPER.successful:.1f} % "
    f"successful ({100 * PAPER.successful_by_table:.1f} % by its own table), {PAPER.tokens:,} tokens, "
    f"${PAPER.cost_usd:.2f} and {PAPER.latency_s:.0f} s a design."
)


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
    template = Environment(
        loader=PackageLoader("aidsr.benchmark", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    ).get_template("report.html.j2")
    return template.render(
        study=study,
        arms=arms,
        heads=("task", "designs", "stable", "valid", "successful", "episodes", "probe", "tokens", "cost", "latency"),
        tables={arm: [_cells(line) for line in lines] for arm, lines in tables.items()},
        totals={arm.arm: _cells(arm.line) for arm in arms},
        percent=percent,
        bars=pictures.success_by_task(tables[first]) if tables else "",
        cost_plot=pictures.cost_and_success(arms),
        curves={task: pictures.curves_of_task(study, [row for row in rows if row.task == task]) for task in tasks},
        gallery={task: _gallery(study, rows, task) for task in tasks},
        differences=differences(rows, first),
        faults=[(code, count, {how: cures[code, how] for how in _HOWS}) for code, count in seen.most_common()],
        hows=_HOWS,
        failures=failures_of(study),
        paper=_PAPER_IN_WORDS,
        whole=line_of("all", rows),
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
    )


_HOWS = ("concept", "robot", "placement")


def _gallery(study: Study, rows: Sequence[DesignRow], task: str) -> list[tuple[str, str]]:
    """Return pictures of a task's best designs, each as a data URL with a caption."""
    best = sorted(
        (row for row in rows if row.task == task and row.stable),
        key=lambda row: (row.successful, sum(row.episodes), row.probe_progress or 0.0),
        reverse=True,
    )[:_GALLERY]
    cells = {(cell.arm, cell.task, cell.number): cell for cell in study.cells}
    found = []
    for row in best:
        run = study.run(cells[row.arm, row.task, row.run])
        iterations = run.design(row.design).iterations if run else ()
        strip = next((drawn for it in reversed(iterations) if (drawn := it.motion.read() or it.preview.read())), None)
        if strip:
            share = percent(sum(row.episodes) / len(row.episodes)) if row.episodes else "not trained"
            found.append((pictures.data_url(strip), f"{row.family}, {row.arm}, run {row.run}: {share}"))
    return found
