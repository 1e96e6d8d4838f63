"""Parts joined to the pieces that are printed: limbs of an elastomer in one, plugged into a stiff root."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from aidsr.fabrication.anatomy import Vector
from aidsr.fabrication.cutting import Piece, cut_across, cut_limb
from aidsr.fabrication.hinges import Hinge, Hinges
from aidsr.fabrication.materials import Material, material_for
from aidsr.fabrication.printers import Printer
from aidsr.fabrication.skeleton import Gap, Skeleton
from aidsr.fabrication.solids import box_between, first_hits, frame_along, rounded, union

__all__ = ["single_parts", "whole_limbs"]

_BEYOND_MM = 1.0
_COLLAR_MM = 2.5
"""Thickness of the disc with which a limb sits on its root. Our choice: six layers and more."""

_PLUG_MM, _PLUG_SHARE = 8.0, 0.6
"""Length of the plug behind that disc, and its radius / the limb's: inside of where cables run. Our choice."""

_LEAST_PLUG_MM, _FLOOR_MM = 4.0, 1.2
"""Shortest plug that ends in its root, and what is left of the root behind one. Our choice: three lines."""

_CRUMB = 0.01
"""Share of a piece below which a bit that came off is waste. Our choice."""


def single_parts(
    skeleton: Skeleton, finished: dict[int, Manifold], material: Material, printer: Printer
) -> tuple[Piece, ...]:
    """Return each part as a piece of its own, cut in two where it exceeds the bed."""
    parts = skeleton.anatomy.parts
    whole = [
        Piece(parts[i].name, (i,), _without_crumbs(solid), _up(skeleton, i), material) for i, solid in finished.items()
    ]
    return tuple(half for piece in whole for half in cut_across(piece, printer))


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
    bodies = single_parts(skeleton, roots, stiff, printer)
    return (*bodies, *(half for piece in pieces for half in cut_limb(skeleton, piece, printer)))


def _plug(gap: Gap, root: Manifold, printer: Printer, drills: list[Manifold]) -> tuple[Manifold, Manifold]:
    """Return the foot of a limb, and what to take from its root for it."""
    face = gap.anchor - gap.before_mm * gap.before
    seat, reach = face - _COLLAR_MM * gap.before, max(gap.radius_mm, gap.reach_mm) + _COLLAR_MM
    radius = _PLUG_SHARE * gap.radius_mm
    end = seat - _plug_length(gap, seat, radius, root) * gap.before
    limb = rounded(seat, face, reach) + rounded(end, face, radius)
    loose = rounded(end - 0.3 * gap.before, face, radius + printer.fit_mm / 2)
    return limb - union(drills), rounded(seat, face + _BEYOND_MM * gap.before, reach) + loose


def _plug_length(gap: Gap, seat: Vector, radius: float, root: Manifold) -> float:
    """How far a plug goes into its root: so far that a sound floor is left, or right through a thin plate."""
    frame = frame_along(gap.before)
    depths = []
    for turn in np.arange(4) * np.pi / 2:
        rim = seat + radius * (np.cos(turn) * frame[:, 0] + np.sin(turn) * frame[:, 1])
        hits = first_hits(root, rim, -gap.before, _PLUG_MM + 10.0)
        depths.append(hits[0] if len(hits) % 2 else _PLUG_MM + 10.0)
    floored = min(_PLUG_MM, min(depths) - _FLOOR_MM)
    return floored if floored >= _LEAST_PLUG_MM else min(max(depths), _PLUG_MM) + _BEYOND_MM


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
