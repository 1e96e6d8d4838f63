"""Rounding of a surface to a grid that files store exactly, without degenerate triangles.

The corners of a solid have a finer resolution than the numbers in a file. Rounding while writing can make neighbouring
corners equal and triangles between them degenerate. A program that merges equal corners then finds edges shared by four
triangles, and takes the part for open.
"""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold
from numpy.typing import NDArray

from aidsr.fabrication.solids import Triangles, triangles

GRID_MM = 2.0**-10
"""Spacing of the grid of coordinates in files. Our choice: a thousandth of a millimetre, far below what printers
resolve, and a power of two, which is exact in the single precision of STL up to 16 m and in ten decimals of 3MF."""
_SHORT_MM = (0.002, 0.005, 0.01)
"""Sizes of detail to remove, tried in order until the rounded surface is closed. Our choice: at most a third of the
distance between a circle and its polygon."""

_Faces = list[tuple[int, int, int]]


def welded(solid: Manifold) -> Triangles:
    """Return the surface of a solid on the grid of files.

    The smallest simplification of `_SHORT_MM` that gives a closed surface is used; where none does, the first.
    """
    found = [triangles(solid)]
    for short_mm in _SHORT_MM:
        found.append(on_grid(triangles(solid.simplify(short_mm))))
        if is_watertight(found[-1]):
            return found[-1]
    return found[1]


def on_grid(surface: Triangles) -> Triangles:
    """Return a surface with its corners rounded to the grid, equal corners merged and degenerate triangles removed."""
    numbers = np.round(surface.points / GRID_MM).astype(np.int64)
    points, where = np.unique(numbers, axis=0, return_inverse=True)
    faces = where.reshape(-1)[surface.faces]
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    kept = _without_slivers(points, [(int(a), int(b), int(c)) for a, b, c in faces])
    used, index = np.unique(np.array(kept, dtype=np.int64).reshape(-1, 3), return_inverse=True)
    return Triangles(points[used].astype(np.float64) * GRID_MM, index.reshape(-1, 3).astype(np.int64))


def is_watertight(surface: Triangles) -> bool:
    """Whether a surface is closed and consistently oriented: each directed edge and its opposite occur exactly once."""
    faces = surface.faces
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    count = len(surface.points)
    there, back = edges[:, 0] * count + edges[:, 1], edges[:, 1] * count + edges[:, 0]
    unique = len(np.unique(there)) == len(there)
    return bool(len(faces) > 0 and unique and np.array_equal(np.sort(there), np.sort(back)))


def _without_slivers(points: NDArray[np.int64], faces: _Faces) -> _Faces:
    """Return the faces without slivers: triangles whose corners are collinear.

    The middle corner of a sliver lies on its longest edge, which another triangle shares. The other triangle is split
    at this corner and the sliver removed. Two coincident faces with opposite orientation are both removed.
    """
    corners = points[np.array(faces, dtype=np.int64).reshape(-1, 3)]
    flat = ~np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).any(axis=1)
    slivers = np.flatnonzero(flat).tolist()
    if not slivers:
        return faces
    alive: dict[int, tuple[int, int, int]] = dict(enumerate(faces))
    owner = {edge: number for number, face in alive.items() for edge in _edges(face)}
    next_number = len(faces)
    for number in slivers:  # the list grows in the loop: a split can create new slivers
        face = alive.get(number)
        if face is None:
            continue
        first, middle, last = _along(points, face)
        shared = (last, first) if (first, last) in _edges(face) else (first, last)
        other = owner.get(shared)
        if other is None or other == number or other not in alive:
            continue  # an open surface stays as it is
        a, b, tip = _turned(alive[other], shared)
        for gone in (number, other):
            for edge in _edges(alive.pop(gone)):
                if owner.get(edge) == gone:
                    del owner[edge]
        if tip == middle:
            continue  # the two faces coincide
        for new in ((a, middle, tip), (middle, b, tip)):
            alive[next_number] = new
            owner |= dict.fromkeys(_edges(new), next_number)
            if _is_sliver(points, new):
                slivers.append(next_number)
            next_number += 1
    return list(alive.values())


def _edges(face: tuple[int, int, int]) -> tuple[tuple[int, int], ...]:
    a, b, c = face
    return (a, b), (b, c), (c, a)


def _is_sliver(points: NDArray[np.int64], face: tuple[int, int, int]) -> bool:
    """Whether the corners of a face are collinear; exact, since the coordinates are integers below 2**31."""
    a, b, c = points[list(face)]
    return not np.cross(b - a, c - a).any()


def _along(points: NDArray[np.int64], face: tuple[int, int, int]) -> tuple[int, int, int]:
    """Return the corners of a sliver in order along its line."""
    corners = points[list(face)]
    axis = int(np.ptp(corners, axis=0).argmax())
    first, middle, last = (face[i] for i in np.argsort(corners[:, axis]))
    return first, middle, last


def _turned(face: tuple[int, int, int], edge: tuple[int, int]) -> tuple[int, int, int]:
    """Return the corners of a face rotated so that they begin with the given edge."""
    a, b, c = face
    return next(turn for turn in ((a, b, c), (b, c, a), (c, a, b)) if turn[:2] == edge)
