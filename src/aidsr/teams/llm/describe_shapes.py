"""The shapes of a body in words: type, size, position, orientation and contact parameters."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from aidsr.core.artifacts import GeomSummary, Vec3
from aidsr.core.formatting import format_coordinate, format_direction, format_vector
from aidsr.teams.llm.arrangements import Array, Circle, format_positions
from aidsr.teams.llm.shape_groups import ShapeGroup, group_shapes, orientation_axes

_SIZES = {
    "sphere": ("radius",),
    "capsule": ("radius", "half length"),
    "cylinder": ("radius", "half length"),
    "ellipsoid": ("half axes",),
    "box": ("half sizes",),
}
"""Meaning of MuJoCo's size numbers for each shape. Source: MuJoCo XML reference, geom size."""
_PLURALS = {"box": "boxes", "mesh": "meshes"}
_WORLD = {"x": np.array([1.0, 0.0, 0.0]), "z": np.array([0.0, 0.0, 1.0])}
_SYMMETRIC = ("box", "ellipsoid", "capsule", "cylinder")
"""Shapes that are symmetric about the planes of their axes."""
_TOLERANCE = 1e-3
"""Axes whose components differ by less are described as equal. Our choice."""

Friction = tuple[Vec3, int]
"""Sliding, torsional and rolling friction of a shape, and its priority."""
MUJOCO_FRICTION: Friction = (1.0, 0.005, 0.0001), 0
"""MuJoCo's defaults. Source: MuJoCo XML reference, geom friction and priority."""


class _Description(NamedTuple):
    """Description of a shape or a group.

    Attributes:
        what: The part that can be equal for several groups; empty for a single shape, which `where` describes.
        names: First and last name of the shapes and a colon; empty if they have no names.
        where: The position.
    """

    what: str
    names: str
    where: str


def describe_shapes(geoms: Sequence[GeomSummary], usual: Friction) -> list[str]:
    """Return the shapes of a body as lines of a list; groups that differ only in position share a heading."""
    descriptions = [
        _describe_group(group, usual) if group.geoms[1:] else _describe_one(group.geoms[0], usual)
        for group in group_shapes(geoms)
    ]
    lines: list[str] = []
    for what, groups in groupby(descriptions, key=lambda group: group.what):
        names_and_places = [(group.names, group.where) for group in groups]
        if what and len(names_and_places) > 1:
            lines.append(f"- {len(names_and_places)} times {what}:")
            lines += [f"  - {names}{where}" for names, where in names_and_places]
        else:
            lines += [f"- {names}{what}{'; ' if what else ''}{where}" for names, where in names_and_places]
    return lines


def format_friction(friction: Friction) -> str:
    """Return friction and priority in words; torsional and rolling friction only if they are not the defaults."""
    (sliding, torsional, rolling), priority = friction
    usual = (torsional, rolling) == MUJOCO_FRICTION[0][1:]
    shown = format_coordinate(sliding) + (
        "" if usual else f" (torsional {format_coordinate(torsional)} m, rolling {format_coordinate(rolling)} m)"
    )
    return shown + (f" at priority {priority}" if priority else "")


def _describe_one(geom: GeomSummary, usual: Friction) -> _Description:
    where = f"{geom.shape}{_format_sizes([geom])}, at {format_vector(geom.position_m)}{_describe_orientation(geom)}"
    return _Description("", f"{geom.name}: " if geom.name else "", where + _describe_contact(geom, usual))


