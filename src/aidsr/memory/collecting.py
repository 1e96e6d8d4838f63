"""Extraction of lessons from a run: one for each scene that was tried on its task or measured by its designer."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

from aidsr.core.artifacts import Brief, Concept, Robot, TaskReport
from aidsr.core.provenance import commit
from aidsr.memory.lesson import Lesson, designer_of, policy_results
from aidsr.memory.sessions import lessons_of_session
from aidsr.runs import DesignFolder, Run
from aidsr.runs.compare import attempted, compare
from aidsr.runs.folders import as_run
from aidsr.runs.record import RunRecord
from aidsr.runs.status import newest


def lessons_of(run: str | Path | Run) -> tuple[Lesson, ...]:
    """Return the lessons of a run with `task_feedback` or of the measuring team; empty if it used neither.

    Args:
        run: The run, or its folder.

    Raises:
        TypeError: `run` has another type.
        UserError: The folder is not a run, or one of its files is damaged.
    """
    run = as_run(run)
    asked, brief = run.asked(), run.brief()
    return tuple(lesson for design in run.designs for lesson in _of_design(run, design, asked, brief))


def _of_design(run: Run, design: DesignFolder, asked: RunRecord, brief: Brief) -> Iterator[Lesson]:
    before: tuple[int, float] | None = None
    for iteration in design.iterations:
        evidence = f"{run.path.resolve().name}/designs/{design.number}/{iteration.path.name}"
        yield from lessons_of_session(iteration, evidence, asked, brief)
        first = iteration.task_report.read()
        tried = iteration.measured_again.read() or first
        scene = iteration.scene.read()
        if tried is None or scene is None:
            continue
        until = design.leading_to(iteration.number)
        concept = newest(each.concept.read() for each in until)
        robot = newest(each.robot.read() for each in until)
        report = newest(each.scene_report.read() for each in until)
        if concept is None or robot is None or report is None:
            continue
        changes = compare(attempted(design, before[0]), attempted(design, iteration.number)) if before else None
        yield Lesson(
            objective=brief.objective,
            task=brief.task,
            level=asked.level or "",
            base=brief.base,
            **_body(concept, robot, int(report.measurements.get("actuators", 0))),
            changed=changes.changed if changes else (),
            progress_before=before[1] if before else None,
            **_measured(tried),
            **policy_results(first.policy if first else None),
            model=designer_of(asked.config.model),
            evidence=evidence,
            scene_sha256=hashlib.sha256(scene.mjcf.encode()).hexdigest(),
            commit=commit(),
        )
        before = (iteration.number, tried.progress)


def _body(concept: Concept, robot: Robot, actuators: int) -> dict[str, str | int]:
    grouped = sum(len(group.actuators) for group in robot.actuator_groups)
    return {
        "name": concept.name,
        "family": concept.family,
        "morphology": concept.morphology,
        "actuation": concept.actuation,
        "actuators": actuators,
        "groups": len(robot.actuator_groups) + max(actuators - grouped, 0),
    }


def _measured(tried: TaskReport) -> dict[str, float | int | bool | str]:
    searches = [attempt for attempt in tried.attempts if attempt.how == "search"]
    least, most = tried.spread
    return {
        "progress": tried.progress,
        "least": least,
        "most": most,
        "searches": max(len(searches), 1),
        "solved": 2 * sum(attempt.decisive for attempt in searches) > len(searches) or tried.phase == "solved",
        "found": tried.critique.summary,
    }
