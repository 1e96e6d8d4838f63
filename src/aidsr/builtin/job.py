"""Reading a brief: what kind of job it is, and the lengths that size a robot for it."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from aidsr.artifacts import BodySummary, Brief, EnvironmentSummary, GeomSummary, MountSummary

__all__ = ["Job", "Kind", "Target", "read_job"]

Kind = Literal["reach", "grasp", "pull", "crawl"]

_WORDS: dict[Kind, tuple[str, ...]] = {
    "grasp": ("grasp", "grip", "pick", "hold", "catch", "lift", "grab", "carry", "retain"),
    "pull": ("open", "pull", "hook", "drawer", "handle", "unlatch"),
    "crawl": (
        "crawl",
        "walk",
        "climb",
        "locomot",
        "forward",
        "travel",
        "cross",
        "stair",
        "roll",
        "traverse",
        "get past",
    ),
    "reach": ("reach", "press", "push", "touch", "point", "brush", "wipe", "insert", "follow", "surface", "button"),
}
"""Word stems that speak for a kind of job. Our choice, from the objectives of the 14 benchmark tasks."""

_HANDLE = re.compile(r"handle|bar|knob|grip|hook|ring", re.IGNORECASE)
_NUMBER = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"
_TRAVEL = re.compile(rf"slide along ({_NUMBER}) ({_NUMBER}) ({_NUMBER}),? ({_NUMBER}) to ({_NUMBER})")
_GRASPABLE_M = 0.06
"""A free body no wider than twice this is taken for something to grasp. Our choice: what a hand of 0.2 m closes on."""

_UPRIGHT = 0.7
"""Share of a mount's axis that points up where something can stand on it. Our choice: less than 45 deg aslant."""

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Target:
    """What the job is about, seen from the mount.

    Attributes:
        body: Name of the environment's body.
        part: Name of the geom that is meant, for a handle; else the body's name.
        along_m: Distance from the mount along its z axis.
        beside_m: Distance from that axis.
        half_width_m: Largest half extent across.
        mass_kg: Mass of the body.
        position_m: In world coordinates.
    """

    body: str
    part: str
    along_m: float
    beside_m: float
    half_width_m: float
    mass_kg: float
    position_m: tuple[float, float, float]

    @property
    def distance_m(self) -> float:
        """Straight distance from the mount [m]."""
        return math.hypot(self.along_m, self.beside_m)


@dataclass(frozen=True)
class Job:
    """A brief, understood.

    Attributes:
        kind: What the robot has to do.
        because: The words or facts that decided it, as a sentence.
        mount: Where the robot attaches; None for the origin of the world.
        base: What holds the root.
        target: What has to be reached, held or pulled, if there is anything.
        approach_m: How far the mount itself can travel along its own z axis.
        room_m: Free length along the mount's z at its nearest, up to the first thing that stands still.
        ground_m: Height of the ground over the mount; a mount to stand on is on the ground.
    """

    kind: Kind
    because: str
    mount: MountSummary | None
    base: Literal["fixed", "free", "moving"]
    target: Target | None
    approach_m: float
    room_m: float
    ground_m: float

    @property
    def mount_name(self) -> str:
        """Name of the mount as a Placement wants it."""
        return self.mount.name if self.mount else "world"

    @property
    def target_in_mount_m(self) -> tuple[float, float, float]:
        """Where the target is in the mount's own frame; at the mount where there is no target."""
        if self.target is None:
            return 0.0, 0.0, 0.0
        offset = np.array(self.target.position_m) - np.array(self.mount.position_m if self.mount else (0.0, 0.0, 0.0))
        x = np.array(self.mount.x_axis if self.mount else (1.0, 0.0, 0.0))
        z = np.array(self.mount.z_axis if self.mount else (0.0, 0.0, 1.0))
        return float(offset @ x), float(offset @ np.cross(z, x)), float(offset @ z)

    @property
    def down_in_mount(self) -> float:
        """Share of the mount's z axis that points down: 1 hanging, 0 horizontal, -1 standing."""
        return -self.mount.z_axis[2] if self.mount else -1.0


def read_job(brief: Brief) -> Job:
    """Understand a brief. Deterministic; reads only words and the environment's facts."""
    summary = brief.summary
    mount = summary.mounts[0] if summary.mounts else None
    kind, because = _kind(brief)
    base = _base(brief, kind, mount)
    if base == "free" and mount is not None and (mount.z_axis[2] < _UPRIGHT or mount.moved_by):
        mount = None  # made for something that hangs from it, not for something that stands
    target = _target(brief.objective, kind, summary, mount)
    return Job(
        kind=kind,
        because=because,
        mount=mount,
        base=base,
        target=target,
        approach_m=_approach(summary, mount),
        room_m=_room(summary, mount, target),
        ground_m=_ground(summary) if mount is None else 0.0,
    )


def _kind(brief: Brief) -> tuple[Kind, str]:
    words = brief.objective.lower()
    found = {kind: [stem for stem in stems if re.search(rf"\b{stem}", words)] for kind, stems in _WORDS.items()}
    if brief.base == "free":
        return "crawl", "the robot's base is free, so the body has to carry itself"
    best = max(found, key=lambda kind: len(found[kind]))
    if found[best]:
        return best, f"the objective speaks of {', '.join(found[best])}"
    loose = [body for body in brief.summary.bodies if _is_loose(body) and _half_width(body.geoms) <= _GRASPABLE_M]
    if loose:
        return "grasp", f"the objective names no action known to the rules; {loose[0].name} lies free and fits a hand"
    if brief.summary.mounts:
        return (
            "reach",
            "the objective names no action known to the rules; there is a mount, so an arm that reaches is assumed",
        )
    return (
        "crawl",
        "the objective names no action known to the rules and there is no mount; a body that moves itself is assumed",
    )


