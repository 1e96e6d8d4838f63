"""Interpretation of a brief: the kind of job, and the lengths by which a robot is sized for it."""

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
"""Vertical component from which an axis counts as upright: that of a mount on which a robot can stand, or of a box. Our
choice: a tilt of less than 45 deg."""

_GAP_M = 0.02
"""Height from which a space under something counts as a gap [m]. Our choice: lower than any robot of the built-in
families."""

_FORCES = re.compile(rf"({_NUMBER}) to ({_NUMBER}) N\b")
_PRESS_N = 0.65
"""Pressing force if the objective names none [N]. Our choice: a light brush."""

_BREAKS = re.compile(r"\b(?:fragile|delicate|gentl|crush|bruis|break)")
_GENTLE_PULL = 0.4
"""Tension for fragile objects, as a share of a family's usual one. Our choice, measured on delicate_grasping: an object
that breaks at 2 N withstands only a tenth of the usual tension, and a policy that breaks it in nearly every attempt
learns to keep away."""

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Job:
    """The interpretation of a brief.

    Attributes:
        kind: Kind of job.
        because: Clause with the words or facts that determined the kind.
        mount: Mount of the robot; None for the origin of the world.
        base: What holds the root: a fixed mount, nothing, or a mount that the environment moves.
        target: What has to be reached, held or pulled; None if there is nothing.
        approach_m: How far the mount itself can travel along its own z axis [m].
        room_m: Free length along the mount's z axis up to the first fixed surface, with the mount at its nearest [m].
        headroom_m: Height over the ground of the lowest obstacle with a gap under it [m]; infinite without one.
        ground_m: Height of the ground over the origin of the world [m]; 0 with a mount, since a mount to stand on is on
            the ground.
        press_n: Pressing force [N]: the middle of the range that the objective names.
        pull: Tension of a hand's cables as a share of the family's usual one; less than 1 for fragile objects.
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
        """Whether the job is locomotion."""
        return self.kind in ("crawl", "squeeze")

    @property
    def mount_name(self) -> str:
        """Name of the mount as in a `Placement`."""
        return self.mount.name if self.mount else "world"

    @property
    def target_in_mount_m(self) -> tuple[float, float, float]:
        """Position of the target in the mount's own frame [m]; the origin without a target."""
        if self.target is None:
            return 0.0, 0.0, 0.0
        offset = np.array(self.target.position_m) - np.array(self.mount.position_m if self.mount else (0.0, 0.0, 0.0))
        x = np.array(self.mount.x_axis if self.mount else (1.0, 0.0, 0.0))
        z = np.array(self.mount.z_axis if self.mount else (0.0, 0.0, 1.0))
        return float(offset @ x), float(offset @ np.cross(z, x)), float(offset @ z)

    @property
    def down_in_mount(self) -> float:
        """Downward component of the mount's z axis: 1 hanging, 0 horizontal, -1 standing."""
        return -self.mount.z_axis[2] if self.mount else -1.0


def read_job(brief: Brief) -> Job:
    """Return the job that a brief describes. Deterministic; uses only words and the facts of the environment."""
    summary = brief.summary
    mount = summary.mounts[0] if summary.mounts else None
    kind, because = kind_of(brief)
    base = _base(brief, kind, mount)
    if base == "free" and mount is not None and (mount.z_axis[2] < _UPRIGHT or mount.moved_by):
        mount = None  # it is made for a robot that hangs from it, not for one that stands
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
    """Return the middle of the range of forces that an objective names, else the default [N]."""
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
    """Return the free length along the mount's z axis to the first fixed surface, with the mount at its nearest [m]."""
    if mount is None:
        return math.inf
    axis, start = np.array(mount.z_axis), np.array(mount.position_m)
    reach = [_surface(geom, axis, start) for body in summary.bodies if not body.joints for geom in body.geoms]
    beyond = [distance for distance in reach if target is None or distance > target.along_m * 0.5]
    return min(beyond, default=math.inf) - _approach(summary, mount)


def _headroom(summary: EnvironmentSummary) -> float:
    """Return the height over the ground of the lowest fixed, upright box with a gap under it [m]; infinite if none."""
    ground = _ground(summary)
    boxes = [geom for body in summary.bodies if not body.joints for geom in body.geoms if geom.solid]
    under = [
        box.position_m[2] - box.size_m[2] - ground for box in boxes if box.shape == "box" and box.z_axis[2] > _UPRIGHT
    ]
    return min((gap for gap in under if gap > _GAP_M), default=math.inf)


def _ground(summary: EnvironmentSummary) -> float:
    """Return the height of the highest plane [m]; 0 if there is none."""
    planes = [geom.position_m[2] for body in summary.bodies for geom in body.geoms if geom.shape == "plane"]
    return max(planes, default=0.0)


def _surface(geom: GeomSummary, axis: Vector, start: Vector) -> float:
    """Return the distance at which the mount's axis meets a plane or an upright box [m]; infinite if it does not."""
    offset = np.array(geom.position_m) - start
    along = float(offset @ axis)
    if geom.shape == "plane":
        return along if abs(axis[2]) > _UPRIGHT and along > 0 else math.inf
    if geom.shape == "box" and len(geom.size_m) == 3:
        beside = np.abs(offset - along * axis)
        across = np.array(geom.size_m) * (1.0 - np.abs(axis))
        if along > 0 and bool(np.all(beside <= across + 1e-9)):
            return along - float(np.abs(axis) @ np.array(geom.size_m))
    return math.inf
