"""Rotation of a robot on its mount, so that it works up and down, reaches ahead, or clears what is in front of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from aidsr.teams.rules.job import Job

_ON_AXIS = 0.25
"""Ratio of the distances off and along the mount's axis below which a target is in front of it. Our choice: 14 deg."""
_HORIZONTAL = 0.7
"""Vertical component of a mount's axis below which the mount counts as sideways. Our choice: 45 deg."""
_LEAN_DEG = 25.0
"""Least lean of an arm on a fixed mount that would otherwise grow into its target [deg]. Our choice."""
_LEAN_GAP_M = 0.03
"""Clearance of a leaning robot's end [m]: its pad and 15 mm. Our choice."""


@dataclass(frozen=True)
class Orientation:
    """A rotation on the mount, and the reason for it."""

    rotation_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    reason: str = ""


STRAIGHT = Orientation()


def stands_in_front(job: Job) -> bool:
    """Whether a straight robot on the mount would run into the target."""
    return job.target is not None and job.target.beside_m < _ON_AXIS * job.target.along_m


def must_lean(job: Job) -> bool:
    """Whether a straight robot would grow into a target towards which the mount cannot move."""
    return job.kind in ("reach", "brush") and stands_in_front(job) and job.approach_m == 0


def looks_sideways(job: Job) -> bool:
    """Whether the mount's axis is closer to horizontal than to vertical."""
    return abs(job.down_in_mount) < _HORIZONTAL


def bend_upright(job: Job) -> Orientation:
    """Return the rotation that turns the robot's +x down, for a robot that works on a handle from above."""
    return Orientation(
        (0.0, 0.0, angle_to_down_deg(job)),
        "Its bending plane is upright, its +x down, so that it reaches over the handle from above.",
    )


def lean_aside(job: Job, length_m: float) -> Orientation:
    """Return the lean with which the end of a straight robot clears a target in front; no rotation if none is needed.

    Args:
        job: The job.
        length_m: Length of the robot [m]; 0 if it is unknown.
    """
    if not must_lean(job):
        return STRAIGHT
    free_m = min(job.room_m, job.target.along_m if job.target else job.room_m) - _LEAN_GAP_M
    share = max(free_m / length_m, 0.5) if length_m > 0 else 1.0
    lean_deg = round(max(math.degrees(math.acos(min(share, 1.0))), _LEAN_DEG), 1)
    reason = f"It leans aside by {lean_deg:g} deg, because its target stands straight in front of the mount."
    return Orientation((0.0, lean_deg, 0.0), reason)


def angle_to_down_deg(job: Job) -> float:
    """Return the angle about the mount's z axis that turns its x axis down [deg]."""
    if job.mount is None:
        return 0.0
    x, z = np.array(job.mount.x_axis), np.array(job.mount.z_axis)
    down = np.array([0.0, 0.0, -1.0])
    return round(math.degrees(math.atan2(float(np.cross(x, down) @ z), float(x @ down))), 3) + 0.0
