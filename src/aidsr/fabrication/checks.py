"""Printability checks of a piece: orientation on the bed, closed surface, wall thickness, size and support volume."""

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
"""Number of points at which the wall is measured. Our choice: every 2 mm on a piece the size of a finger joint."""

_FACING = 0.9
"""Cosine of the angle between opposite faces above which they count as the two sides of a wall; below it is an edge."""

_SAFE_TURN_MM = 1e-3


@dataclass(frozen=True)
class Print:
    """A piece in its orientation on the bed, with the results of the checks.

    Attributes:
        surface: Surface in the orientation in which it is printed, with its lowest point at z = 0.
        size_mm: Size of its bounding box.
        support_mm3: Volume between the bed and the faces with too much overhang, an upper bound of the support.
        fits: Whether it fits the bed.
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
    """Return a piece in the orientation that fits the bed and needs least support, out of six.

    In the six orientations, the limb's axis or one of two axes perpendicular to it points up or down.

    Args:
        solid: Solid of the piece, in its position in the robot.
        up: Axis of its limb (3,).
        printer: Printer for which it is checked.
        inside: Portion of the piece to return in the same orientation; None for none.

    Returns:
        The piece, and the surface of `inside`; None where `inside` is None or empty.
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
    """Return the smallest wall thickness between two faces with opposite normals; infinite where none is found [mm]."""
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
    """Return the volume between the bed and the overhanging faces, an upper bound of a slicer's support [mm3]."""
    normals, corners = surface.normals, surface.corners
    area = np.linalg.norm(normals, axis=1) / 2
    down = -normals[:, 2] / np.maximum(2 * area, 1e-12)
    height = corners[:, :, 2].mean(axis=1)
    hanging = (down > np.sin(np.deg2rad(printer.overhang_deg)) + 1e-6) & (height > 0.3)
    return float((area * down * height)[hanging].sum())
