"""The target of a job: the body to reach, grasp, pull or enter, relative to the mount."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from aidsr.core.artifacts import BodySummary, EnvironmentSummary, GeomSummary, MountSummary
from aidsr.teams.rules.job_kinds import JobKindName

_HANDLE = re.compile(r"handle|bar|knob|grip|hook|ring", re.IGNORECASE)

_SHORT_WORD = 3
"""Number of letters up to which words of a body's name are not searched in the objective. Our choice: "top" is in too
many sentences."""


@dataclass(frozen=True)
class Target:
    """The target of a job, relative to the mount.

    Attributes:
        body: Name of the environment's body.
        part: Name of the geom for a handle; else the body's name.
        along_m: Distance from the mount along its z axis [m].
        beside_m: Distance from that axis [m].
        near_m: Least distance along that axis at which the target may begin [m].
        half_width_m: Largest half extent across [m].
        mass_kg: Mass of the body.
        position_m: Position in world coordinates [m].
    """

    body: str
    part: str
    along_m: float
    beside_m: float
    near_m: float
    half_width_m: float
    mass_kg: float
    position_m: tuple[float, float, float]

    @property
    def distance_m(self) -> float:
        """Straight distance from the mount [m]."""
        return math.hypot(self.along_m, self.beside_m)


def find_target(
    objective: str, kind: JobKindName, summary: EnvironmentSummary, mount: MountSummary | None
) -> Target | None:
    """Return the target of a job; None for locomotion, or in an environment without suitable bodies.

    It is the nearest handle for a job to pull. Else it is the body nearest to the mount, if possible among those that
    move and are named in the objective. A free body can be met at a place that the objective names.
    """
    driven = set(mount.moved_by) if mount else set()
    bodies = [body for body in summary.bodies if body.parent and body.geoms and not _carries_mount(body, driven)]
    if kind in ("crawl", "squeeze") or not bodies:
        return None
    if kind == "pull":
        handles = [(body, geom) for body in bodies for geom in body.geoms if _HANDLE.search(geom.name)]
        if handles:
            return _nearest(_seen(body, (geom,), geom.name, mount) for body, geom in handles)
    movable = [body for body in bodies if body.joints] or bodies
    named = [body for body in movable if any(word in objective.lower() for word in _words(body.name))] or movable
    target = _nearest(_seen(body, body.geoms, body.name, mount) for body in named)
    meeting = _meeting_point(objective, summary)
    if meeting and any(body.name == target.body and body.free for body in named):
        return _moved(target, meeting, mount)
    return target


def in_mount(position_m: Iterable[float], mount: MountSummary | None) -> tuple[float, float]:
    """Return the distances of a world position along the mount's z axis and off that axis [m]."""
    offset = np.array(tuple(position_m)) - np.array(mount.position_m if mount else (0.0, 0.0, 0.0))
    axis = np.array(mount.z_axis if mount else (0.0, 0.0, 1.0))
    along = float(offset @ axis)
    return along, float(np.linalg.norm(offset - along * axis))


def _nearest(targets: Iterable[Target]) -> Target:
    return min(targets, key=lambda target: target.distance_m)


def _carries_mount(body: BodySummary, driven: set[str]) -> bool:
    return any(joint.split(":")[0] in driven for joint in body.joints)


def _words(name: str) -> list[str]:
    return [word for word in re.split(r"[^a-z]+", name.lower()) if len(word) > _SHORT_WORD]


def _meeting_point(objective: str, summary: EnvironmentSummary) -> tuple[float, float, float] | None:
    """Return the position of a site fixed in the world with all words of its name in the objective; None without one.

    An example is a capture point.
    """
    fixed = [site for site in summary.sites if site.body in ("", "world") and len(_words(site.name)) > 1]
    named = [site for site in fixed if all(word in objective.lower() for word in _words(site.name))]
    return named[0].position_m if named else None


def _moved(target: Target, position_m: tuple[float, float, float], mount: MountSummary | None) -> Target:
    along, beside = in_mount(position_m, mount)
    near = along - target.half_width_m
    return replace(target, along_m=along, beside_m=beside, near_m=near, position_m=position_m)


def _seen(body: BodySummary, geoms: tuple[GeomSummary, ...], part: str, mount: MountSummary | None) -> Target:
    position = np.mean([geom.position_m for geom in geoms], axis=0)
    along, beside = in_mount(position, mount)
    return Target(
        body=body.name,
        part=part,
        along_m=along,
        beside_m=beside,
        near_m=min(in_mount(geom.position_m, mount)[0] - max(geom.size_m) for geom in geoms),
        half_width_m=_half_width(geoms),
        mass_kg=body.mass_kg,
        position_m=(float(position[0]), float(position[1]), float(position[2])),
    )


def _half_width(geoms: tuple[GeomSummary, ...]) -> float:
    """Return the largest half extent across [m]; planes are ignored."""
    solid = [geom for geom in geoms if geom.shape != "plane"]
    return max((max(geom.size_m[:2]) if geom.shape == "box" else geom.size_m[0] for geom in solid), default=0.0)
