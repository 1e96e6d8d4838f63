"""The Judge: decides whether a stable scene is worth training."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from aidsr.core.artifacts import Brief, Concept, Critique, Robot, Scene, ValidationReport
from aidsr.core.formatting import format_number
from aidsr.mjcf.condense import condense
from aidsr.teams.llm.conversation import Conversation
from aidsr.teams.llm.describe_environment import describe_environment
from aidsr.teams.llm.prompts import as_json, render
from aidsr.teams.llm.replies import parse_json, validate_as

ScenePictures = Callable[[Scene], Mapping[str, bytes]]
"""Function that returns the pictures of a scene for the Judge: a PNG for each caption."""


def no_pictures(scene: Scene) -> Mapping[str, bytes]:
    """Return no pictures."""
    del scene
    return {}


@dataclass(frozen=True)
class JudgeAgent:
    """A language model as the Judge.

    Attributes:
        conversation: The model, and how often it is asked again after an unusable reply.
        condensed: Whether the MJCF of the robot is shown in condensed form.
        pictures: Function that returns the pictures of the scene.
    """

    conversation: Conversation
    condensed: bool = True
    pictures: ScenePictures = no_pictures

    def judge(self, brief: Brief, concept: Concept, robot: Robot, scene: Scene, report: ValidationReport) -> Critique:
        """Return a pass, or a fail with issues that each name the role to blame.

        Raises:
            ReplyError: No reply could be used.
        """
        pictures = self.pictures(scene)
        unsaid = () if scene.placement.functional_part else ("functional_part",)
        user = render(
            "judge_scene",
            brief=brief,
            environment=describe_environment(brief.summary),
            concept=as_json(concept, "interpretation", "rationale"),
            robot=robot,
            mjcf=((self.condensed and condense(robot.mjcf)) or robot.mjcf).strip(),
            scaled="" if scene.placement.scale == 1 else format_number(scene.placement.scale),
            placement=as_json(scene.placement, *unsaid, defaults=True),
            notes=scene.notes,
            report=report.account(),
            measured=_measurement_lines(report),
            captions=list(pictures),
            trial=report.measurements.get("trial", ""),
        )
        return self.conversation.ask("judge", render("judge"), user, _read, tuple(pictures.values()))


def _measurement_lines(report: ValidationReport) -> list[str]:
    """Return lines with the validator's measurements of the robot and each actuator; equal actuators share a clause."""
    found, lines = report.measurements, []
    length_mm = 1000 * found.get("characteristic_length_m", 0.0)
    if length_mm:
        mass_g = 1000 * found["moving_mass_kg"]
        lines.append(
            f"the robot is {format_number(length_mm)} mm long, and what moves of it weighs {format_number(mass_g)} g"
        )
    if found.get("chains"):
        segments = ", ".join(map(str, found["chains"]))
        lines.append(f"segments of each soft chain: {segments}; tendons: {found['tendons']}")
    if "functional_part_m" in found:
        at = " ".join(f"{value + 0.0:.4g}" for value in found["functional_part_m"])
        lines.append(f"its functional part is at {at} m at the start, in world coordinates")
    lines += _place_lines(found)
    groups: dict[str, list[str]] = {}
    for actuator, share in found.get("effect_over_length", {}).items():
        groups.setdefault(_format_effect(share * length_mm, found.get("motors", {}).get(actuator)), []).append(actuator)
    if groups:
        lines.append(
            "of each actuator, the largest displacement of any part when it acts alone, its greatest pull and the way "
            "of its cable: " + "; ".join(f"{', '.join(names)} {effect}" for effect, names in groups.items())
        )
    return lines


def _place_lines(found: Mapping[str, Any]) -> list[str]:
    """Return lines with the positions of the functional part and of free bodies in the validator's tests.

    Actuators that bring the functional part to equal positions share a clause.
    """
    if "functional_part_at_rest_m" not in found:
        return []
    rest = {"its functional part": found["functional_part_at_rest_m"], **found.get("free_bodies_at_rest_m", {})}
    told = ", ".join(f"{name} at {_place(point_m)} m" for name, point_m in rest.items())
    lines = [f"after settling with nothing pulled: {told}"]
    alike: dict[str, list[str]] = {}
    for actuator, (half_m, held_m) in found.get("functional_part_pulled_m", {}).items():
        alike.setdefault(f"{_place(half_m)}, {_place(held_m)}", []).append(actuator)
    if alike:
        pulls = [f"{', '.join(names)}: {places}" for places, names in alike.items()]
        lines.append(
            "its functional part when the growing command of one actuator alone is half of its pull, and held at all "
            f"of it [m]: {'; '.join(pulls)}"
        )
    return lines


def _place(point_m: Sequence[float]) -> str:
    """Return a point as text, rounded to a millimetre [m]."""
    return " ".join(f"{round(value, 3) + 0.0:g}" for value in point_m)


def _format_effect(moved_mm: float, motor: Mapping[str, Any] | None) -> str:
    """Return the effect of an actuator as text; without its force and travel if they were not measured.

    They are not measured in a robot with errors.
    """
    pull = f", {format_number(motor['tension_n'])} N, {format_number(1000 * motor['stroke_m'])} mm" if motor else ""
    return f"{format_number(moved_mm)} mm{pull}"


def _read(reply: str) -> Critique:
    return validate_as(Critique, parse_json(reply))
