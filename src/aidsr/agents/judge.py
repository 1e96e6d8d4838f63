"""The Judge: decides whether a stable scene is worth training."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from aidsr.agents.condensing import condense
from aidsr.agents.environment import describe_environment
from aidsr.agents.interview import Interview
from aidsr.agents.prompts import as_json, render
from aidsr.agents.replies import json_in, read_as
from aidsr.artifacts import Brief, Concept, Critique, Robot, Scene, ValidationReport

__all__ = ["JudgeAgent", "See", "blind"]

See = Callable[[Scene], Mapping[str, bytes]]
"""Returns what of a scene the Judge is shown: a PNG for each caption."""


def blind(scene: Scene) -> Mapping[str, bytes]:
    """Show no picture."""
    del scene
    return {}


@dataclass(frozen=True)
class JudgeAgent:
    """A language model as the Judge.

    Attributes:
        interview: Who is asked, and how often again.
        condensed: Whether the robot is shown without its repetitions.
        see: Pictures of the scene.
    """

    interview: Interview
    condensed: bool = True
    see: See = blind

    def judge(self, brief: Brief, concept: Concept, robot: Robot, scene: Scene, report: ValidationReport) -> Critique:
        """Return a pass, or a fail with issues that each blame a role.

        Raises:
            ReplyError: No reply could be used.
        """
        seen = self.see(scene)
        user = render(
            "judge_scene",
            brief=brief,
            environment=describe_environment(brief.summary),
            concept=as_json(concept, "interpretation", "rationale"),
            robot=robot,
            mjcf=((self.condensed and condense(robot.mjcf)) or robot.mjcf).strip(),
            placement=as_json(scene.placement, whole=True),
            notes=scene.notes,
            report=report.account(),
            measured=_measured(report),
            captions=list(seen),
        )
        return self.interview.ask("judge", render("judge"), user, _read, tuple(seen.values()))


def _measured(report: ValidationReport) -> list[str]:
    """Return how far each actuator moves the robot, where that was measured; those that do the same share a line."""
    alike: dict[str, list[str]] = {}
    for actuator, share in report.measurements.get("effect_over_length", {}).items():
        alike.setdefault(f"{share:.2f}", []).append(actuator)
    return [f"{', '.join(names)}: some part by {share} of the robot's length" for share, names in alike.items()]


def _read(reply: str) -> Critique:
    return read_as(Critique, json_in(reply))
