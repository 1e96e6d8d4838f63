"""Plots of a study's report, as SVG text for embedding in the page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from aidsr.core.formatting import task_title
from aidsr.core.plots import CURVES, SOFT, svg_plot
from aidsr.runs.trainings import Training, read_curve, without_tests
from aidsr.studies.outcomes import DesignRow
from aidsr.studies.planned import planned_seeds, training_folder_of
from aidsr.studies.study import Study
from aidsr.studies.tables import PAPER, ArmLine, Line

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def success_by_task(lines: Sequence[Line]) -> str:
    """Return a bar plot of the shares of valid and successful designs by task, with Wilson intervals."""

    def draw(axes: Axes) -> None:
        for row, line in enumerate(reversed(lines)):
            for offset, of, colour in ((0.18, "valid", CURVES[0]), (-0.18, "successful", CURVES[1])):
                rate = line.rate(of)
                if rate.of:
                    interval = rate.interval
                    axes.barh(row + offset, 100 * rate.share, height=0.32, color=colour, label=of if row == 0 else None)
                    axes.plot([100 * interval.low, 100 * interval.high], [row + offset] * 2, color=SOFT, linewidth=0.9)
        axes.set_yticks(range(len(lines)), [task_title(line.task) for line in reversed(lines)])
        axes.set_xlim(0, 100)
        axes.set_xlabel("designs [%], with 95 % intervals")
        axes.grid(axis="x")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)

    return svg_plot(draw, (5.2, 0.3 * len(lines) + 0.9), "valid and successful designs by task", key="tasks")


def arm_colours(study: Study) -> dict[str, str]:
    """Return the colour of each arm as a CSS variable of the page; colours repeat after the last of `CURVES`."""
    return {arm.name: f"var(--curve-{1 + i % len(CURVES)})" for i, arm in enumerate(study.plan.arms)}


def curves_of_task(study: Study, rows: Sequence[DesignRow]) -> str:
    """Return a plot of the learning curves of one task's designs: progress over control steps, one colour for each arm.

    Returns:
        SVG text; empty where no design was trained.
    """
    arms = {arm.name: CURVES[i % len(CURVES)] for i, arm in enumerate(study.plan.arms)}
    cells = {(cell.arm, cell.task, cell.number): cell for cell in study.cells}
    curves: list[tuple[str, list[tuple[float, float]]]] = []
    for row in rows:
        cell = cells[row.arm, row.task, row.run]
        run = study.run(cell)
        design = run.design(row.design) if run else None
        folders = [training_folder_of(design, seed) for seed in planned_seeds(study, cell, design)] if design else []
        for training in map(Training, folders):
            curve, _ = without_tests(training, read_curve(training))
            points = [(point.steps / 1000, point.progress) for point in curve if point.progress is not None]
            if points:
                curves.append((arms[row.arm], points))
    if not curves:
        return ""

    def draw(axes: Axes) -> None:
        for colour, points in curves:
            axes.plot(*zip(*points, strict=True), color=colour, alpha=0.8)
        axes.set_ylim(0, 1.02)
        axes.set_xlim(0, 1.02 * study.plan.steps / 1000)
        axes.set_xlabel("control steps [1000]")
        axes.set_ylabel("progress")
        axes.grid()

    return svg_plot(draw, (3.5, 2.1), f"learning curves of {rows[0].task}", key=rows[0].task)


def cost_and_success(arms: Sequence[ArmLine]) -> str:
    """Return a plot of success rate over cost per design, with one point for each arm and one for the paper."""

    def draw(axes: Axes) -> None:
        for i, arm in enumerate(arms):
            if arm.line.ended and arm.line.cost_usd is not None:
                place = (arm.line.cost_usd, 100 * arm.line.rate("successful").share)
                axes.plot(*place, "o", color=CURVES[i % len(CURVES)])
                axes.annotate(arm.arm, place, (5, 4), textcoords="offset points", fontsize=8)
        paper = (PAPER.cost_usd, 100 * PAPER.successful_by_table)
        axes.plot(*paper, "x", color=SOFT)
        axes.annotate("published, other tasks", paper, (-6, 5), textcoords="offset points", fontsize=8, ha="right")
        axes.set_xlabel("cost per design [USD]")
        axes.set_ylabel("successful designs [%]")
        axes.set_ylim(0, 100)
        axes.set_xlim(left=-0.02)
        axes.grid()

    return svg_plot(draw, (5.2, 4.2), "cost per design and share of successful designs", key="cost")
