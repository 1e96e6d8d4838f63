"""Spheres that stand for the surface of a robot's geoms, in the frames of the geoms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import mujoco
import numpy as np

if TYPE_CHECKING:
    from aidsr.tasks.readings import FloatArray

SPHERES = 3
"""Number of spheres along the longest axis of each geom of a strung outline: at both ends and in the middle."""
_MOST_IN_LINE, _MOST_IN_GRID = 32, 12
"""Most spheres along the axis of a long geom, and along each side of a flat one. Our choice: 32 are enough for a geom
17 times as long as wide; a longer or flatter one gets as many, farther apart. 41 geoms with 272 spheres take 30 us of a
control step, 20 us with three spheres each."""
_FLAT = 2.0
"""Ratio of a geom's middle half size to its smallest from which it is flat and gets a grid of spheres. Our choice."""
_RIM = 16
"""Points on each rim of a cylinder."""

_GEOM = mujoco.mjtGeom


def strung(half_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return three spheres along the longest axis of each geom.

    Args:
        half_m: Half sizes of the geoms' boxes, (g, 3) [m].

    Returns:
        Centres in the geoms' frames, (g, 3, 3) [m], and radii, (g, 3) [m].
    """
    radius_m = half_m.min(axis=1)
    along = half_m.max(axis=1) - radius_m
    axis = np.eye(3)[half_m.argmax(axis=1)] if len(half_m) else np.zeros((0, 3))
    steps = np.linspace(-1.0, 1.0, SPHERES)
    return steps[None, :, None] * (along[:, None] * axis)[:, None, :], np.repeat(radius_m[:, None], SPHERES, axis=1)


def covering(model: mujoco.MjModel, geoms: Sequence[int]) -> tuple[tuple[int, ...], FloatArray, FloatArray]:
    """Return spheres in each geom that nearly reach its surface everywhere, and the corners of boxes and cylinders.

    Spheres lie no farther apart than their radius, so between two of them the surface is missed by at most 0.14 radii,
    and in a grid by at most 0.3; see `_MOST_IN_LINE` for geoms with too many. Corners are spheres of radius 0.

    Args:
        model: Compiled scene.
        geoms: Ids of the geoms, g of them.

    Returns:
        The geom of each sphere, p of them; centres in the geoms' frames, (p, 1, 3) [m], and radii, (p, 1) [m].
    """
    each = [_of_geom(int(model.geom_type[geom]), model.geom_aabb[geom]) for geom in geoms]
    owners = tuple(geom for geom, (_, radius) in zip(geoms, each, strict=True) for _ in radius)
    center = np.concatenate([np.zeros((0, 3)), *(center for center, _ in each)])
    radius = np.concatenate([np.zeros(0), *(radius for _, radius in each)])
    return owners, center[:, None], radius[:, None]


def _of_geom(kind: int, box: FloatArray) -> tuple[FloatArray, FloatArray]:
    middle, half = box[:3], box[3:]
    order = np.argsort(half)
    radius = float(half[order[0]])
    flat = half[order[1]] > _FLAT * radius or (kind == _GEOM.mjGEOM_BOX and half[order[1]] > 1.01 * radius)
    places = [np.zeros(1)] * 3
    places[order[2]] = _places(half[order[2]] - radius, radius, _MOST_IN_GRID if flat else _MOST_IN_LINE)
    if flat:
        places[order[1]] = _places(half[order[1]] - radius, radius, _MOST_IN_GRID)
    centers = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, 3)
    if flat and kind in (_GEOM.mjGEOM_CYLINDER, _GEOM.mjGEOM_ELLIPSOID):  # the corners of its box are not in it
        across = centers[:, order[1:]] / np.maximum(half[order[1:]] - radius, 1e-9)
        angle = np.arange(_RIM) * 2 * np.pi / _RIM
        ring = np.zeros((_RIM, 3))
        ring[:, order[1:]] = np.column_stack([np.cos(angle), np.sin(angle)]) * (half[order[1:]] - radius)
        centers = np.concatenate([centers[(across**2).sum(axis=1) <= 1.0], ring])
    corners = _corners(kind, half)
    centers = np.concatenate([corners, centers])
    return centers + middle, np.concatenate([np.zeros(len(corners)), np.full(len(centers) - len(corners), radius)])


def _places(reach_m: float, radius_m: float, most: int) -> FloatArray:
    """Return places from -reach to reach, no farther apart than a radius as far as `most` are enough, (k,) [m]."""
    if reach_m <= 1e-9:
        return np.zeros(1)
    count = most if radius_m <= 0.0 else min(most, 1 + int(np.ceil(2.0 * reach_m / radius_m)))
    return np.linspace(-reach_m, reach_m, count)


def _corners(kind: int, half_m: FloatArray) -> FloatArray:
    """Return the corners of a box, or points on the rims of a cylinder, (k, 3) [m]; none for another geom."""
    if kind == _GEOM.mjGEOM_BOX:
        return np.stack(np.meshgrid(*([[-1.0, 1.0]] * 3)), axis=-1).reshape(-1, 3) * half_m
    if kind == _GEOM.mjGEOM_CYLINDER:
        angle = np.arange(_RIM) * 2 * np.pi / _RIM
        rim = np.column_stack([np.cos(angle), np.sin(angle), np.ones(_RIM)])
        return np.concatenate([rim, rim * [1.0, 1.0, -1.0]]) * half_m
    return np.zeros((0, 3))
