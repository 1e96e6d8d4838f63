"""Routing: which role has to change what, by the faults of a scene and the issues of the Judge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from aidsr.core.artifacts import Critique, Fault, TaskReport, ValidationReport
from aidsr.core.roles import Feedback

_ROBOT = "robot/"

_MOST_PROBLEMS = 3
"""Problems given in full when a design is given up; its files have all of them. Our choice."""


@dataclass(frozen=True)
class Change:
    """What an iteration has to change. Without any change, it only makes what is missing."""

    concept: str = ""
    """What the Designer is asked to change; the robot and the placement are then redone."""
    robot: Feedback | None = None
    """What the Coder is asked to repair."""
    placement: Feedback | None = None
    """What the Scene Integrator is asked to adjust."""
    details: str = ""
    """Figures of a trial on the task, and of earlier ones; told to whoever is asked."""
    after_trial: bool = False
    """Whether a scene that the Judge passed fell short when it was tried on its task."""

    @property
    def to_designer(self) -> str:
        """What the Designer is asked, with the figures."""
        return "\n\n".join(text for text in (self.concept, self.details) if text)

    def with_details(self, feedback: Feedback | None) -> Feedback | None:
        """Return what a role gets, with the figures of the trial after its summary."""
        if not (self.details and isinstance(feedback, Critique)):
            return feedback
        return feedback.model_copy(update={"summary": f"{feedback.summary}\n\n{self.details}\n"})

    @property
    def reason(self) -> str:
        """The worst problems in a few sentences, for a person; the rest is counted."""
        for feedback in (self.robot, self.placement):
            if isinstance(feedback, ValidationReport):
                return _first([f"{fault.code}: {fault.message.rstrip('.')}." for fault in feedback.errors])
            if isinstance(feedback, Critique):
                return _first(_issues(feedback))
        return _first(self.concept.splitlines())


def after_scene_faults(report: ValidationReport, requested: Change) -> Change:
    """Return which role repairs an unstable scene whose robot is stable alone.

    The Scene Integrator, when a fault is one of placing; the Coder otherwise, and also when the Scene Integrator was
    just asked about the same faults and they are still there.

    Args:
        report: The scene's report.
        requested: What the iteration that made the scene had to change.
    """
    of_placement = any(_is_of_placement(fault) for fault in report.errors)
    before = requested.placement
    still_there = isinstance(before, ValidationReport) and _codes(before) == _codes(report)
    return Change(placement=report) if of_placement and not still_there else Change(robot=report)


def after_critique(critique: Critique) -> Change:
    """Return which roles act on a failing critique: each on the issues blamed on it, the Designer on all."""
    if any(issue.blame == "designer" for issue in critique.issues):
        return Change(concept="\n".join(_issues(critique)))
    return Change(robot=_blamed(critique, "coder"), placement=_blamed(critique, "integrator"))


def after_trial(report: TaskReport, earlier: Sequence[str] = ()) -> Change:
    """Return which roles act on a trial; the Designer, who has no other report of it, also gets its summary.

    Args:
        report: Of the trial.
        earlier: What earlier bodies and placements came to, a line for each.
    """
    change = after_critique(report.critique)
    concept = f"{report.critique.summary}\n{change.concept}" if change.concept else ""
    details = [report.account] * bool(report.account)
    details += ["\n".join(["Earlier bodies and placements of this design:", *earlier])] * bool(earlier)
    return replace(change, concept=concept, details="\n\n".join(details), after_trial=True)


def _is_of_placement(fault: Fault) -> bool:
    """Whether the fault names something of the environment, or is one that its rule blames on the placement."""
    from aidsr.validation.registry import find_rule  # loads MuJoCo

    rule = find_rule(fault.code)
    touches_environment = any(not name.startswith(_ROBOT) for name in fault.names)
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
    """Return the first problems in full, and how many more there are."""
    more = len(problems) - _MOST_PROBLEMS
    told = " ".join(f"{problem.rstrip('.')}." for problem in problems[:_MOST_PROBLEMS])
    return told + (f" And {more} more." if more > 0 else "")