def _base(brief: Brief, kind: Kind, mount: MountSummary | None) -> Literal["fixed", "free", "moving"]:
    if brief.base != "any":
        return brief.base
    if kind == "crawl":
        return "free"
    return "moving" if mount and mount.moved_by else "fixed"


def _is_loose(body: BodySummary) -> bool:
    return any(joint.endswith(": free") for joint in body.joints)


def _target(objective: str, kind: Kind, summary: EnvironmentSummary, mount: MountSummary | None) -> Target | None:
    """Choose what the job is about: a handle to pull, else what moves and is named, nearest to the mount."""
    driven = set(mount.moved_by) if mount else set()
    bodies = [body for body in summary.bodies if body.parent and body.geoms and not _carries_mount(body, driven)]
    if kind == "crawl" or not bodies:
        return None
    if kind == "pull":
        handles = [(body, geom) for body in bodies for geom in body.geoms if _HANDLE.search(geom.name)]
        if handles:
            return _nearest([_seen(body, (geom,), geom.name, mount) for body, geom in handles])
    movable = [body for body in bodies if body.joints] or bodies
    named = [body for body in movable if any(word in objective.lower() for word in _names(body))]
    return _nearest([_seen(body, body.geoms, body.name, mount) for body in named or movable])


def _nearest(targets: list[Target]) -> Target:
    return min(targets, key=lambda target: target.distance_m)


def _carries_mount(body: BodySummary, driven: set[str]) -> bool:
    return any(joint.split(":")[0] in driven for joint in body.joints)


def _names(body: BodySummary) -> list[str]:
    return [word for word in re.split(r"[^a-z]+", body.name.lower()) if len(word) > 3]


def _seen(body: BodySummary, geoms: tuple[GeomSummary, ...], part: str, mount: MountSummary | None) -> Target:
    position = np.mean([geom.position_m for geom in geoms], axis=0)
    along, beside = _in_mount(position, mount)
    return Target(
        body=body.name,
        part=part,
        along_m=along,
        beside_m=beside,
        half_width_m=_half_width(geoms),
        mass_kg=body.mass_kg,
        position_m=(float(position[0]), float(position[1]), float(position[2])),
    )


def _in_mount(position: Vector, mount: MountSummary | None) -> tuple[float, float]:
    """Return the distance along the mount's z and off that axis [m]."""
    offset = position - np.array(mount.position_m if mount else (0.0, 0.0, 0.0))
    axis = np.array(mount.z_axis if mount else (0.0, 0.0, 1.0))
    along = float(offset @ axis)
    return along, float(np.linalg.norm(offset - along * axis))


def _half_width(geoms: tuple[GeomSummary, ...]) -> float:
    """Largest half extent across [m]; a plane has none."""
    widths = [
        max(geom.size_m[:2]) if geom.shape == "box" else geom.size_m[0] for geom in geoms if geom.shape != "plane"
    ]
    return max(widths, default=0.0)


def _approach(summary: EnvironmentSummary, mount: MountSummary | None) -> float:
    """Return how far the joints that move the mount can bring it forward along its own z [m]."""
    if mount is None:
        return 0.0
    axis, travel = np.array(mount.z_axis), 0.0
    for body in summary.bodies:
        for joint in body.joints:
            match = _TRAVEL.search(joint)
            if joint.split(":")[0] in mount.moved_by and match:
                x, y, z, low, high = (float(number) for number in match.groups())
                along = float(np.array([x, y, z]) @ axis)
                travel += max(along * low, along * high, 0.0)
    return travel


def _room(summary: EnvironmentSummary, mount: MountSummary | None, target: Target | None) -> float:
    """Return the free length along the mount's z to the first surface that stands still, mount at its nearest [m]."""
    if mount is None:
        return math.inf
    axis, start = np.array(mount.z_axis), np.array(mount.position_m)
    reach = [_surface(geom, axis, start) for body in summary.bodies if not body.joints for geom in body.geoms]
    beyond = [distance for distance in reach if target is None or distance > target.along_m * 0.5]
    return min(beyond, default=math.inf) - _approach(summary, mount)


def _ground(summary: EnvironmentSummary) -> float:
    """Return the height of the highest plane, 0 where there is none [m]."""
    planes = [geom.position_m[2] for body in summary.bodies for geom in body.geoms if geom.shape == "plane"]
    return max(planes, default=0.0)


def _surface(geom: GeomSummary, axis: Vector, start: Vector) -> float:
    """Return where the mount's axis meets a plane or an upright box [m]; infinite where it meets neither."""
    offset = np.array(geom.position_m) - start
    along = float(offset @ axis)
    if geom.shape == "plane":
        return along if abs(axis[2]) > 0.7 and along > 0 else math.inf
    if geom.shape == "box" and len(geom.size_m) == 3:
        beside = np.abs(offset - along * axis)
        across = np.array(geom.size_m) * (1.0 - np.abs(axis))
        if along > 0 and bool(np.all(beside <= across + 1e-9)):
            return along - float(np.abs(axis) @ np.array(geom.size_m))
    return math.inf
