"""Conversion of an anatomy into pieces to print: join shapes, cut gaps, add walls around cables, cut holes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from manifold3d import Manifold

from aidsr.fabrication.anatomy import Anatomy, Vector
from aidsr.fabrication.cut_parts import Piece, distinct
from aidsr.fabrication.hinges import Backbone, Hinges
from aidsr.fabrication.join_parts import single_parts, whole_limbs
from aidsr.fabrication.materials import Material
from aidsr.fabrication.printers import Printer
from aidsr.fabrication.routing import Bore, Duct, ducts_of
from aidsr.fabrication.skeleton import Gap, Skeleton
from aidsr.fabrication.solids import M4_HOLE_MM, frame_along, placed, rounded, solid_of, union

_UP = np.array([0.0, 0.0, 1.0])
_BEYOND_MM = 1.0
_INTO_SKIN_MM = 1.5
"""Depth by which the foot of a wall around a cable extends below the limb's surface, so that they join. Our choice."""

_FLANGE_MM = (10.0, 4.0)
"""Radius of the flange minus that of the robot's foot, and thickness of the flange. Our choice: room for M4 screws and
washers."""

FLANGE_SCREWS = 4
"""Number of screws of the flange."""

_EMBEDDED_MM = 10.0
"""Depth to which rods are glued into the parts at their ends. Our choice: five to ten rod diameters."""

_CAP_MM = 1.5
"""Thickness of the last part's material beyond the end of a rod."""


@dataclass(frozen=True)
class RodPiece:
    """One rod to cut, with its end points in the robot at rest [mm]."""

    backbone: int
    """Index of its backbone in `Hinges.backbones`."""
    begin: Vector
    end: Vector

    @property
    def length_mm(self) -> float:
        """Length of the rod."""
        return float(np.linalg.norm(self.end - self.begin))


@dataclass(frozen=True)
class Shaping:
    """The printed pieces of a robot, the rods in them, and the cables' ducts."""

    pieces: tuple[Piece, ...]
    rods: tuple[RodPiece, ...]
    ducts: tuple[Duct, ...]
    flange_mm: float
    """Radius of the flange with which the robot is screwed down; 0 for a robot with a free base."""


def shape(
    anatomy: Anatomy, skeleton: Skeleton, hinges: Hinges, bores: tuple[Bore, ...], material: Material, printer: Printer
) -> Shaping:
    """Return the pieces of a robot.

    Args:
        anatomy: The robot.
        skeleton: Gaps and limbs of the robot.
        hinges: Hinge of each joint.
        bores: Radii of the holes for each cable.
        material: Material of the pieces; with an elastomer, roots get the printer's first stiff plastic.
        printer: Printer, for its clearances and bed.
    """
    bodies = {index: union([solid_of(s) for s in part.shapes]) for index, part in enumerate(anatomy.parts)}
    ducts = ducts_of(anatomy, skeleton, bodies)
    solids, flange_mm = dict(bodies), 0.0
    for index, body in bodies.items():
        own = [duct for duct in ducts if duct.part == index]
        walls = [_wall(duct, bores[duct.cable], skeleton) for duct in own]
        solids[index] = union([body, *walls]) - union(_cuts(anatomy, skeleton, ducts, bores, index))
    for index, part in enumerate(anatomy.parts):
        if part.held:
            solids[index], flange_mm = _with_flange(solids[index], bodies[index], skeleton, index)
    drills: dict[int, list[Manifold]] = {index: [] for index in solids}
    for duct in ducts:
        drills[duct.part].extend(duct.drills(bores[duct.cable]))
    rods = tuple(rod for number, one in enumerate(hinges.backbones) for rod in _rods(anatomy, skeleton, one, number))
    for number, backbone in enumerate(hinges.backbones):
        _seat_rods(
            anatomy, skeleton, hinges, backbone, [r for r in rods if r.backbone == number], solids, drills, printer
        )
    finished = {index: solid - union(drills[index]) for index, solid in solids.items()}
    if material.elastomer:
        pieces = whole_limbs(skeleton, hinges, finished, drills, material, printer)
    else:
        pieces = single_parts(skeleton, finished, material, printer)
    names = distinct(piece.name for piece in pieces)
    named = tuple(replace(piece, name=name) for piece, name in zip(pieces, names, strict=True))
    return Shaping(named, rods, ducts, flange_mm)


