"""The Scene Integrator as rules: position and orientation of a robot, and what it is meant to touch."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from aidsr.core.artifacts import Brief, Concept, Fault, Placement, Robot, ValidationReport, Vec3
from aidsr.core.errors import IsolationError, MjcfError
from aidsr.core.roles import Feedback
from aidsr.sim.measure import measure
from aidsr.teams.rules.families import Families, load_families
from aidsr.teams.rules.job import Job, read_job
from aidsr.teams.rules.orientation import STRAIGHT, Orientation, bend_upright, looks_sideways, must_lean

_ABOVE_GROUND_M = 0.0005
"""Gap between a free robot and the ground at the start. Our choice: it lands at 0.1 m/s, without a bounce."""

_STEP_M = 0.012
_FREE_STEP_M = 0.1
_STEP_DEG = 12.0
"""One step away from what the robot overlaps: on a mount, of a free robot, and of a leaning one."""


@dataclass(frozen=True)
class RuleIntegrator:
    """A Scene Integrator that places robots by the facts of the environment.

    Attributes:
        families: Families; their records define how their robots are rotated on a mount.
    """

    families: Families = field(default_factory=load_families)

    def place(self, brief: Brief, concept: Concept, robot: Robot) -> Placement:
        """Return a placement: a free robot stands on the ground and faces +x, any other robot is on its mount."""
        job = read_job(brief)
        base: Literal["fixed", "free"] = "free" if job.base == "free" else "fixed"
        orientation = self._orientation(job, concept)
        (x, y), height, stood = _over_target(job), 0.0, ""
        if base == "free":
            x, height, stood = _standing(robot, job)
        return Placement(
            mount=job.mount_name,
            base=base,
            position_m=(x, y, height),
            rotation_deg=orientation.rotation_deg,
            intended_contacts=_contacts(job, brief),
            reason=" ".join(part for part in (_where(job, base), stood, orientation.reason) if part),
        )

    def _orientation(self, job: Job, concept: Concept) -> Orientation:
        if job.kind == "pull" and job.mount is not None and looks_sideways(job):
            return bend_upright(job)
        family = self.families.get(concept.family)
        return family.orient(job, concept.parameters) if family else STRAIGHT

    def adjust(
        self, brief: Brief, concept: Concept, robot: Robot, placement: Placement, feedback: Feedback
    ) -> Placement:
        """Return the placement with overlaps and falls removed; its reason names the faults that no rule covers."""
        del concept, robot
        job, done = read_job(brief), []
        update: dict[str, object] = {}
        codes = {fault.code: fault for fault in feedback.errors} if isinstance(feedback, ValidationReport) else {}
        blamed = {issue.component for issue in feedback.issues} if not isinstance(feedback, ValidationReport) else set()
        if overlap := codes.get("initial_penetration"):
            change, words = _step_away(job, brief, placement, overlap)
            update.update(change)
            done.append(words)
        if {"free_fall", "base_not_attached"} & (codes.keys() | blamed) and job.base != "free":
            update["base"] = "fixed"
            done.append("fixed the base to the mount")
        if "base" in blamed:
            update["base"] = "free" if job.base == "free" else "fixed"
            done.append(f"made the base {update['base']}, as the task has it")
        if {"intended_contacts", "contact_disabled"} & (codes.keys() | blamed):
            update["intended_contacts"] = _contacts(job, brief)
            done.append("named what it is meant to touch")
        if "offset" in blamed:
            update["position_m"] = (*_over_target(job), placement.position_m[2])
            done.append("put it over the object")
        if "mount" in blamed:
            update["mount"] = job.mount_name
            done.append(f"attached it to {job.mount_name}")
        left = sorted((codes.keys() | blamed) - _COVERED)
        reason = f"Built-in rules: {'; '.join(done) or 'nothing to move'}." + (
            f" No placement cures {', '.join(left)}." if left else ""
        )
        return placement.model_copy(update={**update, "reason": reason})


_COVERED = {
    "initial_penetration",
    "free_fall",
    "base_not_attached",
    "base",
    "intended_contacts",
    "contact_disabled",
    "offset",
    "mount",
}


def _standing(robot: Robot, job: Job) -> tuple[float, float, str]:
    """Return x and z of a free robot that stands with its middle over the mount [m], and a sentence about it."""
    try:
        measured = measure(robot)
    except (MjcfError, IsolationError):
        return 0.0, 0.05, "It does not load, so its resting height could not be measured; 50 mm are assumed."
    height = job.ground_m - measured.low_m[2] + _ABOVE_GROUND_M
    words = (
        f"Its root is {1000 * height:.0f} mm up, where its feet touch; its middle is over the start; it looks along +x."
    )
    return round(-(measured.low_m[0] + measured.high_m[0]) / 2, 5) + 0.0, round(height, 5), words


def _contacts(job: Job, brief: Brief) -> tuple[str, ...]:
    """Return the names of the environment's bodies that the robot is meant to touch."""
    bodies = {body.name: body for body in brief.summary.bodies}
    if job.moves_itself:
        return tuple(name for name, body in bodies.items() if any(geom.shape == "plane" for geom in body.geoms))
    if job.target is None:
        return ()
    if job.kind == "pull":
        alike = [name for name in bodies if _stem(name) == _stem(job.target.body)]
        return tuple(alike)
    return (job.target.body,)


