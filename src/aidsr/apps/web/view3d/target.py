"""The target of a goal or a task as ghost shapes: a point, a region, a path, or bodies in their target poses."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.apps.web.view3d.parts import Parts
from aidsr.tasks.goals.bring import Bring
from aidsr.tasks.goals.follow import Follow
from aidsr.tasks.goals.goal import Goal
from aidsr.tasks.goals.move import Lift, Travel
from aidsr.tasks.goals.reach import Pose, Reach
from aidsr.tasks.goals.reading import parse_goal
from aidsr.tasks.goals.region import Region
from aidsr.tasks.goals.stages import Stages
from aidsr.tasks.goals.touch import Touch
from aidsr.tasks.goals.turn import Turn
from aidsr.tasks.mark import Mark

Array = NDArray[np.float64]
TargetSpec = str | Sequence[Mark]
"""TOML of a goal, or marks of a task; empty for no target."""

_SMALLEST = 0.012
"""Minimum radius of a point, and minimum diameter of a line, as a share of the robot's length. Our choice: just
visible."""
_ARROW = 0.25
"""Length of the line that shows a direction, as a share of the robot's length. Our choice."""
_FEELERS = 400
"""Number of angles tried for a body on a hinge, from 0 to half a turn in each direction. Our choice: steps of about
half a degree."""
_BODY, _SITE, _JOINT = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_JOINT
_GEOM = mujoco.mjtObj.mjOBJ_GEOM
_SLIDE, _HINGE, _FREE = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_FREE


class Target:
    """Finder of the shapes that show the target of a goal or of a task in a scene.

    Args:
        model: The scene.
        data: Its initial state, with kinematics computed.
        parts: Shapes of the scene.
        length_m: Length of the robot [m], to which the size of drawn marks is relative.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, parts: Parts, length_m: float) -> None:
        self._model, self._data, self._parts, self._length_m = model, data, parts, length_m
        self._there = mujoco.MjData(model)

    def shapes(self, goal: Goal) -> list[dict[str, Any]]:
        """Return shapes as `aidsr.apps.web.view3d.parts` lists them; empty if the scene lacks what the goal names."""
        match goal:
            case Stages():
                return [shape for stage in goal.stages for shape in self.shapes(stage)]
            case Reach() | Pose():
                return self._point(goal)
            case Bring():
                return self._region(goal.region)
            case Follow():
                points = [self._place(name) for name in goal.sites] or [np.array(point) for point in goal.path_m]
                return list(self._line([point for point in points if point is not None], goal.within_m))
            case Turn():
                return self._turned(goal)
            case Lift():
                return self._moved(goal.target, (0.0, 0.0, 1.0), goal.by_m)
            case Travel() if goal.target:
                return self._moved(goal.target, goal.direction, goal.distance_m)
            case Travel():
                return self._travelled(goal)
            case Touch():
                return self._same(goal.target)
        return []

    def marked(self, mark: Mark) -> list[dict[str, Any]]:
        """Return the shapes of a task's mark; empty where the scene lacks the element that it names."""
        kind = {"geom": _GEOM, "site": _SITE, "joint": _JOINT}[mark.element]
        found = mujoco.mj_name2id(self._model, kind, mark.name)
        if found < 0:
            return []
        if mark.element == "joint":
            at, is_free = int(self._model.jnt_qposadr[found]), self._model.jnt_type[found] == _FREE
            return self._at(at + 2 if is_free else at, mark.by)
        if mark.element == "geom" and mark.at_m is None:
            return [part | {"moves": False} for part in self._parts.facts if part["name"] == mark.name]
        data = self._data
        places, turns = (data.geom_xpos, data.geom_xmat) if mark.element == "geom" else (data.site_xpos, data.site_xmat)
        where = places[found] + turns[found].reshape(3, 3) @ np.array(mark.at_m or (0.0, 0.0, 0.0))
        return [self._ball(where, mark.radius_m)]

    def _point(self, goal: Reach | Pose) -> list[dict[str, Any]]:
        where = self._place(goal.target)
        if where is None:
            return []
        marks = [self._ball(where, goal.within_m)]
        if isinstance(goal, Pose):
            tip = where - _ARROW * self._length_m * _unit(goal.direction)
            marks += self._line([tip, where], 0.0)
        return marks

    def _region(self, region: Region) -> list[dict[str, Any]]:
        where = self._place(region.at) if region.at else np.array(region.center_m)
        if where is None:
            return []
        if region.radius_m is not None:
            return [self._ball(where, region.radius_m)]
        return [_shape("box", np.array(region.size_m) / 2, where, np.eye(3))]

    def _line(self, points: Sequence[Array], radius_m: float) -> Iterator[dict[str, Any]]:
        radius = max(radius_m / 4, _SMALLEST * self._length_m / 2)
        for one, other in pairwise(points):
            way = other - one
            length = float(np.linalg.norm(way))
            yield _shape("capsule", [radius, radius, length / 2], (one + other) / 2, _turned_to(way / length))

    def _ball(self, where: Array, radius_m: float) -> dict[str, Any]:
        return _shape("sphere", [max(radius_m, _SMALLEST * self._length_m)] * 3, where, np.eye(3))

    def _turned(self, goal: Turn) -> list[dict[str, Any]]:
        joint = mujoco.mj_name2id(self._model, _JOINT, goal.joint)
        if joint < 0:
            return []
        return self._at(int(self._model.jnt_qposadr[joint]), math.radians(goal.by_deg))

    def _moved(self, target: str, direction: Sequence[float], distance_m: float) -> list[dict[str, Any]]:
        """Return the shapes that move with a body, posed so that it has moved a distance [m] along a direction."""
        model, body = self._model, mujoco.mj_name2id(self._model, _BODY, target)
        carried = body
        while body > 0 and not model.body_jntnum[body]:
            body = int(model.body_parentid[body])
        if body <= 0:
            return []
        joint, way = int(model.body_jntadr[body]), _unit(direction)
        at = int(model.jnt_qposadr[joint])
        if model.jnt_type[joint] == _FREE:
            return self._at(slice(at, at + 3), distance_m * way)
        if model.jnt_type[joint] == _SLIDE:
            along = float(self._data.xaxis[joint] @ way)
            return self._at(at, distance_m / along) if abs(along) > 0.05 else []
        if model.jnt_type[joint] == _HINGE:
            return self._swung(at, carried, way, distance_m)
        return []

    def _swung(self, at: int, body: int, way: Array, distance_m: float) -> list[dict[str, Any]]:
        """Return the shapes at the smallest angle of a hinge at which a body's centre of mass has moved so far [m]."""
        for angle in np.linspace(0.0, math.pi, _FEELERS):
            for signed in (angle, -angle):
                there = self._with(at, signed)
                if (there.xipos[body] - self._data.xipos[body]) @ way >= distance_m:
                    return self._at(at, signed)
        return []

    def _travelled(self, goal: Travel) -> list[dict[str, Any]]:
        robot = [part["pose"][:3] for part in self._parts.facts if part["robot"]]
        if not robot:
            return []
        start = np.mean(robot, axis=0)
        end = start + goal.distance_m * _unit(goal.direction)
        return [*self._line([start, end], 0.0), self._ball(end, 0.04 * self._length_m)]

    def _same(self, target: str) -> list[dict[str, Any]]:
        return [part | {"moves": False} for part in self._parts.facts if part["body"] == target]

    def _place(self, name: str) -> Array | None:
        """Return the position of a site, or else of the origin of a body [m]; None where the scene has neither."""
        for kind, places in ((_SITE, self._data.site_xpos), (_BODY, self._data.xpos)):
            found = mujoco.mj_name2id(self._model, kind, name)
            if found >= 0:
                return np.array(places[found])
        return None

    def _with(self, at: int | slice, change: float | Array) -> mujoco.MjData:
        """Return the scene with `change` added to `qpos[at]`; the next call reuses the same data."""
        there = self._there
        there.qpos[:] = self._data.qpos
        there.qpos[at] += change
        mujoco.mj_kinematics(self._model, there)
        return there

    def _at(self, at: int | slice, change: float | Array) -> list[dict[str, Any]]:
        """Return the shapes outside the robot that move when `change` is added to `qpos[at]`, in their new pose."""
        before, after = self._parts.poses(self._data), self._parts.poses(self._with(at, change))
        moving = [part for part in self._parts.facts if part["moves"]]
        return [
            part | {"pose": [round(float(number), 6) for number in pose], "moves": False}
            for part, pose, was in zip(moving, after, before, strict=True)
            if not part["robot"] and not np.allclose(pose, was, atol=1e-6)
        ]


