"""The Judge: decides whether a stable scene is worth training."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from aidsr.core.artifacts import Brief, Concept, Critique, Robot, Scene, ValidationReport
from aidsr.core.formatting import written
from aidsr.mjcf.condense import condense
from aidsr.teams.llm.conversation import Interview
from aidsr.teams.llm.describe_environment import describe_environment
from aidsr.teams.llm.prompts import as_json, render
from aidsr.teams.llm.replies import json_in, read_as

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
            scaled="" if scene.placement.scale == 1 else written(scene.placement.scale),
            placement=as_json(scene.placement, whole=True),
            notes=scene.notes,
            report=report.account(),
            measured=_measured(report),
            captions=list(seen),
        )
        return self.interview.ask("judge", render("judge"), user, _read, tuple(seen.values()))


def _measured(report: ValidationReport) -> list[str]:
    """Return what the validator measured of the robot and each actuator; actuators that do the same share a line."""
    found, lines = report.measurements, []
    length_mm = 1000 * found.get("characteristic_length_m", 0.0)
    if length_mm:
        mass_g = 1000 * found["moving_mass_kg"]
        lines.append(f"the robot is {written(length_mm)} mm long, and what moves of it weighs {written(mass_g)} g")
    if found.get("chains"):
        segments = ", ".join(map(str, found["chains"]))
        lines.append(f"segments of each soft chain: {segments}; tendons: {found['tendons']}")
    if "functional_part_m" in found:
        at = " ".join(f"{value + 0.0:.4g}" for value in found["functional_part_m"])
        lines.append(f"its functional part is at {at} m at the start, in world coordinates")
    alike: dict[str, list[str]] = {}
    for actuator, share in found.get("effect_over_length", {}).items():
        alike.setdefault(_did(share * length_mm, found.get("motors", {}).get(actuator)), []).append(actuator)
    if alike:
        lines.append(
            "of each actuator, the largest displacement of any part when it acts alone, its greatest pull and the way "
            "of its cable: " + "; ".join(f"{', '.join(names)} {did}" for did, names in alike.items())
        )
    return lines


def _did(moved_mm: float, motor: Mapping[str, Any] | None) -> str:
    """Return what an actuator did, in numbers; its pull is not measured in a robot that does not work."""
    pull = f", {written(motor['tension_n'])} N, {written(1000 * motor['stroke_m'])} mm" if motor else ""
    return f"{written(moved_mm)} mm{pull}"


def _read(reply: str) -> Critique:
    return read_as(Critique, json_in(reply))
