"""Results of earlier trials of a design on its task, one line for each robot and placement."""

from __future__ import annotations

from aidsr.core.artifacts import Placement, TaskReport
from aidsr.core.formatting import format_number
from aidsr.runs import IterationFolder
from aidsr.runs.folders import DesignFolder


def earlier_trials(now: IterationFolder) -> list[str]:
    """Return a line for each earlier iteration with a trial: robot, placement, figures, and what went wrong."""
    design = DesignFolder(now.path.parent)
    lines = []
    for number in range(1, now.number):
        report = design.iteration(number).task_report.read()
        if report is not None:
            lines.append(f"- iteration {number}, {_made(design, number)}: {_figures(report)}")
    return lines


def _made(design: DesignFolder, number: int) -> str:
    """Return which robot was placed where."""
    leading = design.leading_to(number)
    concept = next(each.concept for each in leading if each.concept.path.exists()).read()
    placement = next(each.placement for each in leading if each.placement.path.exists()).read()
    assert concept is not None, "a design begins with its concept"
    assert placement is not None, "only a robot that was placed is tried"
    body = next(each.number for each in leading if each.robot.xml.path.exists())
    return f"{concept.name} as of iteration {body}, {_place(placement)}"


def _place(placement: Placement) -> str:
    at = " ".join(format_number(value) for value in placement.position_m)
    turned = " ".join(format_number(value) for value in placement.rotation_deg)
    return f"{placement.base} at {placement.mount}, position {at} m, rotation {turned} deg, scale {placement.scale:g}"


def _figures(report: TaskReport) -> str:
    low, high = report.spread
    text = f"progress {report.progress:.2f} ({low:.2f} to {high:.2f} by seed), {report.phase.replace('_', ' ')}"
    return "; ".join([text, *(f"{issue.component}: {issue.problem}" for issue in report.critique.issues)])
