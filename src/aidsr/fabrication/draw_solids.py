"""Software rendering of solids without a graphics driver: shaded surfaces with drawn edges, as in assembly manuals."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from aidsr.fabrication.anatomy import Vector
from aidsr.fabrication.skeleton import unit
from aidsr.fabrication.solids import Triangles

Colour = tuple[float, float, float]

_LIGHT = np.array([-0.4, 0.7, 0.6])
"""Direction towards the light, in the picture's axes (right, up, towards the viewer): from the upper left."""
_AMBIENT = 0.42
_EDGE = 0.35
_MARGIN = 0.06
_OVERSAMPLING = 2
"""Factor by which pictures are drawn larger and then averaged, for smooth edges. Our choice."""


@dataclass(frozen=True)
class Coloured:
    """A surface and its colour, with channels from 0 to 1."""

    surface: Triangles
    colour: Colour
    shift: Vector
    """Displacement of the surface for the picture (3,) [mm]."""


@dataclass(frozen=True)
class View:
    """An orthographic camera.

    Attributes:
        right: Unit vector to the right of the picture (3,).
        up: Unit vector upwards in the picture (3,).
        towards: Unit vector towards the viewer (3,).
        middle: Point in the middle of the picture (3,) [mm].
        scale: Scale of the picture [px/mm].
        size: Columns and rows [px].
    """

    right: Vector
    up: Vector
    towards: Vector
    middle: Vector
    scale: float
    size: tuple[int, int]

    def project(self, points: Vector) -> Vector:
        """Return columns [px], rows [px] and depth towards the viewer [mm] of points (n, 3), as (n, 3)."""
        away = np.atleast_2d(points) - self.middle
        columns = self.size[0] / 2 + self.scale * (away @ self.right)
        rows = self.size[1] / 2 - self.scale * (away @ self.up)
        return np.column_stack([columns, rows, away @ self.towards])


def view_of(points: Vector, size: tuple[int, int], *, up: Vector, towards: Vector) -> View:
    """Return the view in which points fill a picture.

    Args:
        points: Points that must be visible (n, 3) [mm].
        size: Columns of the picture, and largest number of rows; the picture has fewer where the points need fewer.
        up: Direction that points upwards in the picture (3,).
        towards: Direction from the points towards the viewer (3,).
    """
    towards = unit(towards)
    right = unit(np.cross(up, towards))
    upwards = np.cross(towards, right)
    along = np.column_stack([points @ right, points @ upwards, points @ towards])
    low, high = along.min(axis=0), along.max(axis=0)
    width, height, _ = np.maximum(high - low, 1e-6)
    size = (size[0], min(size[1], round(size[0] * (height / width + 2 * _MARGIN))))
    scale = (1 - 2 * _MARGIN) * min(size[0] / width, size[1] / height)
    middle = np.column_stack([right, upwards, towards]) @ ((low + high) / 2)
    return View(right, upwards, towards, middle, float(scale), size)


def draw(items: Sequence[Coloured], view: View) -> bytes:
    """Return a PNG of surfaces on a white background."""
    fine = View(
        view.right, view.up, view.towards, view.middle, view.scale * _OVERSAMPLING,
        (view.size[0] * _OVERSAMPLING, view.size[1] * _OVERSAMPLING),
    )  # fmt: skip
    columns, rows = fine.size
    depth = np.full((rows, columns), -np.inf)
    normal = np.zeros((rows, columns, 3))
    colour = np.ones((rows, columns, 3))
    light = unit(_LIGHT @ np.array([fine.right, fine.up, fine.towards]))
    for item in items:
        corners = fine.project(item.surface.points + item.shift)[item.surface.faces]
        lengths = np.linalg.norm(item.surface.normals, axis=1)
        normals = item.surface.normals / np.maximum(lengths, 1e-12)[:, None]
        shades = _AMBIENT + (1 - _AMBIENT) * np.clip(normals @ light, 0, 1)
        seen = (normals @ fine.towards > 0) & (lengths > 1e-9)
        for triangle, own, shade in zip(corners[seen], normals[seen], shades[seen], strict=True):
            _fill(triangle, own, shade * np.array(item.colour), depth, normal, colour)
    lined = colour * (1 - _EDGE * _edges(depth, normal))[..., None]
    picture = Image.fromarray((np.clip(lined, 0, 1) * 255).astype(np.uint8)).resize(view.size, Image.Resampling.BOX)
    data = io.BytesIO()
    picture.quantize(128).save(data, "PNG", optimize=True)
    return data.getvalue()


def _fill(
    corners: Vector, normal: Vector, shade: Vector, depths: NDArray[np.float64], normals: Vector, colours: Vector
) -> None:
    """Draw one triangle into the buffers, where it is nearer than their contents (z-buffer)."""
    rows, columns = depths.shape
    x0, y0 = np.maximum(np.floor(corners[:, :2].min(axis=0)).astype(int), 0)
    x1 = min(int(np.ceil(corners[:, 0].max())) + 1, columns)
    y1 = min(int(np.ceil(corners[:, 1].max())) + 1, rows)
    if x0 >= x1 or y0 >= y1:
        return
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = corners
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if abs(area) < 1e-9:
        return
    x, y = np.arange(x0, x1)[None, :] + 0.5, np.arange(y0, y1)[:, None] + 0.5
    second = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
    third = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
    depth = az + second * (bz - az) + third * (cz - az)
    window = (slice(y0, y1), slice(x0, x1))
    slack = -1e-6
    nearer = (second >= slack) & (third >= slack) & (second + third <= 1 - slack) & (depth > depths[window])
    depths[window][nearer] = depth[nearer]
    normals[window][nearer] = normal
    colours[window][nearer] = shade


def _edges(depth: NDArray[np.float64], normal: Vector) -> NDArray[np.float64]:
    """Return 1 where surfaces meet at an angle or one is in front of another, else 0 (rows, columns)."""
    found = np.zeros(depth.shape, dtype=bool)
    for axis in (0, 1):
        first, second = [slice(None)] * 2, [slice(None)] * 2
        first[axis], second[axis] = slice(None, -1), slice(1, None)
        one, other = tuple(first), tuple(second)
        with np.errstate(invalid="ignore"):
            step = np.abs(depth[one] - depth[other])
        bent = np.einsum("ijk,ijk->ij", normal[one], normal[other]) < 0.75
        somewhere = np.isfinite(depth[one]) | np.isfinite(depth[other])
        found[one] |= somewhere & (bent | ~(step < 3.0))
    return found.astype(float)
