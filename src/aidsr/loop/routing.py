"""Routing: which role has to change what, given the faults of a scene and the issues of the Judge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from aidsr.core.artifacts import Critique, Fault, TaskReport, ValidationReport
from aidsr.core.roles import Feedback
from aidsr.mjcf.names import ROBOT_PREFIX

_MOST_PROBLEMS = 3
"""Number of problems reported in full when a design is given up; its files contain all of them. Our choice."""


@dataclass(frozen=True)
class Change:
    """Change requested from an iteration. An empty one only creates what is missing."""

    concept: str = ""
    """Request to the Designer; the robot and the placement are redone afterwards."""
    robot: Feedback | None = None
    """Feedback that the Coder has to act on."""
    placement: Feedback | None = None
    """Feedback that the Scene Integrator has to act on."""
    details: str = ""
    """Figures of the trial on the task, and of earlier trials, for every role that is asked."""
    after_trial: bool = False
    """Whether the scene passed the Judge but fell short in the trial on its task."""

    @property
    def to_designer(self) -> str:
        """Request to the Designer, with the figures of the trials."""
        return "\n\n".join(text for text in (self.concept, self.details) if text)

    def with_details(self, feedback: Feedback | None) -> Feedback | None:
        """Return the feedback to a role, with the figures of the trials after its summary."""
        if not (self.details and isinstance(feedback, Critique)):
            return feedback
        return feedback.model_copy(update={"summary": f"{feedback.summary}\n\n{self.details}\n"})

    @property
    def of_robot_and_placement(self) -> Change:
        """The change for a team that makes robot and placement together: both roles get all feedback."""
        if isinstance(self.robot, Critique) and isinstance(self.placement, Critique):
            issues = tuple(dict.fromkeys((*self.robot.issues, *self.placement.issues)))
            both: Feedback | None = self.robot.model_copy(update={"issues": issues})
        else:
            both = self.robot or self.placement
        return replace(self, robot=both, placement=both)

    @property
    def reason(self) -> str:
        """The first problems in a few sentences, for a person, and the number of the others."""
        for feedback in (self.robot, self.placement):
            if isinstance(feedback, ValidationReport):
                return _first([f"{fault.code}: {fault.message.rstrip('.')}." for fault in feedback.errors])
            if isinstance(feedback, Critique):
                return _first(_issues(feedback))
        return _first(self.concept.splitlines())


def after_scene_faults(report: ValidationReport, requested: Change) -> Change:
    """Return the change for an unstable scene whose robot is stable alone.

    It goes to the Scene Integrator if a fault concerns the placement; otherwise to the Coder, and also if the Scene
    Integrator was just asked to fix the same faults and they are still there.

    Args:
        report: Validation report of the scene.
        requested: Change requested from the iteration that made the scene.
    """
    of_placement = any(_is_of_placement(fault) for fault in report.errors)
    before = requested.placement
    still_there = isinstance(before, ValidationReport) and _codes(before) == _codes(report)
    return Change(placement=report) if of_placement and not still_there else Change(robot=report)


def after_critique(critique: Critique) -> Change:
    """Return the change for a failing critique: each role gets the issues blamed on it, the Designer gets all."""
    if any(issue.blame == "designer" for issue in critique.issues):
        return Change(concept="\n".join(_issues(critique)))
    return Change(robot=_blamed(critique, "coder"), placement=_blamed(critique, "integrator"))


def after_trial(report: TaskReport, earlier: Sequence[str] = ()) -> Change:
    """Return the change after a trial; the Designer, who has no other report of it, also gets its summary.

    Args:
        report: Report of the trial.
        earlier: Results of earlier robots and placements, one line each.
    """
    change = after_critique(report.critique)
    concept = f"{report.critique.summary}\n{change.concept}" if change.concept else ""
    details = [report.account] * bool(report.account)
    details += ["\n".join(["Earlier bodies and placements of this design:", *earlier])] * bool(earlier)
    return replace(change, concept=concept, details="\n\n".join(details), after_trial=True)


def _is_of_placement(fault: Fault) -> bool:
    """Whether the fault names something in the environment, or its rule blames the placement."""
    from aidsr.validation.registry import find_rule  # loads MuJoCo

    rule = find_rule(fault.code)
    touches_environment = any(not name.startswith(ROBOT_PREFIX) for name in fault.names)
    return touches_environment or (rule is not None and rule.blame == "integrator")


def _codes(report: ValidationReport) -> frozenset[str]:
    return frozenset(fault.code for fault in report.errors)


def _blamed(critique: Critique, role: str) -> Critique | None:
    issues = tuple(issue for issue in critique.issues if issue.blame == role)
    return critique.model_copy(update={"issues": issues}) if issues else None


def _issues(critique: Critique) -> list[str]:
    return [
        f"{issue.component}: {issue.problem.rstrip('.')}." + (f" {issue.suggestion}" if issue.suggestion else "")
        for issue in critique.issues
    ]


def _first(problems: list[str]) -> str:
    """Return the first problems in full, and the number of the others."""
    more = len(problems) - _MOST_PROBLEMS
    text = " ".join(f"{problem.rstrip('.')}." for problem in problems[:_MOST_PROBLEMS])
    return text + (f" And {more} more." if more > 0 else "")
