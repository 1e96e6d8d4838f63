"""Solids in millimetres: MuJoCo's primitives, rods and holes between two points, and their triangulated surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from manifold3d import CrossSection, Manifold, OpType
from numpy.typing import NDArray

from aidsr.fabrication.anatomy import Shape, Vector
from aidsr.fabrication.skeleton import unit

_CHORD_ERROR_MM = 0.03
"""Largest distance between a circle and the sides of its polygon. Our choice: below what printers resolve."""

M4_HOLE_MM = 4.5
"""Diameter of the holes for M4 screws. Source: ISO 273, medium fit."""

_OVERSHOOT_MM = 0.2
"""Distance by which a cutting solid extends beyond the face it cuts, so that no skin of zero thickness is left."""


@dataclass(frozen=True)
class Triangles:
    """The triangulated surface of a solid.

    Attributes:
        points: Corners (n, 3) [mm].
        faces: Indices of the three corners of each triangle, counterclockwise seen from outside (m, 3).
    """

    points: NDArray[np.float64]
    faces: NDArray[np.int64]

    @property
    def corners(self) -> NDArray[np.float64]:
        """Corners of each triangle (m, 3, 3) [mm]."""
        return np.asarray(self.points[self.faces])

    @property
    def normals(self) -> NDArray[np.float64]:
        """Outward normal of each triangle, with a length of twice its area (m, 3) [mm2]."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.asarray(np.cross(b - a, c - a))


def solid_of(shape: Shape) -> Manifold:
    """Return the solid of a shape, in the robot's frame."""
    a, b, c = shape.size_mm
    if shape.kind == "sphere":
        solid = Manifold.sphere(a, _sides(a))
    elif shape.kind == "capsule":
        ball = Manifold.sphere(a, _sides(a))
        solid = Manifold.batch_hull([ball.translate((0, 0, -b)), ball.translate((0, 0, b))])
    elif shape.kind == "cylinder":
        solid = Manifold.cylinder(2 * b, a, a, _sides(a), center=True)
    elif shape.kind == "box":
        solid = Manifold.cube((2 * a, 2 * b, 2 * c), center=True)
    elif shape.kind == "ellipsoid":
        solid = Manifold.sphere(1.0, _sides(max(a, b, c))).scale((a, b, c))
    else:
        solid = Manifold.hull_points(np.array(shape.points_mm))
    return placed(solid, np.array(shape.position_mm), np.array(shape.rotation).reshape(3, 3))


def placed(solid: Manifold, position: Vector, rotation: Vector) -> Manifold:
    """Return a solid rotated by a matrix (3, 3) and then moved by `position`."""
    return solid.transform(np.column_stack([rotation, position]))


def frame_along(direction: Vector, side: Vector | None = None) -> Vector:
    """Return a rotation matrix (3, 3) with its z axis along `direction` and its x axis as close to `side` as possible.

    Without a `side`, or where it is parallel to `direction`, a coordinate axis is used instead.
    """
    z = unit(direction)
    if side is None or np.linalg.norm(np.cross(side, z)) < 1e-6:
        side = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = unit(side - (side @ z) * z)
    return np.column_stack([x, np.cross(z, x), z])


def rounded(begin: Vector, end: Vector, radius: float, end_radius: float | None = None) -> Manifold:
    """Return a cylinder from one point to another, or a truncated cone where `end_radius` is given."""
    length = float(np.linalg.norm(end - begin))
    last = radius if end_radius is None else end_radius
    return placed(Manifold.cylinder(length, radius, last, _sides(max(radius, last))), begin, frame_along(end - begin))


def box_between(begin: Vector, end: Vector, side: Vector, width: float, thickness: float) -> Manifold:
    """Return a box from one point to another, `width` wide along `side`."""
    bar = Manifold.cube((width, thickness, float(np.linalg.norm(end - begin))), center=True)
    return placed(bar, (begin + end) / 2, frame_along(end - begin, side))


def bell_mouth(face: Vector, outward: Vector, radius: float, fillet: float) -> Manifold:
    """Return the solid to cut so that a round hole has a filleted rim at a face and its line bends over no sharp edge.

    Args:
        face: Centre of the hole on the face (3,) [mm].
        outward: Direction out of the hole (3,).
        radius: Radius of the hole [mm].
        fillet: Radius of the fillet [mm].
    """
    turn = np.linspace(0, np.pi / 2, 4)
    arc = np.column_stack([radius + fillet - fillet * np.cos(turn), fillet * np.sin(turn) - fillet])
    rim = [[radius + fillet, _OVERSHOOT_MM], [0.0, _OVERSHOOT_MM], [0.0, -fillet]]
    return placed(
        Manifold.revolve(CrossSection([np.vstack([arc, rim])]), _sides(radius + fillet)), face, frame_along(outward)
    )


def _sides(radius: float) -> int:
    """Return the number of sides of a circle's polygon, a multiple of four."""
    half_turn = np.arccos(max(0.0, 1.0 - _CHORD_ERROR_MM / radius))
    return int(np.clip(4 * np.ceil(np.pi / half_turn / 4), 12, 96))


def union(solids: list[Manifold]) -> Manifold:
    """Return the union of all solids."""
    return Manifold.batch_boolean(solids, OpType.Add) if solids else Manifold()


def first_hits(solid: Manifold, begin: Vector, direction: Vector, reach: float) -> list[float]:
    """Return the distances at which a ray enters or leaves a solid, nearest first, up to `reach` [mm]."""
    hits = solid.ray_cast(begin, begin + reach * unit(direction))
    return [float(hit.distance) * reach for hit in hits]


def triangles(solid: Manifold) -> Triangles:
    """Return the surface of a solid."""
    mesh = solid.to_mesh64()
    return Triangles(np.asarray(mesh.vert_properties)[:, :3].astype(float), np.asarray(mesh.tri_verts).astype(np.int64))
