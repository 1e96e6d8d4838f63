"""Comparison of pieces by shape, so that equal pieces share one file."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from aidsr.fabrication.anatomy import Part, Vector
from aidsr.fabrication.solids import placed, triangles

_TOLERANCE = 0.02
"""Largest difference between the moments of two equal pieces / cube root of the volume. Our choice: allows for the
facets of curved faces."""


def moments(solid: Manifold, part: Part) -> Vector:
    """Return volume, extent, centroid and second moments of a piece in the frame of its first part (16,) [mm].

    Second moments enter as signed square roots, so that all entries are lengths. Mirror images and rotated pieces have
    different moments.

    Source: integrals over the tetrahedra between the origin and each triangle.
    """
    turn = np.array(part.rotation).reshape(3, 3)
    at_home = placed(solid.translate(tuple(-np.array(part.position_mm))), np.zeros(3), turn.T)
    a, b, c = np.moveaxis(triangles(at_home).corners, 1, 0)
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6
    middle = (a + b + c) * volumes[:, None] / 4
    total = volumes.sum()
    second = sum(np.einsum("i,ij,ik->jk", volumes, p, p) for p in (a, b, c, a + b + c)) / 20 / total
    upper = np.asarray(second)[np.triu_indices(3)]
    signed_root = np.sign(upper) * np.sqrt(np.abs(upper))
    return np.concatenate([[np.cbrt(total)], at_home.bounding_box(), middle.sum(axis=0) / total, signed_root])


def same_shape(one: Vector, other: Vector) -> bool:
    """Whether two pieces with these moments have the same shape."""
    return bool(np.abs(one - other).max() <= _TOLERANCE * one[0])
