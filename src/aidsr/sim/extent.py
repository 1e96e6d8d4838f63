"""Characteristic length of a robot, with which rules and tasks normalize lengths, and its bounding box."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

_SPHERE = int(mujoco.mjtGeom.mjGEOM_SPHERE)
_CAPSULE = int(mujoco.mjtGeom.mjGEOM_CAPSULE)
UNBOUNDED = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)


def characteristic_length_m(
    model: mujoco.MjModel, data: mujoco.MjData, bodies: Iterable[int], moving: Iterable[int]
) -> float:
    """Return the characteristic length L [m].

    L is the smaller of two lengths: the longest kinematic path, and the diagonal of the bounding box of the moving
    bodies. The path runs from the first moving joint through the joints of a limb to the far end of its last geom. The
    diagonal limits L for a limb that is folded in its reference pose, which would count with its unfolded length
    otherwise. L is 1 m for a robot without any extent.

    Args:
        model: Compiled model.
        data: Data of the model in the measured pose, after `mj_forward`.
        bodies: All bodies of the robot; only used if no body moves.
        moving: Bodies of the robot that can move relative to its root, parents first.

    Source: our choice; equals the length of a straight limb, and about the body length of a crawler.
    """
    moving = tuple(moving)
    low, high = bounding_box_m(model, data, moving or bodies)
    diagonal_m = float(np.linalg.norm(high - low))
    path_m = _longest_path_m(model, data, moving)
    length_m = min(diagonal_m, path_m) if path_m > 0 else diagonal_m
    # a model without any extent has length zero: one metre keeps ratios finite
    return length_m if length_m > 0 else 1.0


def bounding_box_m(model: mujoco.MjModel, data: mujoco.MjData, bodies: Iterable[int]) -> tuple[Vector, Vector]:
    """Return the lowest and highest world coordinates of the geoms of some bodies, (3,) each [m].

    If none of the bodies has a geom, their origins are used. Without any body, both results are the world's origin.
    """
    bodies = tuple(bodies)
    if geoms := _geoms(model, bodies):
        return geoms_box_m(model, data, geoms)
    points = data.xpos[list(bodies)] if bodies else np.zeros((1, 3))
    return points.min(axis=0), points.max(axis=0)


def geoms_box_m(model: mujoco.MjModel, data: mujoco.MjData, geoms: Iterable[int]) -> tuple[Vector, Vector]:
    """Return the lowest and highest world coordinates of one or more geoms, (3,) each [m]."""
    lows, highs = zip(*(_geom_box_m(model, data, geom) for geom in geoms), strict=True)
    return np.min(lows, axis=0), np.max(highs, axis=0)


def outside_m(low: Vector, high: Vector, point: Vector) -> float:
    """Return the distance of a point from a box along the axes of the world, 0 inside [m]; arguments (3,) [m]."""
    return float(np.linalg.norm(np.maximum(0.0, np.maximum(low - point, point - high))))


def _geoms(model: mujoco.MjModel, bodies: Iterable[int]) -> list[int]:
    return [
        geom
        for body in bodies
        for geom in range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body])
        if int(model.geom_type[geom]) not in UNBOUNDED
    ]


def _geom_box_m(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> tuple[Vector, Vector]:
    """Return the lowest and highest world coordinates of a geom's bounding box, (3,) each [m].

    The box of a mesh need not be centred on the origin of its geom.
    """
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    centre, rotation = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    if kind == _SPHERE:
        half = np.full(3, size[0])
    elif kind == _CAPSULE:
        half = np.asarray(np.abs(rotation[:, 2]) * size[1] + size[0])
    else:
        box = model.geom_aabb[geom]
        centre, half = centre + rotation @ box[:3], np.abs(rotation) @ box[3:]
    return centre - half, centre + half


def _farthest_m(model: mujoco.MjModel, data: mujoco.MjData, geom: int, point: Vector) -> float:
    """Return the distance from a point in world coordinates to the farthest point of a geom [m]."""
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    centre, rotation = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    if kind in (_SPHERE, _CAPSULE):
        along = rotation[:, 2] * (size[1] if kind == _CAPSULE else 0.0)
        ends = np.stack([centre + along, centre - along])
        return float(np.linalg.norm(ends - point, axis=1).max() + size[0])
    return float(np.linalg.norm(box_corners_m(model, data, geom) - point, axis=1).max())


def box_corners_m(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Vector:
    """Return the corners of a geom's bounding box along its own axes, in world coordinates, (8, 3) [m]."""
    box, rotation = model.geom_aabb[geom], data.geom_xmat[geom].reshape(3, 3)
    return np.asarray(data.geom_xpos[geom] + (box[:3] + _CORNERS * box[3:]) @ rotation.T)


def half_width_m(model: mujoco.MjModel, geom: int) -> float:
    """Return the smallest half width of a geom [m], infinite for planes and height fields.

    It is the largest depth that a point can have inside a sphere, capsule, cylinder, box or ellipsoid.
    """
    return math.inf if int(model.geom_type[geom]) in UNBOUNDED else float(model.geom_aabb[geom, 3:].min())


def _longest_path_m(model: mujoco.MjModel, data: mujoco.MjData, moving: tuple[int, ...]) -> float:
    """Return the longest path from a first joint through later joints to the farthest point of a geom [m].

    0 if no body moves.
    """
    paths: dict[int, tuple[float, Vector]] = {}
    longest_m = 0.0
    for body in moving:
        paths[body] = _follow(model, data, body, paths)
        travelled_m, anchor = paths[body]
        reach_m = max((_farthest_m(model, data, geom, anchor) for geom in _geoms(model, [body])), default=0.0)
        longest_m = max(longest_m, travelled_m + reach_m)
    return longest_m


def _follow(
    model: mujoco.MjModel, data: mujoco.MjData, body: int, paths: Mapping[int, tuple[float, Vector]]
) -> tuple[float, Vector]:
    """Return the length of the path to a body's last joint [m], and the world position of that joint."""
    first = int(model.body_jntadr[body])
    anchors = [data.xanchor[first + k] for k in range(model.body_jntnum[body])]
    travelled_m, here = paths.get(int(model.body_parentid[body]), (0.0, anchors[0] if anchors else data.xpos[body]))
    for anchor in anchors:
        travelled_m += float(np.linalg.norm(anchor - here))
        here = anchor
    return travelled_m, np.array(here)
