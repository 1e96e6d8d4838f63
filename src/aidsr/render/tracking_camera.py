"""A camera that follows a travelling robot closely."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.render.camera import Array, aim, bounding_sphere, robot_corners
from aidsr.render.view import View
from aidsr.sim.ownership import read_ownership

_STATES = 25
"""Number of frames in which the robot is located; the camera is interpolated between. Our choice: avoids shaking."""
_TRAVELS = 1.5
"""Smallest distance from its start / radius of the robot, for a robot that travels. Our choice."""
_ROOM = 1.9
"""Radius of the region shown / radius of the robot. Our choice: shows what lies ahead of the robot."""
_AHEAD = 0.5
"""Distance by which the camera looks ahead of the robot / radius of the robot. Our choice."""


@dataclass(frozen=True, eq=False)
class Travel:
    """The path of a free robot.

    Attributes:
        model: The compiled model.
        data: State at the end of the path.
        lookat_m: Point at the centre of the picture in each frame (n_frames, 3).
        distance_m: Horizontal distance of the robot's centre from its start in each frame (n_frames,).
        radius_m: Largest radius of the robot's bounding sphere along the path.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    lookat_m: Array
    distance_m: Array
    radius_m: float

    def camera(self, view: View) -> mujoco.MjvCamera:
        """Return a camera for the end of the path; the caller must move it to `lookat_m` of each frame."""
        return aim(self.model, [self.data], self.lookat_m[-1], _ROOM * self.radius_m, view)


def track_robot(model: mujoco.MjModel, data: mujoco.MjData, positions: Array) -> Travel | None:
    """Return the path of a robot, or None if it has no free joint, does not travel or has no visible geoms.

    Args:
        model: The compiled model.
        data: State that is overwritten; it holds the last frame afterwards.
        positions: One row of `qpos` per frame (n_frames, nq).
    """
    bodies = set(read_ownership(model).bodies)
    free = model.jnt_type == mujoco.mjtJoint.mjJNT_FREE
    if len(positions) < 2 or not any(int(body) in bodies for body in model.jnt_bodyid[free]):
        return None
    numbers = np.linspace(0, len(positions) - 1, min(_STATES, len(positions))).round().astype(int)
    found = []
    for number in numbers:
        data.qpos[:] = positions[number]
        mujoco.mj_forward(model, data)
        corners = robot_corners(model, data)
        if not len(corners):
            return None
        found.append(bounding_sphere(corners))
    middles, radius = np.array([middle for middle, _ in found]), max(radius for _, radius in found)
    every = np.arange(len(positions))
    middle_m = np.column_stack([np.interp(every, numbers, column) for column in middles.T])
    level = middle_m[:, :2] - middle_m[0, :2]
    distance_m = np.linalg.norm(level, axis=1)
    if distance_m.max() < _TRAVELS * radius:
        return None
    ahead = np.append(level[-1] / max(distance_m[-1], 1e-9), 0.0)
    return Travel(model, data, middle_m + _AHEAD * radius * ahead, distance_m, radius)
