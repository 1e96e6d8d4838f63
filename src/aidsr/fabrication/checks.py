"""Is a piece fit to be printed: closed, thick enough, within the bed, and with how much support."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from manifold3d import Manifold

from aidsr.fabrication.anatomy import Vector
from aidsr.fabrication.printers import Printer
from aidsr.fabrication.solids import Triangles, frame_along, placed, triangles
from aidsr.fabrication.weld import is_watertight, welded

Size = tuple[float, float, float]

_PROBES = 300
"""Places at which a wall is measured. Our choice: every 2 mm of a piece of the size of a hand's joint."""

_FACING = 0.9
"""Cosine above which two faces count as the two sides of a wall; less is an edge."""

_SAFE_TURN_MM = 1e-3


@dataclass(frozen=True)
class Print:
    """A piece as it lies on the bed.

    Attributes:
        surface: Turned to stand as it is printed, its lowest point at 0.
        size_mm: Of the box around it.
        support_mm3: Volume under faces that lean too far, down to the bed or the next face: a bound from above.
        fits: Whether it goes onto the bed.
        watertight: Whether each edge joins exactly two triangles.
        wall_mm: Thinnest wall found.
    """

    surface: Triangles
    size_mm: Size
    support_mm3: float
    fits: bool
    watertight: bool
    wall_mm: float


def to_print(
    solid: Manifold, up: Vector, printer: Printer, inside: Manifold | None = None
) -> tuple[Print, Triangles | None]:
    """Return a piece in the position that needs least support, among its limb's axis and the three others.

    Args:
        solid: Where it sits in the robot.
        up: Its limb's axis (3,).
        printer: What it is printed on.
        inside: Something in it that is wanted in the same position.
    """
    frame = frame_along(up)
    choices: list[tuple[bool, float, int, Size, Manifold, Vector, Size]] = []
    for axis, sign in ((2, 1), (2, -1), (0, 1), (0, -1), (1, 1), (1, -1)):
        turn = frame_along(sign * frame[:, axis]).T
        turned = placed(solid, np.zeros(3), turn)
        x0, y0, z0, x1, y1, z1 = turned.bounding_box()
        shift = (-(x0 + x1) / 2, -(y0 + y1) / 2, -z0)
        turned = turned.translate(shift)
        size = (x1 - x0, y1 - y0, z1 - z0)
        choices.append(
            (not printer.fits(size), _support_mm3(triangles(turned), printer), len(choices), size, turned, turn, shift)
        )
    outside, support, _, size, chosen, turn, shift = min(choices, key=lambda choice: choice[:3])
    surface = welded(chosen)
    lying = Print(surface, size, support, not outside, is_watertight(surface), thinnest_wall_mm(chosen))
    if inside is None or inside.is_empty():
        return lying, None
    return lying, welded(placed(inside, np.zeros(3), turn).translate(shift))


def thinnest_wall_mm(solid: Manifold) -> float:
    """Return the thinnest wall between two faces that look away from each other [mm]."""
    surface = triangles(solid)
    normals, corners = surface.normals, surface.corners
    areas = np.linalg.norm(normals, axis=1)
    largest = np.argsort(-areas)[: 4 * _PROBES]
    thinnest = np.inf
    for face in largest[:: max(1, len(largest) // _PROBES)]:
        if areas[face] == 0:
            continue
        outward = normals[face] / areas[face]
        start = corners[face].mean(axis=0) - _SAFE_TURN_MM * outward
        for hit in solid.ray_cast(start, start - 50.0 * outward)[:1]:
            if float(np.array(hit.normal) @ outward) < -_FACING:
                thinnest = min(thinnest, 50.0 * float(hit.distance))
    return float(thinnest)


def _support_mm3(surface: Triangles, printer: Printer) -> float:
    """Volume between the bed and the faces that hang over, a bound on what a slicer fills [mm3]."""
    normals, corners = surface.normals, surface.corners
    area = np.linalg.norm(normals, axis=1) / 2
    down = -normals[:, 2] / np.maximum(2 * area, 1e-12)
    height = corners[:, :, 2].mean(axis=1)
    hanging = (down > np.sin(np.deg2rad(printer.overhang_deg)) + 1e-6) & (height > 0.3)
    return float((area * down * height)[hanging].sum())