def _ground_names(brief: Brief) -> set[str]:
    """Return the names of planes and of the bodies they belong to."""
    planes = [(body, geom) for body in brief.summary.bodies for geom in body.geoms if geom.shape == "plane"]
    return {name for body, geom in planes for name in (body.name, geom.name)}


def _stem(name: str) -> str:
    return "".join(letter for letter in name if not letter.isdigit())


def _over_target(job: Job) -> tuple[float, float]:
    """Return the offset of a grasping robot with which the object lies on its axis: x and y of the mount [m].

    It is 0 unless the base is fixed: a mount that the environment moves goes to the object itself.
    """
    if job.kind != "grasp" or job.base != "fixed":
        return 0.0, 0.0
    x, y, _ = job.target_in_mount_m
    return round(x, 5) + 0.0, round(y, 5) + 0.0


def _where(job: Job, base: str) -> str:
    if base == "free":
        return f"It stands free at {job.mount_name}."
    return f"It is fixed to {job.mount_name}" + (", which the environment moves." if job.base == "moving" else ".")


def _step_away(job: Job, brief: Brief, placement: Placement, fault: Fault) -> tuple[dict[str, Vec3], str]:
    """Return how the robot moves one step away from what it overlaps: up from the ground, back, or aside.

    Returns:
        The changed field of the placement with its value, and a clause that describes the change.
    """
    x, y, z = placement.position_m
    if placement.base == "free" and set(fault.names) & _ground_names(brief):
        return {"position_m": (x, y, round(z + _STEP_M / 4.0, 5))}, f"raised it by {250 * _STEP_M:g} mm"
    others = ", ".join(fault.names[:2])
    if placement.base == "free":
        step = max(_FREE_STEP_M, abs(x))
        return {"position_m": (round(x - step, 5), y, z)}, f"set it back by {1000 * step:g} mm from {others}"
    if must_lean(job) and placement.rotation_deg[1]:
        turn = placement.rotation_deg
        turned = (turn[0], turn[1] + _STEP_DEG, turn[2])
        return {"rotation_deg": turned}, f"leaned it {_STEP_DEG:g} deg further aside from {others}"
    step = max(_STEP_M, -z)  # as far as all steps before, so that a deep overlap does not use up all attempts
    words = f"moved it back by {1000 * step:g} mm along the mount's axis from {others}"
    return {"position_m": (x, y, round(z - step, 5))}, words