def _wall(duct: Duct, bore: Bore, skeleton: Skeleton) -> Manifold:
    """Return the wall around a duct, with a foot that joins it to the limb."""
    radius = bore.wall_radius(duct)
    own = rounded(duct.begin, duct.end, radius)
    spine = skeleton.spine(duct.part)
    if spine is None:
        return own
    gap = min(skeleton.gaps, key=lambda one: float(np.linalg.norm(one.anchor - duct.path[0])))
    point, axis = gap.anchor, gap.before if skeleton.anatomy.joints[gap.joint].parent == duct.part else gap.after
    away = duct.path[0] - point
    away = away - (away @ axis) * axis
    offset = float(np.linalg.norm(away))
    inward = offset - max(0.0, gap.radius_mm - _INTO_SKIN_MM)
    if offset < 1e-6 or inward <= 0:
        return own
    shift = -away / offset * inward
    foot = rounded(duct.begin + shift, duct.end + shift, min(radius, max(0.5, offset - inward)))
    return Manifold.batch_hull([own, foot])


def _reach(gap: Gap, ducts: tuple[Duct, ...], bores: tuple[Bore, ...]) -> float:
    """Return the radius within which material is cut away at a gap [mm]."""
    walls = [bores[duct.cable].wall_radius(duct) for duct in ducts]
    return max(gap.radius_mm, gap.reach_mm + max(walls, default=0.0)) + _BEYOND_MM


def _cuts(
    anatomy: Anatomy, skeleton: Skeleton, ducts: tuple[Duct, ...], bores: tuple[Bore, ...], part: int
) -> list[Manifold]:
    """Return the solids to cut from a part so that it ends at its gaps."""
    cuts = []
    for gap in skeleton.gaps:
        joint = anatomy.joints[gap.joint]
        if part not in (joint.parent, joint.child):
            continue
        reach = _reach(gap, ducts, bores)
        if part == joint.parent:
            face, outward = gap.anchor - gap.before_mm * gap.before, gap.before
            depth = gap.before_mm + reach
        else:
            face, outward = gap.anchor + gap.after_mm * gap.after, -gap.after
            depth = gap.after_mm + reach
        cuts.append(rounded(face, face + depth * outward, reach))
    return cuts


def _with_flange(solid: Manifold, body: Manifold, skeleton: Skeleton, part: int) -> tuple[Manifold, float]:
    """Add a flange with screw holes under a part that is fixed to the world; return the solid and the flange's radius.

    The flange is perpendicular to the mean direction of the part's limbs or to the part's own z axis, whichever gives
    the narrower foot: a limb may leave a post sideways.
    """
    out = [gap.before for gap in skeleton.gaps if skeleton.anatomy.joints[gap.joint].parent == part]
    own = np.array(skeleton.anatomy.parts[part].rotation).reshape(3, 3)[:, 2]
    feet = [_foot(body, np.asarray(up)) for up in ([np.mean(out, axis=0)] if out else []) + [own]]
    turn, middle, radius = min(feet, key=lambda foot: round(foot[2], 3))
    wider, thick = _FLANGE_MM
    flange = rounded(middle, middle + thick * _UP, radius + wider)
    for angle in np.arange(FLANGE_SCREWS) * 2 * np.pi / FLANGE_SCREWS + np.pi / FLANGE_SCREWS:
        at = middle + (radius + wider / 2) * np.array([np.cos(angle), np.sin(angle), 0.0])
        flange -= rounded(at - _UP, at + (thick + 1) * _UP, M4_HOLE_MM / 2)
    return solid + placed(flange, np.zeros(3), turn), radius + wider


