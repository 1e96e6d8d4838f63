"""Pieces to print, and cutting of a piece that exceeds the bed into several that are joined with pins."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from manifold3d import Manifold

from aidsr.fabrication.anatomy import Vector
from aidsr.fabrication.materials import Material
from aidsr.fabrication.printers import Printer
from aidsr.fabrication.skeleton import Skeleton
from aidsr.fabrication.solids import frame_along, placed, rounded, union

_PIN_MM, _PIN_DEEP_MM = 1.75, 5.0
"""Diameter of the pins that align two halves, cut from filament, and depth of a pin in each half."""

_PLACES = (0.5, 0.4, 0.6, 0.3, 0.7)
"""Positions of a cut as shares of the length, tried in order until two pins fit. Our choice: near the middle first."""

_WITHIN = 0.98
"""Smallest share of a pin's hole that must lie in plastic. Our choice: allows for the facets of a drilled circle."""


@dataclass(frozen=True)
class Piece:
    """One printed piece.

    Attributes:
        name: Name of its first part, with a number where it is a slice of a larger piece.
        parts: Indices of the rigid parts in it; a part that is cut in two belongs to both halves.
        solid: Its solid, in its position in the robot at rest.
        up: Direction of its limb at rest, from which its orientations on the bed are derived (3,).
        material: Material it is printed from.
        necks: Portion that bends and is printed solid; None where nothing bends.
        cut: Whether it is a slice of a piece that exceeded the bed.
    """

    name: str
    parts: tuple[int, ...]
    solid: Manifold
    up: Vector
    material: Material
    necks: Manifold | None = None
    cut: bool = False


def distinct(names: Iterable[str]) -> list[str]:
    """Return the names made unique: each repeated one gets a number. Upper and lower case count as the same."""
    found: dict[str, str] = {}
    for name in names:
        new, count = name, 1
        while new.casefold() in found:
            count += 1
            new = f"{name}_{count}"
        found[new.casefold()] = new
    return list(found.values())


def cut_limb(skeleton: Skeleton, piece: Piece, printer: Printer) -> tuple[Piece, ...]:
    """Return the slices of a limb from its root outwards, cut through parts until each slice fits the bed."""
    return _numbered(piece, _limb_slices(skeleton, piece, printer))


def cut_across(piece: Piece, printer: Printer) -> tuple[Piece, ...]:
    """Return the slices of a piece, cut across the longest side until each fits the bed.

    A slice that is too large stays whole where no two pins fit.
    """
    return _numbered(piece, _slices(piece, printer))


def _numbered(piece: Piece, slices: Iterable[Piece]) -> tuple[Piece, ...]:
    found = tuple(slices)
    if len(found) == 1:
        return found
    return tuple(replace(one, name=f"{piece.name}_slice_{n}", cut=True) for n, one in enumerate(found, start=1))


def _limb_slices(skeleton: Skeleton, piece: Piece, printer: Printer) -> Iterator[Piece]:
    inner = [part for part in piece.parts[1:-1] if skeleton.spine(part) is not None]
    if _fits(piece, printer) or not inner:
        yield piece
        return
    cut = inner[len(inner) // 2]
    spine = skeleton.spine(cut)
    if spine is None:
        return
    point, axis = spine
    out = next(gap for gap in skeleton.gaps if skeleton.anatomy.joints[gap.joint].parent == cut)
    into = next(gap for gap in skeleton.gaps if skeleton.anatomy.joints[gap.joint].child == cut)
    room = float((out.anchor - point) @ axis)
    middle = point + axis * (into.after_mm + room - out.before_mm) / 2
    side = np.array(skeleton.anatomy.joints[into.joint].axes[0]) * into.radius_mm / 2
    deep = min(_PIN_DEEP_MM, (room - into.after_mm - out.before_mm) / 2 - 1.0)
    pins = [
        rounded(middle + s * side - deep * axis, middle + s * side + deep * axis, (_PIN_MM + printer.fit_mm) / 2)
        for s in (1, -1)
    ]
    height = float(middle @ axis)
    upper, lower = (piece.solid - union(pins)).split_by_plane(axis, height)
    high, low = (piece.necks or Manifold()).split_by_plane(axis, height)
    at = piece.parts.index(cut)
    for solid, necks, members in ((lower, low, piece.parts[: at + 1]), (upper, high, piece.parts[at:])):
        yield from _limb_slices(skeleton, replace(piece, parts=members, solid=solid, necks=necks), printer)


def _slices(piece: Piece, printer: Printer) -> Iterator[Piece]:
    if _fits(piece, printer):
        yield piece
        return
    low, high = np.reshape(piece.solid.bounding_box(), (2, 3))
    axis = np.eye(3)[int(np.argmax(high - low))]
    for share in _PLACES:
        height = float((low + share * (high - low)) @ axis)
        pins = _pins(piece.solid, axis, height, printer)
        if pins is None:
            continue
        upper, lower = (piece.solid - pins).split_by_plane(tuple(axis), height)
        for solid in (lower, upper):
            yield from _slices(replace(piece, solid=solid), printer)
        return
    yield piece


def _fits(piece: Piece, printer: Printer) -> bool:
    """Whether a piece fits the bed in one of its possible orientations."""
    x0, y0, z0, x1, y1, z1 = placed(piece.solid, np.zeros(3), frame_along(piece.up).T).bounding_box()
    sides = (x1 - x0, y1 - y0, z1 - z0)
    return any(printer.fits((sides[a], sides[b], sides[c])) for a, b, c in ((0, 1, 2), (2, 0, 1), (2, 1, 0)))


def _pins(solid: Manifold, axis: Vector, height: float, printer: Printer) -> Manifold | None:
    """Return the holes for two pins across a cutting plane, or None where they do not fit in the plastic."""
    turn = frame_along(axis)
    section = placed(solid, np.zeros(3), turn.T).slice(height)
    islands = section.decompose()
    if not islands:
        return None
    x0, y0, x1, y1 = max(islands, key=lambda island: island.area()).bounds()
    middle, half = np.array([(x0 + x1) / 2, (y0 + y1) / 2]), np.array([x1 - x0, y1 - y0]) / 4
    radius = (_PIN_MM + printer.fit_mm) / 2
    for direction in np.eye(2)[np.argsort(-half)]:
        places = [middle + s * half * direction for s in (1, -1)]
        ends = [[turn @ np.array([x, y, height + end * _PIN_DEEP_MM]) for end in (-1, 1)] for x, y in places]
        pins = union([rounded(begin, end, radius) for begin, end in ends])
        if (pins ^ solid).volume() >= _WITHIN * pins.volume():
            return pins
    return None