def _describe_group(group: ShapeGroup, usual: Friction) -> _Description:
    first, last, circle = group.geoms[0], group.geoms[-1], group.circle
    what = f"{len(group.geoms)} {_PLURALS.get(first.shape, f'{first.shape}s')}"
    names = f"{first.name} to {last.name}: " if first.name else ""
    ends = f"from {format_vector(first.position_m)} to {format_vector(last.position_m)}"
    if circle:
        what += " evenly in a ring" if circle.closed else " evenly on an arc"
        what += f", centres {format_coordinate(circle.radius_m)} from its axis"
        what += _describe_rotation(group, circle) if group.rotates else _describe_orientation(first)
        what += _free_radius(group, circle)
        centre = format_vector(round(float(value), 4) for value in circle.centre_m)
        where = f"{_format_sizes(group.geoms).lstrip(', ')}, about {centre} with axis {format_direction(circle.axis)}, "
        where += f"the first at {format_vector(first.position_m)}" if circle.closed else ends
    else:
        what += f"{_format_sizes(group.geoms)}{_describe_orientation(first)}" + (
            ", evenly in a row" if group.is_row else ""
        )
        where = ends if group.is_row else format_positions([geom.position_m for geom in group.geoms])
    return _Description(what + _describe_contact(first, usual), names, where)


def _describe_contact(geom: GeomSummary, usual: Friction) -> str:
    """Describe the contact parameters of a shape if they are not the usual ones."""
    if not geom.solid:
        return "; only drawn"
    friction = geom.friction, geom.priority
    return "" if friction == usual else f"; friction {format_friction(friction)}"


def _format_sizes(geoms: Sequence[GeomSummary]) -> str:
    """Return the sizes of shapes of one kind, with ranges in brackets where they differ."""
    columns = [(min(column), max(column)) for column in zip(*(geom.size_m for geom in geoms), strict=True)]
    values = [
        format_coordinate(low) if low == high else f"({format_coordinate(low)} to {format_coordinate(high)})"
        for low, high in columns
    ]
    meanings = _SIZES.get(geoms[0].shape, ())
    if len(meanings) == 1:
        return f", {meanings[0]} {' '.join(values)}"
    return "".join(f", {word} {value}" for word, value in zip(meanings, values, strict=False))


def _describe_orientation(geom: GeomSummary) -> str:
    """Describe the orientation of a shape if its axes are not those of the world."""
    text = ""
    for letter, axis in orientation_axes(geom).items():
        same = np.abs(axis - _WORLD[letter]).max() < _TOLERANCE
        opposite = np.abs(axis + _WORLD[letter]).max() < _TOLERANCE
        if not (same or (opposite and geom.shape in _SYMMETRIC)):
            text += f", its {letter} axis along {format_direction(axis)}"
    return text


def _describe_rotation(group: ShapeGroup, circle: Circle) -> str:
    """Describe the orientation of shapes whose axes rotate with their positions around a circle."""
    first = group.geoms[0]
    out = _radial_direction(first, circle)
    known = {"outwards": out, "inwards": -out, "along the axis": circle.axis, "against the axis": -circle.axis}
    text = ""
    for letter, axis in orientation_axes(first).items():
        where = [word for word, way in known.items() if np.abs(axis - way).max() < _TOLERANCE]
        text += (
            f", their {letter} {where[0]}" if where else f", the first's {letter} axis along {format_direction(axis)}"
        )
    return text


def _radial_direction(geom: GeomSummary, circle: Circle) -> Array:
    return np.asarray((np.array(geom.position_m) - circle.centre_m) / circle.radius_m)


def _free_radius(group: ShapeGroup, circle: Circle) -> str:
    """Describe the free radius inside a closed ring whose shapes turn round or flat sides inwards; else return ""."""
    first = group.geoms[0]
    x, z = np.array(first.x_axis), np.array(first.z_axis)
    half = np.max([geom.size_m for geom in group.geoms], axis=0)
    out = _radial_direction(first, circle)
    if first.shape == "box" and group.rotates:
        outward = [
            size for size, axis in zip(half, (x, np.cross(z, x), z), strict=True) if abs(axis @ out) > 1 - _TOLERANCE
        ]
    else:
        upright = first.shape in ("capsule", "cylinder") and abs(z @ circle.axis) > 1 - _TOLERANCE
        outward = [half[0]] if upright or first.shape == "sphere" else []
    return (
        f", free radius inside {format_coordinate(circle.radius_m - outward[0])}" if circle.closed and outward else ""
    )