def _foot(body: Manifold, up: Vector) -> tuple[Vector, Vector, float]:
    """Return the foot of a body that stands with a direction upwards.

    Args:
        body: Solid of the body.
        up: Upward direction (3,).

    Returns:
        Rotation matrix (3, 3) of a frame with z along `up`, and in this frame the centre (3,) and the radius of the
        foot [mm].
    """
    turn = frame_along(up)
    standing = placed(body, np.zeros(3), turn.T)
    x0, y0, z0, x1, y1, _ = standing.bounding_box()
    section = standing.slice(z0 + 0.5)
    foot = section.bounds() if section.area() > 0 else (x0, y0, x1, y1)
    middle = np.array([(foot[0] + foot[2]) / 2, (foot[1] + foot[3]) / 2, z0])
    return turn, middle, float(max(foot[2] - foot[0], foot[3] - foot[1])) / 2


def _rods(anatomy: Anatomy, skeleton: Skeleton, backbone: Backbone, number: int) -> list[RodPiece]:
    """Return the rods of a backbone, which begin inside the parent of its first joint and end inside its last part."""
    first, last = skeleton.gaps[backbone.joints[0]], skeleton.gaps[backbone.joints[-1]]
    tip = union([solid_of(s) for s in anatomy.parts[anatomy.joints[last.joint].child].shapes])
    hits = [float(hit.distance) * 100 for hit in tip.ray_cast(last.anchor, last.anchor + 100 * last.after)]
    onward = min(last.after_mm + _EMBEDDED_MM, max([*hits, last.after_mm + 3 * _CAP_MM]) - _CAP_MM)
    begin, end = first.anchor - (first.before_mm + _EMBEDDED_MM) * first.before, last.anchor + onward * last.after
    joint, hinge_width = anatomy.joints[first.joint], min(skeleton.gaps[j].radius_mm for j in backbone.joints)
    side = np.array(joint.axes[0]) * hinge_width / 2 if backbone.count == 2 else np.zeros(3)
    return [RodPiece(number, begin + s * side, end + s * side) for s in ((1, -1) if backbone.count == 2 else (0,))]


def _seat_rods(
    anatomy: Anatomy,
    skeleton: Skeleton,
    hinges: Hinges,
    backbone: Backbone,
    rods: list[RodPiece],
    solids: dict[int, Manifold],
    drills: dict[int, list[Manifold]],
    printer: Printer,
) -> None:
    """Add the rods' holes to `drills`, and set the free length of each hinge.

    Where a hinge's free length is shorter than the gap, collars are added to `solids`; where it is longer, wider holes
    are added to `drills`.
    """
    radius = (backbone.diameter_mm + printer.fit_mm) / 2
    parts = {p for j in backbone.joints for p in (anatomy.joints[j].parent, anatomy.joints[j].child)}
    for part in parts:
        drills[part].extend(rounded(rod.begin, rod.end, radius) for rod in rods)
    for index in backbone.joints:
        gap, hinge, joint = skeleton.gaps[index], hinges.hinges[index], anatomy.joints[index]
        for part, half, away in ((joint.parent, gap.before_mm, -gap.before), (joint.child, gap.after_mm, gap.after)):
            for rod in rods:
                along = (gap.anchor - rod.begin) @ gap.before
                centre = rod.begin + along * gap.before
                face, clamp = centre + half * away, centre + hinge.free_mm / 2 * away
                if hinge.free_mm / 2 < half - 0.05:
                    collar = radius + max(1.2, printer.wall_mm)
                    solids[part] += rounded(clamp, face + _BEYOND_MM * away, collar, collar + half / 2)
                elif hinge.free_mm / 2 > half + 0.05:
                    room = radius + 0.3 + np.tan(gap.bend_rad / 2) * (hinge.free_mm / 2 - half) / 2
                    drills[part].append(rounded(clamp, face - _BEYOND_MM * away, radius, room))
