"""Display of an iteration as a row of stages: robot, its validation, scene, its validation, trial, Judge, decision."""

from __future__ import annotations

from typing import Literal

from aidsr.core.artifacts import Artifact, ValidationReport
from aidsr.core.formatting import counted
from aidsr.runs.folders import DesignFolder, IterationFolder
from aidsr.runs.status import DesignStatus, decided

Mark = Literal["none", "kept", "doing", "done", "good", "bad"]
"""State of a stage: does not exist; kept from an earlier iteration; running; done; passed; failed."""

_AT_WORK = {
    "concept": "robot",
    "robot": "robot",
    "robot_report": "robot stable",
    "placement": "scene",
    "scene": "scene",
    "scene_report": "scene stable",
    "critique": "judged",
    "task_report": "tried",
    "measured_again": "tried",
}
"""Stage to which each step belongs."""


class Stage(Artifact):
    """One stage of an iteration."""

    name: str
    mark: Mark
    text: str
    """Result of the stage, in a word or two."""


class IterationStages(Artifact):
    """One iteration as a row of stages."""

    number: int
    round: int
    stages: tuple[Stage, ...]
    asked: str
    """Text of the person's decision before this iteration; empty where there was none."""


def iteration_stages(design: DesignFolder, status: DesignStatus) -> tuple[IterationStages, ...]:
    """Return the stages of each iteration of a design, in order."""
    found, round_, asked, had_robot = [], 1, "", False
    for iteration in design.iterations:
        at_work = status.doing if iteration.number == status.iteration and status.state == "running" else ""
        stages = _stages(iteration, _AT_WORK.get(at_work, ""), had_robot=had_robot)
        found.append(IterationStages(number=iteration.number, round=round_, stages=stages, asked=asked))
        had_robot = had_robot or iteration.robot.xml.path.exists()
        decision = decided(iteration)
        asked = decision.text if decision else ""
        round_ += decision is not None and decision.verdict == "refine"
    return tuple(found)


def _stages(iteration: IterationFolder, at_work: str, *, had_robot: bool) -> tuple[Stage, ...]:
    robot, scene, critique = iteration.robot_report.read(), iteration.scene_report.read(), iteration.critique.read()
    made = iteration.robot.xml.path.exists()
    repairs = iteration.repairs.read()
    fixed = f", {counted(repairs.total, 'automatic fix')}" if repairs and repairs.total else ""
    stages = [
        _stage(
            "robot",
            at_work,
            "done" if made else "kept" if had_robot else "none",
            ("new" if made else "kept") + fixed,
        ),
        _stage("robot stable", at_work, *_stability(robot))
        if robot
        else _stage("robot stable", at_work, "kept" if had_robot and not made else "none", ""),
        _stage("scene", at_work, "done" if iteration.scene.xml.path.exists() else "none", "placed"),
        _stage("scene stable", at_work, *(_stability(scene) if scene else ("none", ""))),
    ]
    tried = iteration.task_report.read()
    if tried or at_work == "tried":
        good: Mark = "good" if tried and tried.critique.passed else "bad"
        stages.append(_stage("tried", at_work, good, tried.phase.replace("_", " ") if tried else ""))
    stages.append(_stage("judged", at_work, *(_judged(passed=critique.passed) if critique else ("none", ""))))
    decision = decided(iteration)
    if decision is not None:
        mark: Mark = "good" if decision.verdict == "approve" else "bad" if decision.verdict == "quit" else "done"
        stages.append(Stage(name="decision", mark=mark, text=decision.verdict))
    return tuple(stages)


def _stage(name: str, at_work: str, mark: Mark, text: str) -> Stage:
    if name == at_work:
        return Stage(name=name, mark="doing", text="running")
    return Stage(name=name, mark=mark, text=text if mark != "none" else "")


def stability_in_words(report: ValidationReport) -> str:
    """Return "stable", or the number of faults of a report."""
    return "stable" if report.stable else counted(len(report.errors), "fault")


def _stability(report: ValidationReport) -> tuple[Mark, str]:
    return "good" if report.stable else "bad", stability_in_words(report)


def _judged(*, passed: bool) -> tuple[Mark, str]:
    return ("good", "passed") if passed else ("bad", "not passed")
