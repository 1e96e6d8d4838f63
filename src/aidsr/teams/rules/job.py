"""Reading a brief: what kind of job it is, and the lengths that size a robot for it."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Brief, EnvironmentSummary, GeomSummary, MountSummary
from aidsr.teams.rules.job_kinds import JobKindName, kind_of
from aidsr.teams.rules.targets import Target, find_target

_NUMBER = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"
_TRAVEL = re.compile(rf"slide along ({_NUMBER}) ({_NUMBER}) ({_NUMBER}),? ({_NUMBER}) to ({_NUMBER})")
_UPRIGHT = 0.7
"""Share of a mount's axis that points up where something can stand on it. Our choice: less than 45 deg aslant."""

_GAP_M = 0.02
"""From how high a gap under something counts as one. Our choice: lower than any robot of the built-in families."""

_FORCES = re.compile(rf"({_NUMBER}) to ({_NUMBER}) N\b")
_PRESS_N = 0.65
"""Force to press with where the objective names none. Our choice: a light brush."""

_BREAKS = re.compile(r"\b(?:fragile|delicate|gentl|crush|bruis|break)")
_GENTLE_PULL = 0.4
"""Our choice, measured on delicate_grasping: a tenth of the usual tension is all that a thing that breaks at 2 N bears,
and a policy that can hardly try anything without breaking it learns to keep away."""

Vector = NDArray[np.float64]


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
        headroom_m: Height over the ground of the lowest thing that can be gone under; infinite where there is none.
        ground_m: Height of the ground over the mount; a mount to stand on is on the ground.
        press_n: Force to press with [N]: the middle of the range the objective names.
        pull: How hard cables of a hand pull, as a share of what the family is used to; less for things that break.
    """

    kind: JobKindName
    because: str
    mount: MountSummary | None
    base: Literal["fixed", "free", "moving"]
    target: Target | None
    approach_m: float
    room_m: float
    headroom_m: float
    ground_m: float
    press_n: float = _PRESS_N
    pull: float = 1.0

    @property
    def moves_itself(self) -> bool:
        """Whether the robot's work is to get somewhere."""
        return self.kind in ("crawl", "squeeze")

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
    kind, because = kind_of(brief)
    base = _base(brief, kind, mount)
    if base == "free" and mount is not None and (mount.z_axis[2] < _UPRIGHT or mount.moved_by):
        mount = None  # made for something that hangs from it, not for something that stands
    target = find_target(brief.objective, kind, summary, mount)
    return Job(
        kind=kind,
        because=because,
        mount=mount,
        base=base,
        target=target,
        approach_m=_approach(summary, mount),
        room_m=_room(summary, mount, target),
        headroom_m=_headroom(summary),
        ground_m=_ground(summary) if mount is None else 0.0,
        press_n=_press(brief.objective),
        pull=_GENTLE_PULL if kind == "grasp" and _BREAKS.search(brief.objective.lower()) else 1.0,
    )


def _base(brief: Brief, kind: JobKindName, mount: MountSummary | None) -> Literal["fixed", "free", "moving"]:
    if brief.base != "any":
        return brief.base
    if kind in ("crawl", "squeeze"):
        return "free"
    return "moving" if mount and mount.moved_by else "fixed"


def _press(objective: str) -> float:
    """Return the middle of the range of forces that an objective names [N]."""
    named = _FORCES.search(objective)
    return (float(named[1]) + float(named[2])) / 2.0 if named else _PRESS_N


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


def _headroom(summary: EnvironmentSummary) -> float:
    """Return the height of the lowest upright box over the ground with something of a gap under it [m]."""
    ground = _ground(summary)
    boxes = [geom for body in summary.bodies if not body.joints for geom in body.geoms if geom.solid]
    under = [
        box.position_m[2] - box.size_m[2] - ground for box in boxes if box.shape == "box" and box.z_axis[2] > _UPRIGHT
    ]
    return min((gap for gap in under if gap > _GAP_M), default=math.inf)


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
