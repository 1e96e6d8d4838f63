"""The Judge as rules: whether a stable scene has what the job needs, and which role is to blame if it has not."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from aidsr.core.artifacts import Brief, Concept, Critique, CritiqueIssue, Robot, Scene, ValidationReport
from aidsr.core.formatting import counted, mm
from aidsr.mjcf.edit import effective_value, entries, get_numbers, parse, without_prefix
from aidsr.mjcf.elements import Element
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.functional_part import FUNCTIONAL_SITE
from aidsr.teams.rules import user_robot
from aidsr.teams.rules.job import Job, read_job

_LEAST_REACH = 0.97
"""Share of the distance to the target that a stretched robot must reach. Our choice: the target has its own width."""

_BESIDE_GRASP_M = 0.04
"""Largest distance between the grasp axis and the object at the start [m]. Our choice: what the fingers open around."""

_BEHIND = -0.5
"""Cosine of the angle between the mount's axis and the way to the target below which the target lies behind the mount.
Our choice: 120 deg, about the bend of a whole section at full tension."""


@dataclass(frozen=True)
class RuleJudge:
    """Checks structure, reach, direction, base and contact of a scene."""

    def judge(self, brief: Brief, concept: Concept, robot: Robot, scene: Scene, report: ValidationReport) -> Critique:
        """Return a pass, or an issue for every failed check with the role to blame."""
        job, root = read_job(brief), parse(scene.mjcf)
        checks = (
            _stability(report),
            _structure(root),
            _groups(concept, robot, root),
            _base(brief, scene),
            _reach(job, scene, root),
            _direction(job, concept),
            _contact(brief, scene, root),
        )
        issues = tuple(issue for check in checks for issue in check)
        if issues:
            summary = f"{counted(len(issues), 'check')} of the built-in rules failed."
            return Critique(passed=False, summary=summary, issues=issues)
        return Critique(passed=True, summary=_praise(job, report))


def _praise(job: Job, report: ValidationReport) -> str:
    codes = ", ".join(dict.fromkeys(fault.code for fault in report.warnings))
    warned = f" {counted(len(report.warnings), 'warning')} of the validator: {codes}." if codes else ""
    return f"All built-in checks passed (job type: {job.kind}): structure, reach, base and contact.{warned}"


def _stability(report: ValidationReport) -> Iterator[CritiqueIssue]:
    for fault in report.errors:
        yield CritiqueIssue(blame="coder", component=fault.code, problem=fault.message, suggestion=fault.cure)


def _structure(root: Element) -> Iterator[CritiqueIssue]:
    """Yield an issue if there are no tendons, no actuators on them, or no sensors of the robot."""
    tendons = {item.get("name") for item in root.iter("spatial", "fixed") if item.getparent() is root.find("tendon")}
    driven = tendons & {item.get("tendon") for item in entries(root, "actuator")}
    own = [item for item in entries(root, "sensor") if _is_own(item)]
    for missing, code, what in (
        (not tendons, "no_tendons", "tendons"),
        (bool(tendons) and not driven, "tendons_not_actuated", "actuators on its tendons"),
        (not own, "no_sensors", "sensors of its own"),
    ):
        if missing:
            yield CritiqueIssue(
                blame="coder", component=code, problem=f"the robot has no {what}", suggestion=f"add {what}"
            )


def _is_own(sensor: Element) -> bool:
    """Whether a sensor belongs to the robot: by its name, or without a name, if it measures something of the robot."""
    name = sensor.get("name")
    return any(str(value).startswith(ROBOT_PREFIX) for value in ([name] if name else sensor.attrib.values()))


def _groups(concept: Concept, robot: Robot, root: Element) -> Iterator[CritiqueIssue]:
    """Yield an issue if groups of actuators name an actuator that does not exist, or one actuator twice."""
    present = {without_prefix(item.get("name") or "") for item in entries(root, "actuator")}
    grouped = [name for group in robot.actuator_groups or concept.actuator_groups for name in group.actuators]
    unknown = sorted(set(grouped) - present)
    twice = sorted({name for name in grouped if grouped.count(name) > 1})
    if unknown or twice:
        wrong = "which do not exist" if unknown else "which are in two groups"
        problem = f"actuator groups name {', '.join(unknown or twice)}, {wrong}"
        yield CritiqueIssue(
            blame="coder",
            component="actuator_groups",
            problem=problem,
            suggestion="group existing actuators, each once",
        )


def _base(brief: Brief, scene: Scene) -> Iterator[CritiqueIssue]:
    """Yield issues if the root is not held or free as the task requires, or not on a mount that the task moves."""
    wanted = {"fixed": "fixed", "moving": "fixed", "free": "free"}.get(brief.base)
    if wanted and scene.placement.base != wanted:
        problem = f"the base is {scene.placement.base}, but the task requires it {brief.base}"
        yield CritiqueIssue(blame="integrator", component="base", problem=problem, suggestion=f"make the base {wanted}")
    if brief.base == "moving" and scene.placement.mount == "world":
        problem = "the task moves a mount, but the robot is not attached to it"
        yield CritiqueIssue(blame="integrator", component="mount", problem=problem, suggestion="attach it to a mount")


def _reach(job: Job, scene: Scene, root: Element) -> Iterator[CritiqueIssue]:
    """Yield issues if the stretched robot does not reach the target, or if a grasp does not start over its object."""
    path = _functional_path(root)
    if job.target is None or job.moves_itself or not path:
        return
    reach = _path_length_m(path) + job.approach_m
    x, y, z = (at - root for at, root in zip(job.target_in_mount_m, scene.placement.position_m, strict=True))
    needed = math.hypot(x, y, z) - job.target.half_width_m
    if reach < _LEAST_REACH * needed:
        problem = f"the functional part reaches {reach:.2f} m from the root; {job.target.part} is {needed:.2f} m away"
        yield CritiqueIssue(blame="designer", component="reach", problem=problem, suggestion="make it longer")
    if job.kind == "grasp" and math.hypot(x, y) > _BESIDE_GRASP_M:
        problem = f"{job.target.part} is {1000 * math.hypot(x, y):.0f} mm beside the grasp axis of the robot"
        yield CritiqueIssue(
            blame="integrator", component="offset", problem=problem, suggestion="place it over the object"
        )


def _direction(job: Job, concept: Concept) -> Iterator[CritiqueIssue]:
    """Yield an issue if the target lies well behind the fixed mount; the built-in families grow ahead or sideways."""
    if job.target is None or job.base != "fixed" or job.moves_itself or concept.family == user_robot.FAMILY:
        return
    if job.target.along_m >= _BEHIND * job.target.distance_m:
        return
    away_m = job.target.distance_m
    origin = job.mount.position_m if job.mount else (0.0, 0.0, 0.0)
    offset = (at - start for at, start in zip(job.target.position_m, origin, strict=True))
    towards = " ".join(f"{part / away_m:.2f}" for part in offset)
    turn = f"turn the +z axis of {job.mount_name}" if job.mount else 'add a site named "mount" whose +z axis points'
    yield CritiqueIssue(
        blame="integrator",
        component="direction",
        problem=f"the robot points away from {job.target.part}, which is {mm(away_m)} away, behind {job.mount_name}",
        suggestion=f'{turn} towards it in the environment, for example with zaxis="{towards}"',
    )


def _functional_path(root: Element) -> list[Element]:
    """Return the bodies from the robot's root to its functional part, then the site that marks it; empty if none."""
    site = next((item for item in root.iter("site") if item.get("name") == FUNCTIONAL_SITE), None)
    if site is None:
        return []
    bodies = [body for body in site.iterancestors("body") if (body.get("name") or "").startswith(ROBOT_PREFIX)]
    return [*reversed(bodies), site]


def _path_length_m(path: list[Element]) -> float:
    """Return the length of the path through the bodies' origins [m]; the first one's position is the placement's."""
    return sum(math.hypot(*get_numbers(item, "pos")) for item in path[1:] if get_numbers(item, "pos"))


def _contact(brief: Brief, scene: Scene, root: Element) -> Iterator[CritiqueIssue]:
    """Yield issues if the job needs contact, but the robot cannot touch anything or its placement names no contact."""
    if not brief.needs_contact:
        return
    shapes = [geom for geom in root.iter("geom") if (geom.get("name") or "").startswith(ROBOT_PREFIX)]
    if shapes and all(
        effective_value(root, geom, "contype") == "0" and effective_value(root, geom, "conaffinity") == "0"
        for geom in shapes
    ):
        problem = "none of the robot's shapes can touch anything"
        yield CritiqueIssue(
            blame="coder", component="contact_disabled", problem=problem, suggestion="let shapes collide"
        )
    if not scene.placement.intended_contacts:
        problem = "the task requires contact, but the placement names no intended contact"
        yield CritiqueIssue(
            blame="integrator",
            component="intended_contacts",
            problem=problem,
            suggestion="name what the robot is meant to touch",
        )
