"""Combination of parts into printed pieces: single parts, or whole elastomer limbs plugged into their parent part."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from aidsr.fabrication.anatomy import Vector
from aidsr.fabrication.cut_parts import Piece, cut_across, cut_limb
from aidsr.fabrication.hinges import Hinge, Hinges
from aidsr.fabrication.materials import Material, material_for
from aidsr.fabrication.printers import Printer
from aidsr.fabrication.skeleton import Gap, Skeleton
from aidsr.fabrication.solids import box_between, first_hits, frame_along, rounded, union

_BEYOND_MM = 1.0
_COLLAR_MM = 2.5
"""Thickness of the collar with which a limb sits on its parent part, and its extra radius. Our choice: at least six
layers."""

_PLUG_MM, _PLUG_SHARE = 8.0, 0.6
"""Length of the plug behind the collar, and its radius / the limb's: closer to the axis than the cables. Our choice."""

_LEAST_PLUG_MM, _FLOOR_MM = 4.0, 1.2
"""Shortest plug that ends inside its parent part, and smallest wall behind it. Our choice: three printed lines."""

_CRUMB = 0.01
"""Volume / that of the largest fragment, below which a separate fragment of a piece is discarded. Our choice."""


def single_parts(
    skeleton: Skeleton, finished: dict[int, Manifold], material: Material, printer: Printer
) -> tuple[Piece, ...]:
    """Return each part as a separate piece, or as slices where it exceeds the bed."""
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
    """Return each limb as one piece with necks as joints, and each root as a separate piece.

    Pieces that exceed the bed are returned as slices. A limb has a plug at its beginning; its parent part, in a root or
    in another limb, has the socket.

    Args:
        skeleton: Gaps and limbs of the robot.
        hinges: Hinges of the robot, all of which are necks.
        finished: Solid of each part with its holes, by the part's index.
        drills: Holes of each part, by the part's index; they are cut from the necks too.
        material: Elastomer for the limbs.
        printer: Printer; the first of its plastics that is no elastomer is used for the roots.
    """
    anatomy = skeleton.anatomy
    stiff = next((one for one in material_for(printer, None) if not one.elastomer), material)
    children = {joint.child for joint in anatomy.joints}
    grown = {limb: tuple(anatomy.joints[index].child for index in limb) for limb in skeleton.limbs}
    parts, feet = dict(finished), dict.fromkeys(grown, Manifold())
    for limb, members in grown.items():
        parent = anatomy.joints[limb[0]].parent
        # the parent of a ring's first joint is in the ring itself; a limb attached to the world has no parent part
        if parent in parts and parent not in members:
            feet[limb], socket = _plug(skeleton.gaps[limb[0]], parts[parent], printer, drills[parent])
            parts[parent] -= socket
    pieces = []
    for limb, members in grown.items():
        necks = [_cleared_neck(skeleton, hinges.hinges[index], drills) for index in limb if index in hinges.hinges]
        solid = union([*(parts[part] for part in members), *necks, feet[limb]])
        name, up = anatomy.parts[members[0]].name, skeleton.gaps[limb[0]].after
        pieces.append(Piece(name, members, solid, up, material, necks=union(necks)))
    roots = {part: solid for part, solid in parts.items() if part not in children}
    bodies = single_parts(skeleton, roots, stiff, printer)
    return (*bodies, *(half for piece in pieces for half in cut_limb(skeleton, piece, printer)))


def _plug(gap: Gap, holder: Manifold, printer: Printer, drills: list[Manifold]) -> tuple[Manifold, Manifold]:
    """Return the collar and plug at the beginning of a limb, and the socket to cut from its parent part."""
    face = gap.anchor - gap.before_mm * gap.before
    seat, reach = face - _COLLAR_MM * gap.before, max(gap.radius_mm, gap.reach_mm) + _COLLAR_MM
    radius = _PLUG_SHARE * gap.radius_mm
    end = seat - _plug_length(gap, seat, radius, holder) * gap.before
    limb = rounded(seat, face, reach) + rounded(end, face, radius)
    loose = rounded(end - 0.3 * gap.before, face, radius + printer.fit_mm / 2)
    return limb - union(drills), rounded(seat, face + _BEYOND_MM * gap.before, reach) + loose


def _plug_length(gap: Gap, seat: Vector, radius: float, holder: Manifold) -> float:
    """Return the length of a plug: as long as leaves a floor of `_FLOOR_MM`, or right through a thin plate [mm]."""
    frame = frame_along(gap.before)
    depths = []
    for turn in np.arange(4) * np.pi / 2:
        rim = seat + radius * (np.cos(turn) * frame[:, 0] + np.sin(turn) * frame[:, 1])
        hits = first_hits(holder, rim, -gap.before, _PLUG_MM + 10.0)
        depths.append(hits[0] if len(hits) % 2 else _PLUG_MM + 10.0)
    floored = min(_PLUG_MM, min(depths) - _FLOOR_MM)
    return floored if floored >= _LEAST_PLUG_MM else min(max(depths), _PLUG_MM) + _BEYOND_MM


def _cleared_neck(skeleton: Skeleton, hinge: Hinge, drills: dict[int, list[Manifold]]) -> Manifold:
    joint = skeleton.anatomy.joints[hinge.joint]
    beside = union([*drills[joint.parent], *drills[joint.child]])
    return _neck(skeleton.gaps[hinge.joint], hinge, joint.axes[0]) - beside


def _neck(gap: Gap, hinge: Hinge, axis: tuple[float, float, float]) -> Manifold:
    """Return the solid of the printed neck across a gap."""
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
    """Return a solid without small separate fragments, which cutting the gaps can leave."""
    bits = solid.decompose()
    largest = max((bit.volume() for bit in bits), default=0.0)
    return union([bit for bit in bits if bit.volume() > _CRUMB * largest])


def _up(skeleton: Skeleton, part: int) -> Vector:
    spine = skeleton.spine(part)
    return np.array([0.0, 0.0, 1.0]) if spine is None else spine[1]
