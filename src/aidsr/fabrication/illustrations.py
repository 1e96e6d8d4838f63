"""Pictures of the assembly sheet: an exploded view of the robot, a winch, and the positions of the cables."""

from __future__ import annotations

import base64
import math
from collections.abc import Iterator

import numpy as np
from markupsafe import Markup, escape

from aidsr.fabrication.anatomy import Vector
from aidsr.fabrication.build import RobotBuild
from aidsr.fabrication.cut_parts import Piece
from aidsr.fabrication.draw_solids import Coloured, View, draw, view_of
from aidsr.fabrication.solids import rounded, triangles
from aidsr.fabrication.stations import seat_of, spool, station

_APART = 0.55
"""Displacement of a piece in the exploded view / its distance from the root. Our choice: pieces no longer overlap."""

_COARSE_MM = 0.15
"""Size below which detail is left out of pictures."""

_COLOURS = ((0.80, 0.84, 0.89), (0.49, 0.64, 0.76), (0.96, 0.72, 0.42), (0.62, 0.77, 0.62))
_ROD_COLOUR = (0.35, 0.35, 0.38)
_SIZE = (860, 620)
_CABLE_COLOURS = ("#c0392b", "#2471a3", "#1e8449", "#b9770e", "#7d3c98", "#117a65", "#a04000", "#566573")


def exploded(build: RobotBuild) -> Markup:
    """Return an exploded view of the robot, with each piece labelled by the letter of its file."""
    pieces, root = build.shaping.pieces, _middle(build.shaping.pieces[0])
    letters = {name: chr(65 + n % 26) for n, part in enumerate(build.robot_parts) for name in part.used_for}
    kinds = {name: n for n, part in enumerate(build.robot_parts) for name in part.used_for}
    shifts = [_APART * (_middle(piece) - root) for piece in pieces]
    items = [
        Coloured(triangles(piece.solid.simplify(_COARSE_MM)), _COLOURS[kinds[piece.name] % len(_COLOURS)], shift)
        for piece, shift in zip(pieces, shifts, strict=True)
    ]
    for rod in build.shaping.rods:
        diameter = build.hinges.backbones[rod.backbone].diameter_mm
        along = (rod.end - rod.begin) * (1 + _APART)
        aside = (
            1.6 * build.skeleton.gaps[build.hinges.backbones[rod.backbone].joints[0]].reach_mm * np.array([1.0, 0, 0])
        )
        begin = root + (1 + _APART) * (rod.begin - root) + aside
        items.append(Coloured(triangles(rounded(begin, begin + along, diameter / 2)), _ROD_COLOUR, np.zeros(3)))
    view = _view(items)
    centres = [_middle(piece) + shift for piece, shift in zip(pieces, shifts, strict=True)]
    return _labelled(draw(items, view), view, list(zip(centres, [letters[p.name] for p in pieces], strict=True)))


def winch_picture(build: RobotBuild) -> Markup:
    """Return a picture of one winch: its station, and the spool in front of the shaft."""
    first = next((winch for winch in build.winches if winch.fit is not None), None)
    if first is None or first.fit is None:
        return Markup("")
    seat = seat_of(first.fit.motor)
    stand = station(seat, first.drum, first.sheath, build.printer)
    _, _, _, _, wide, high = stand.bounding_box()
    drum = spool(seat, first.drum, build.printer).rotate((-90, 0, 0)).translate((0, wide + 12, high / 2))
    items = [
        Coloured(triangles(stand.simplify(_COARSE_MM)), _COLOURS[0], np.zeros(3)),
        Coloured(triangles(drum.simplify(_COARSE_MM)), _COLOURS[2], np.zeros(3)),
    ]
    points = np.vstack([item.surface.points for item in items])
    view = view_of(points, (520, 340), up=np.array([0.0, 0, 1]), towards=np.array([0.8, 0.9, 0.8]))
    labels = [(np.array([0, wide + 12.0, high * 0.5 - first.drum.radius_mm - 10.0]), "spool")]
    return _labelled(draw(items, view), view, labels, "picture narrow")


