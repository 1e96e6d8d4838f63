"""Pictures of a study's report, as SVG or PNG text that stands in the page itself."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from aidsr.runs.trainings import Training, read_curve
from aidsr.studies.jobs import training_folder_of
from aidsr.studies.outcomes import DesignRow
from aidsr.studies.study import Study
from aidsr.studies.tables import PAPER, ArmLine, Line

_INK, _GRID = "#5b6573", "#d5dbe3"
_OF_THE_PAGE = {_INK: "var(--soft)", _GRID: "var(--line)"}
"""Variables of the page's style, which differ where it is dark."""
_COLOURS = ("#2f6f9f", "#d08a2e", "#4f8a5b", "#9a4f7d", "#7a6f5d", "#3f9a9a", "#b3543f", "#6b5fb0")


def success_by_task(lines: Sequence[Line]) -> str:
    """Return bars of valid and successful designs by task, with Wilson intervals."""
    figure = Figure(figsize=(5.2, 0.3 * len(lines) + 0.9), layout="constrained")
    axes = figure.subplots()
    for row, line in enumerate(reversed(lines)):
        for offset, of, colour in ((0.18, "valid", _COLOURS[0]), (-0.18, "successful", _COLOURS[1])):
            rate = line.rate(of)
            if rate.of:
                interval = rate.interval
                axes.barh(row + offset, 100 * rate.share, height=0.32, color=colour, label=of if row == 0 else None)
                axes.plot([100 * interval.low, 100 * interval.high], [row + offset] * 2, color=_INK, linewidth=0.9)
    axes.set_yticks(range(len(lines)), [line.task.rpartition("/")[2].replace("_", " ") for line in reversed(lines)])
    axes.set_xlim(0, 100)
    axes.set_xlabel("designs [%], with 95 % intervals")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False)
    return _svg(figure, axes, along="x")


def arm_colours(study: Study) -> dict[str, str]:
    """Return the colour of each arm; after eight they come again."""
    return {arm.name: _COLOURS[i % len(_COLOURS)] for i, arm in enumerate(study.plan.arms)}


def curves_of_task(study: Study, rows: Sequence[DesignRow]) -> str:
    """Return the learning curves of one task's designs: progress against control steps, a colour an arm.

    Returns:
        Nothing where no design was trained.
    """
    figure = Figure(figsize=(3.5, 2.1), layout="constrained")
    axes = figure.subplots()
    arms = arm_colours(study)
    cells = {(cell.arm, cell.task, cell.number): cell for cell in study.cells}
    drawn = False
    for row in rows:
        run = study.run(cells[row.arm, row.task, row.run])
        for seed in range(study.plan.seeds if run else 0):
            folder = training_folder_of(run.design(row.design), seed) if run else Path()
            curve = read_curve(Training(folder))
            points = [(row.steps / 1000, row.progress) for row in curve if row.progress is not None]
            drawn = drawn or bool(points)
            axes.plot(
                [thousands for thousands, _ in points],
                [progress for _, progress in points],
                color=arms[row.arm],
                linewidth=1.4,
                alpha=0.8,
            )
    if not drawn:
        return ""
    axes.set_ylim(0, 1.02)
    axes.set_xlim(0, 1.02 * study.plan.steps / 1000)
    axes.set_xlabel("control steps [1000]")
    axes.set_ylabel("progress")
    return _svg(figure, axes)


def cost_and_success(arms: Sequence[ArmLine]) -> str:
    """Return what a design costs against how often it succeeds, a point an arm, the paper's beside them."""
    figure = Figure(figsize=(5.2, 4.2), layout="constrained")
    axes = figure.subplots()
    for i, arm in enumerate(arms):
        if arm.line.ended and arm.line.cost_usd is not None:
            success = 100 * arm.line.rate("successful").share
            axes.plot(arm.line.cost_usd, success, "o", color=_COLOURS[i % len(_COLOURS)])
            place = (arm.line.cost_usd, success)
            axes.annotate(arm.arm, place, (5, 4), textcoords="offset points", fontsize=8, color=_INK)
    axes.plot(PAPER.cost_usd, 100 * PAPER.successful_by_table, "x", color=_INK)
    axes.annotate(
        "published, other tasks",
        (PAPER.cost_usd, 100 * PAPER.successful_by_table),
        (-6, 5),
        textcoords="offset points",
        fontsize=8,
        color=_INK,
        ha="right",
    )
    axes.set_xlabel("cost of a design [USD]")
    axes.set_ylabel("successful designs [%]")
    axes.set_ylim(0, 100)
    axes.set_xlim(left=-0.02)
    return _svg(figure, axes)


def _svg(figure: Figure, axes: Axes, along: Literal["x", "both"] = "both") -> str:
    """Return a figure as SVG for a page that is light or dark: no background, lines in the page's own colours."""
    axes.grid(axis=along, color=_GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(colors=_INK, labelsize=8)
    for label in (axes.xaxis.label, axes.yaxis.label):
        label.set_color(_INK)
        label.set_fontsize(8)
    for name, spine in axes.spines.items():
        spine.set_visible(name in ("left", "bottom"))
        spine.set_color(_INK)
    legend = axes.get_legend()
    for text in legend.get_texts() if legend else ():
        text.set_color(_INK)
        text.set_fontsize(8)
    out = io.StringIO()
    figure.savefig(out, format="svg", transparent=True, metadata={"Date": None})
    drawn = out.getvalue()
    for colour, variable in _OF_THE_PAGE.items():
        drawn = drawn.replace(colour, variable)
    return drawn[drawn.index("<svg") :]
