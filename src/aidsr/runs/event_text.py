"""Short texts for a run's events, shared by the terminal and the web app."""

from __future__ import annotations

from aidsr.core.formatting import format_repairs
from aidsr.core.roles import BodyTried
from aidsr.runs.events import (
    Decided,
    DecisionUnreadable,
    Event,
    Finished,
    NoPicture,
    Repaired,
    StepDone,
    Stopped,
    Tried,
    Waiting,
)

DOING = {
    "concepts": "the Designer proposes concepts",
    "concept": "the Designer revises the concept",
    "robot": "the Coder writes the robot",
    "robot_report": "the robot is validated",
    "placement": "the Scene Integrator places the robot",
    "scene": "robot and environment are assembled",
    "scene_report": "the scene is validated",
    "preview": "a picture is drawn",
    "critique": "the Judge reviews the scene",
    "task_report": "the scene is tried on its task",
    "measured_again": "the best scene is measured again",
    "motion": "the motion is drawn",
}
"""Text for each step while it runs."""
_FOUND = {
    "concepts": "concepts",
    "concept": "new concept",
    "robot_report": "robot",
    "scene_report": "scene",
    "critique": "Judge",
    "task_report": "tried on its task",
    "measured_again": "measured again",
}
"""Steps whose results are shown, with a label for each."""


def sentence(event: Event) -> str:
    """Return an event in a few words; empty for events that need not be shown."""
    match event:
        case StepDone(step=step, summary=summary) if step in _FOUND:
            return f"{_FOUND[step]}: {summary}"
        case Tried():
            return tried_text(event)
        case Repaired(counts=counts):
            return format_repairs(counts)
        case Waiting():
            return "waiting for your decision"
        case DecisionUnreadable(reason=reason):
            return reason
        case Decided(verdict=verdict):
            return f"your decision: {verdict}"
        case NoPicture(reason=reason):
            return f"no picture: {reason}"
        case Stopped(message=message):
            return f"stopped: {message}"
        case Finished(outcome=outcome) if outcome is not None:
            return f"{outcome.outcome}: {outcome.reason}"
        case _:
            return ""


def tried_text(body: Tried | BodyTried) -> str:
    """Return the result of a trial of a body in words."""
    came = "could not be simulated" if body.progress is None else f"progress {body.progress:.2f}"
    won = ", a motion succeeds" if body.succeeded else ""
    before = ", rejected by the Judge earlier, ranked again" if body.refused else ""
    which = f"again with {body.motions} motions" if body.motions else f"of at most {body.most}"
    return f"body {body.number} {which}: {body.name}: {came}{won}{before} ({body.seconds:.1f} s)"
