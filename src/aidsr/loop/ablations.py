"""Ablations: the method with some parts replaced, without branches in the loop.

Source: AID-SR compares its full method with runs without Judge, without Scene Integrator, without both, without
validation, and with direct prompting.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from aidsr.core.artifacts import Brief, Concept, Critique, Placement, Robot, Scene, ValidationReport
from aidsr.core.config import Method
from aidsr.core.roles import Feedback, Integrator, Judge, Team
from aidsr.loop.parts import Parts, TeamFor

if TYPE_CHECKING:
    from aidsr.validation.validator import Mount


class ApproveAll:
    """A Judge that passes every stable scene."""

    def judge(self, brief: Brief, concept: Concept, robot: Robot, scene: Scene, report: ValidationReport) -> Critique:
        """Return a critique that passes."""
        del brief, concept, robot, scene, report
        return Critique(passed=True, summary="Passed without a Judge.")


class DefaultPlacement:
    """A Scene Integrator that places every robot on the first mount, or at the world's origin if there is no mount."""

    def place(self, brief: Brief, concept: Concept, robot: Robot) -> Placement:
        """Return the default placement."""
        del concept, robot
        return default_placement(brief)

    def adjust(
        self, brief: Brief, concept: Concept, robot: Robot, placement: Placement, feedback: Feedback
    ) -> Placement:
        """Return the placement unchanged."""
        del brief, concept, robot, feedback
        return placement


def default_placement(brief: Brief) -> Placement:
    """Return a placement on the first mount of an environment, or at the world's origin if there is no mount."""
    mounts = [mount.name for mount in brief.summary.mounts if mount.moved_by or brief.base != "moving"]
    return Placement(
        mount=mounts[0] if mounts else "world",
        base="free" if brief.base == "free" or not mounts else "fixed",
        reason="Placed without a Scene Integrator, where every robot is.",
    )


class AcceptAll:
    """A validator that checks nothing."""

    def __call__(
        self, mjcf: str, *, mount: Mount = "auto", needs_contact: bool = False, environment: str = ""
    ) -> ValidationReport:
        """Return a report that says stable."""
        del mjcf, mount, needs_contact, environment
        return ValidationReport(stable=True, notes=("not validated",))


@dataclass(frozen=True)
class _With:
    """A team with some roles replaced."""

    team_for: TeamFor
    integrator: Integrator | None = None
    judge: Judge | None = None

    def __call__(self, *where: object) -> Team:
        team = self.team_for(*where)  # type: ignore[arg-type]
        return replace(team, integrator=self.integrator or team.integrator, judge=self.judge or team.judge)


def ablate(parts: Parts, method: Method) -> Parts:
    """Return the parts of an ablation; the parts of the full method are returned unchanged."""
    match method:
        case "full":
            return parts
        case "no_judge":
            return replace(parts, team_for=_With(parts.team_for, judge=ApproveAll()))
        case "no_integrator":
            return replace(parts, team_for=_With(parts.team_for, integrator=DefaultPlacement()))
        case "no_judge_or_integrator":
            return replace(parts, team_for=_With(parts.team_for, DefaultPlacement(), ApproveAll()))
        case "no_validation":
            return replace(parts, validate=AcceptAll())
        case "no_feedback":
            return replace(parts, team_for=_With(parts.team_for, judge=ApproveAll()), validate=AcceptAll())
        case "direct":
            team_for = _With(parts.team_for, DefaultPlacement(), ApproveAll())
            return replace(parts, team_for=team_for, validate=AcceptAll())