def target_facts(finder: Target, spec: TargetSpec, facts: dict[str, Any]) -> dict[str, Any] | None:
    """Return the ghost of a target as it is sent to a viewer; None where nothing is visible.

    Raises:
        UserError: The goal is not valid.
    """
    if isinstance(spec, str):
        shapes = finder.shapes(parse_goal(spec))
    else:
        shapes = [shape for mark in spec for shape in finder.marked(mark)]
    seen = [shape for shape in shapes if shape["kind"] == "geom"]
    return {"parts": seen, "surfaces": facts["surfaces"], "length_m": facts["length_m"]} if seen else None


def _shape(kind: str, size: Sequence[float] | Array, where: Array, turned: Array) -> dict[str, Any]:
    numbers = np.concatenate([where, np.asarray(turned).ravel()])
    return {
        "kind": "geom",
        "name": "",
        "body": "",
        "shape": kind,
        "size": [round(float(number), 6) for number in size],
        "rgba": [1.0, 1.0, 1.0, 1.0],
        "shine": 0.3,
        "robot": False,
        "moves": False,
        "pose": [round(float(number), 6) for number in numbers],
    }


def _unit(direction: Sequence[float]) -> Array:
    vector = np.array(direction, float)
    return np.asarray(vector / np.linalg.norm(vector))


def _turned_to(z: Array) -> Array:
    """Return a rotation matrix whose third column is the unit vector `z`."""
    quat, matrix = np.zeros(4), np.zeros(9)
    mujoco.mju_quatZ2Vec(quat, z)
    mujoco.mju_quat2Mat(matrix, quat)
    return matrix.reshape(3, 3)
