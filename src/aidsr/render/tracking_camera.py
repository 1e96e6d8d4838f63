"""A camera that follows a robot which travels, near enough to see how it moves."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.render.camera import Array, aim, bounding_sphere, robot_corners
from aidsr.render.view import View
from aidsr.sim.ownership import read_ownership

_STATES = 25
"""Moments at which the robot is looked for; between them the camera moves evenly. Our choice: it does not shake."""
_TRAVELS = 1.5
"""Radii of the robot that its middle must get away from where it began. Our choice."""
_ROOM = 1.9
"""Radii of the robot that are shown. Our choice: what it comes to next is in the picture."""
_AHEAD = 0.5
"""Radii by which the camera looks ahead of the robot. Our choice."""


@dataclass(frozen=True, eq=False)
class Travel:
    """The way of a free robot.

    Attributes:
        model: The compiled model.
        data: Its state at the end of the way.
        lookat_m: Where to look in each frame, (n_frames, 3).
        distance_m: How far the robot's middle is from where it began, seen from above, (n_frames,).
        radius_m: Of a sphere around the robot in any of its poses.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    lookat_m: Array
    distance_m: Array
    radius_m: float

    def camera(self, view: View) -> mujoco.MjvCamera:
        """Return a camera at the end of the way; it is for the caller to move it to where it looks in each frame."""
        return aim(self.model, self.data, self.lookat_m[-1], _ROOM * self.radius_m, view)


def track_robot(model: mujoco.MjModel, data: mujoco.MjData, positions: Array) -> Travel | None:
    """Return the way of a robot, None where it is not free, stays where it is or cannot be seen.

    Args:
        model: The compiled model.
        data: Room for a state; holds the last one afterwards.
        positions: One row of `qpos` a frame, (n_frames, nq).
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
