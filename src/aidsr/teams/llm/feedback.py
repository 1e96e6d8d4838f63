"""Text for feedback: faults found by the validator, or issues found by the Judge."""

from __future__ import annotations

from aidsr.core.artifacts import Critique, CritiqueIssue, ValidationReport
from aidsr.core.roles import Feedback


def describe_feedback(feedback: Feedback) -> str:
    """Return the validator's account of the faults, or the Judge's verdict and its issues, one per line."""
    if isinstance(feedback, ValidationReport):
        return feedback.account()
    return _describe_critique(feedback)


def _describe_critique(critique: Critique) -> str:
    verdict = f"The verdict on the scene: {critique.summary}".rstrip()
    return "\n".join([verdict, *(_describe_issue(issue) for issue in critique.issues)])


def _describe_issue(issue: CritiqueIssue) -> str:
    return f"- {issue.component}: {issue.problem} {issue.suggestion}".rstrip()