def routing(build: RobotBuild) -> Markup:
    """Return a view of each limb from its tip, with its cables where they leave the root, one colour for each cable."""
    return Markup("").join(_limb_end(build, limb) for limb in build.skeleton.limbs)


def _limb_end(build: RobotBuild, limb: tuple[int, ...]) -> Markup:
    gap = build.skeleton.gaps[limb[0]]
    members = {build.anatomy.joints[index].child for index in limb}
    cables = [n for n, cable in enumerate(build.anatomy.cables) if any(guide.part in members for guide in cable.guides)]
    side = _sideways(gap.after)
    across = np.cross(gap.after, side)
    drawn = []
    for number in cables:
        guide = next(g for g in build.anatomy.cables[number].guides if g.part in members)
        anchors = [build.skeleton.gaps[j] for j in limb if build.anatomy.joints[j].child == guide.part]
        away = np.array(guide.position_mm) - anchors[0].anchor
        drawn.append((number, float(away @ side), float(away @ across)))
    reach = max([gap.radius_mm, *(math.hypot(x, y) for _, x, y in drawn)]) + 3.0
    scale = 80.0 / reach
    shapes = [f'<circle cx="150" cy="105" r="{gap.radius_mm * scale:.1f}" class="limb"/>']
    for number, x, y in drawn:
        colour = _CABLE_COLOURS[number % len(_CABLE_COLOURS)]
        px, py = 150 + scale * x, 105 - scale * y
        shapes.append(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="5" fill="{colour}"/>')
        anchor = "start" if px >= 150 else "end"
        name = escape(build.anatomy.cables[number].actuator or build.anatomy.cables[number].tendon)
        shift = 9 if px >= 150 else -9
        shapes.append(
            f'<text x="{px + shift:.1f}" y="{py + 4:.1f}" text-anchor="{anchor}" fill="{colour}">{name}</text>'
        )
    name = escape(build.anatomy.parts[build.anatomy.joints[limb[0]].child].name)
    title = f'<text x="150" y="206" text-anchor="middle">limb that begins with {name}</text>'
    return Markup(f'<svg viewBox="-40 0 380 212" class="routing">{"".join(shapes)}{title}</svg>')


def _sideways(axis: Vector) -> Vector:
    """Return a direction perpendicular to a limb, the same one for the same limb direction."""
    from aidsr.fabrication.solids import frame_along

    return np.asarray(frame_along(axis)[:, 0])


def _middle(piece: Piece) -> Vector:
    x0, y0, z0, x1, y1, z1 = piece.solid.bounding_box()
    return np.array([x0 + x1, y0 + y1, z0 + z1]) / 2


def _view(items: list[Coloured]) -> View:
    points = np.vstack([item.surface.points + item.shift for item in items])
    extent = np.ptp(points, axis=0)
    if extent[2] > 1.4 * max(extent[0], extent[1]):  # a tall robot is drawn lying, to use the width of the page
        return view_of(points, _SIZE, up=np.array([-1.0, 0.25, 0.0]), towards=np.array([0.25, -1.0, 0.45]))
    return view_of(points, _SIZE, up=np.array([0.0, 0, 1]), towards=np.array([1.0, -1.3, 0.7]))


def _labelled(png: bytes, view: View, labels: list[tuple[Vector, str]], style: str = "picture") -> Markup:
    """Return a picture with text labels at the projections of 3D points."""
    width, height = view.size
    data = base64.b64encode(png).decode()
    marks = "".join(_marks(view, labels))
    image = f'<image href="data:image/png;base64,{data}" width="{width}" height="{height}"/>'
    return Markup(f'<svg viewBox="0 0 {width} {height}" class="{style}">{image}{marks}</svg>')


def _marks(view: View, labels: list[tuple[Vector, str]]) -> Iterator[str]:
    for point, text in labels:
        x, y, _ = view.project(point)[0]
        if len(text) == 1:
            yield f'<circle cx="{x:.0f}" cy="{y:.0f}" r="9" class="tag"/>'
            yield f'<text x="{x:.0f}" y="{y + 4:.0f}" text-anchor="middle" class="tagged">{escape(text)}</text>'
        else:
            yield f'<text x="{x:.0f}" y="{y:.0f}" text-anchor="middle" class="label">{escape(text)}</text>'
