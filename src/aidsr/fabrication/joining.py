"""Parts joined to the pieces that are printed: limbs of an elastomer in one, plugged into a stiff root."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from manifold3d import Manifold

from aidsr.fabrication.anatomy import Vector
from aidsr.fabrication.hinges import Hinge, Hinges
from aidsr.fabrication.materials import Material, material_for
from aidsr.fabrication.printers import Printer
from aidsr.fabrication.skeleton import Gap, Skeleton
from aidsr.fabrication.solids import box_between, frame_along, placed, rounded, union

__all__ = ["Piece", "single_parts", "whole_limbs"]

_BEYOND_MM = 1.0
_COLLAR_MM = 2.5
"""Thickness of the disc with which a limb sits on its root. Our choice: six layers and more."""

_PLUG_MM, _PLUG_SHARE = 8.0, 0.6
"""Length of the plug behind that disc, and its radius / the limb's: inside of where cables run. Our choice."""

_CRUMB = 0.01
"""Share of a piece below which a bit that came off is waste. Our choice."""

_PIN_MM, _PIN_DEEP_MM = 1.75, 5.0
"""Pins that keep two halves of a limb from turning: pieces of filament."""


@dataclass(frozen=True)
class Piece:
    """One piece that comes off the printer.

    Attributes:
        name: Of its first part.
        parts: The rigid parts in it, a part that is cut in two belongs to both halves.
        solid: Where it sits in the robot at rest.
        up: Direction of its limb there, which says how it could stand on the bed (3,).
        material: What it is printed of.
        necks: What bends in it and is printed full; None where nothing bends.
    """

    name: str
    parts: tuple[int, ...]
    solid: Manifold
    up: Vector
    material: Material
    necks: Manifold | None = None


def single_parts(skeleton: Skeleton, finished: dict[int, Manifold], material: Material) -> tuple[Piece, ...]:
    """Return each part as a piece of its own."""
    parts = skeleton.anatomy.parts
    return tuple(
        Piece(parts[i].name, (i,), _without_crumbs(solid), _up(skeleton, i), material) for i, solid in finished.items()
    )


def whole_limbs(
    skeleton: Skeleton,
    hinges: Hinges,
    finished: dict[int, Manifold],
    drills: dict[int, list[Manifold]],
    material: Material,
    printer: Printer,
) -> tuple[Piece, ...]:
    """Return each limb as one piece with necks for joints, or as few as the bed allows, and its root as another.

    Args:
        skeleton: Gaps and limbs.
        hinges: The necks.
        finished: Solid of each part, drilled.
        drills: What was drilled, to keep clear in the necks too.
        material: An elastomer, for the limbs.
        printer: Whose bed holds, and whose first stiff plastic makes the roots.
    """
    anatomy = skeleton.anatomy
    stiff = next((one for one in material_for(printer, None) if not one.elastomer), material)
    children = {joint.child for joint in anatomy.joints}
    roots = {part: solid for part, solid in finished.items() if part not in children}
    pieces = []
    for limb in skeleton.limbs:
        necks = [_cleared_neck(skeleton, hinges.hinges[index], drills) for index in limb if index in hinges.hinges]
        members = [anatomy.joints[index].child for index in limb]
        first = anatomy.joints[limb[0]]
        solid = union([*(finished[part] for part in members), *necks])
        if first.parent in roots:
            foot, socket = _plug(skeleton.gaps[limb[0]], roots[first.parent], printer, drills[first.parent])
            roots[first.parent] -= socket
            solid += foot
        pieces.append(
            Piece(
                anatomy.parts[members[0]].name,
                tuple(members),
                solid,
                skeleton.gaps[limb[0]].after,
                material,
                necks=union(necks),
            )
        )
    bodies = [
        Piece(anatomy.parts[i].name, (i,), _without_crumbs(solid), _up(skeleton, i), stiff)
        for i, solid in roots.items()
    ]
    return (*bodies, *(half for piece in pieces for half in _halved(skeleton, piece, printer)))


def _plug(gap: Gap, root: Manifold, printer: Printer, drills: list[Manifold]) -> tuple[Manifold, Manifold]:
    """Return the foot of a limb, and what to take from its root for it."""
    face = gap.anchor - gap.before_mm * gap.before
    seat, reach = face - _COLLAR_MM * gap.before, max(gap.radius_mm, gap.reach_mm) + _COLLAR_MM
    end, radius = seat - _PLUG_MM * gap.before, _PLUG_SHARE * gap.radius_mm
    disc = root ^ rounded(seat, face + _BEYOND_MM * gap.before, reach)
    plug = rounded(end, face, radius) - union(drills)
    loose = rounded(end - 0.3 * gap.before, face, radius + printer.fit_mm / 2)
    return disc + plug, rounded(seat, face + _BEYOND_MM * gap.before, reach) + loose


def _halved(skeleton: Skeleton, piece: Piece, printer: Printer) -> Iterator[Piece]:
    """Yield a limb, cut across parts as often as it takes to fit the bed."""
    turned = placed(piece.solid, np.zeros(3), frame_along(piece.up).T)
    x0, y0, z0, x1, y1, z1 = turned.bounding_box()
    sides = (x1 - x0, y1 - y0, z1 - z0)
    fits = any(printer.fits((sides[a], sides[b], sides[c])) for a, b, c in ((0, 1, 2), (2, 0, 1), (2, 1, 0)))
    inner = [part for part in piece.parts[1:-1] if skeleton.spine(part) is not None]
    if fits or not inner:
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
        name = skeleton.anatomy.parts[members[0]].name + ("_upper" if members[0] == cut else "")
        yield from _halved(skeleton, replace(piece, name=name, parts=members, solid=solid, necks=necks), printer)


def _cleared_neck(skeleton: Skeleton, hinge: Hinge, drills: dict[int, list[Manifold]]) -> Manifold:
    joint = skeleton.anatomy.joints[hinge.joint]
    beside = union([*drills[joint.parent], *drills[joint.child]])
    return _neck(skeleton.gaps[hinge.joint], hinge, joint.axes[0]) - beside


def _neck(gap: Gap, hinge: Hinge, axis: tuple[float, float, float]) -> Manifold:
    """The printed neck across a gap."""
    begin = gap.anchor - (gap.before_mm + _BEYOND_MM) * gap.before
    end = gap.anchor + (gap.after_mm + _BEYOND_MM) * gap.after
    if gap.straight and hinge.kind == "round":
        return rounded(begin, end, hinge.thickness_mm / 2)
    slabs = []
    for point, onward in ((begin, gap.before), (end, -gap.after)):
        inside = point + 2 * _BEYOND_MM * onward
        if hinge.kind == "round":
            slabs.append(rounded(point, inside, hinge.thickness_mm / 2))
        else:
            slabs.append(box_between(point, inside, np.array(axis), hinge.width_mm, hinge.thickness_mm))
    return Manifold.batch_hull(slabs)


def _without_crumbs(solid: Manifold) -> Manifold:
    """Return a solid without the slivers that opening gaps may have cut off."""
    bits = solid.decompose()
    largest = max((bit.volume() for bit in bits), default=0.0)
    return union([bit for bit in bits if bit.volume() > _CRUMB * largest])


def _up(skeleton: Skeleton, part: int) -> Vector:
    spine = skeleton.spine(part)
    return np.array([0.0, 0.0, 1.0]) if spine is None else spine[1]
