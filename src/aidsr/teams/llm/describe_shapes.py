"""The shapes of a body in words: what each is, how large, where, how it is turned, and what touching it is like."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from aidsr.core.artifacts import GeomSummary, Vec3
from aidsr.teams.llm.arrangements import Array, Circle
from aidsr.teams.llm.numbers import at, direction, number, vector
from aidsr.teams.llm.shape_groups import Alike, alike_shapes, own_axes

__all__ = ["MUJOCO_GRIP", "Grip", "grip_words", "shape_lines"]

_SIZES = {
    "sphere": ("radius",),
    "capsule": ("radius", "half length"),
    "cylinder": ("radius", "half length"),
    "ellipsoid": ("half axes",),
    "box": ("half sizes",),
}
"""What MuJoCo's size numbers mean. Source: MuJoCo XML reference, geom size."""
_PLURALS = {"box": "boxes", "mesh": "meshes"}
_WORLD = {"x": np.array([1.0, 0.0, 0.0]), "z": np.array([0.0, 0.0, 1.0])}
_EITHER_WAY = ("box", "ellipsoid", "capsule", "cylinder")
"""Shapes that look the same from both ends of each of their axes."""
_SAME = 1e-3
"""Axes whose numbers differ by less are told as one. Our choice."""

Grip = tuple[Vec3, int]
"""Friction and priority of a shape."""
MUJOCO_GRIP: Grip = (1.0, 0.005, 0.0001), 0
"""What MuJoCo takes where a model says nothing. Source: MuJoCo XML reference, geom friction and priority."""


class _Told(NamedTuple):
    """What is told of one shape or several."""

    what: str
    """What the groups after them may be as well; empty for one shape, of which all is told as where it is."""
    names: str
    where: str


def shape_lines(geoms: Sequence[GeomSummary], usual: Grip) -> list[str]:
    """Return the shapes of a body as lines of a list; groups that differ only in place stand below one heading."""
    told = [_several(alike, usual) if alike.geoms[1:] else _one(alike.geoms[0], usual) for alike in alike_shapes(geoms)]
    lines: list[str] = []
    for what, groups in groupby(told, key=lambda group: group.what):
        names_and_places = [(group.names, group.where) for group in groups]
        if what and len(names_and_places) > 1:
            lines.append(f"- {len(names_and_places)} times {what}:")
            lines += [f"  - {names}{where}" for names, where in names_and_places]
        else:
            lines += [f"- {names}{what}{'; ' if what else ''}{where}" for names, where in names_and_places]
    return lines


def grip_words(grip: Grip) -> str:
    """Return friction and priority in words; the torsional and rolling friction only where they are not MuJoCo's."""
    (sliding, torsional, rolling), priority = grip
    usual = (torsional, rolling) == MUJOCO_GRIP[0][1:]
    shown = number(sliding) + ("" if usual else f" (torsional {number(torsional)} m, rolling {number(rolling)} m)")
    return shown + (f" at priority {priority}" if priority else "")


def _one(geom: GeomSummary, usual: Grip) -> _Told:
    where = f"{geom.shape}{_sizes([geom])}, at {vector(geom.position_m)}{_turned(geom)}{_contact(geom, usual)}"
    return _Told("", f"{geom.name}: " if geom.name else "", where)


def _several(alike: Alike, usual: Grip) -> _Told:
    first, last, circle = alike.geoms[0], alike.geoms[-1], alike.circle
    what = f"{len(alike.geoms)} {_PLURALS.get(first.shape, f'{first.shape}s')}"
    names = f"{first.name} to {last.name}: " if first.name else ""
    ends = f"from {vector(first.position_m)} to {vector(last.position_m)}"
    if circle:
        what += " evenly in a ring" if circle.closed else " evenly on an arc"
        what += f", centres {number(circle.radius_m)} from its axis"
        what += _turning(alike, circle) if alike.turning else _turned(first)
        what += _free_inside(alike, circle)
        centre = vector(round(float(value), 4) for value in circle.centre_m)
        where = f"{_sizes(alike.geoms).lstrip(', ')}, about {centre} with axis {direction(circle.axis)}, "
        where += f"the first at {vector(first.position_m)}" if circle.closed else ends
    else:
        what += f"{_sizes(alike.geoms)}{_turned(first)}" + (", evenly in a row" if alike.in_a_row else "")
        where = ends if alike.in_a_row else at([geom.position_m for geom in alike.geoms])
    return _Told(what + _contact(first, usual), names, where)


def _contact(geom: GeomSummary, usual: Grip) -> str:
    """Say what is particular about touching a shape."""
    if not geom.solid:
        return "; only drawn"
    grip = geom.friction, geom.priority
    return "" if grip == usual else f"; friction {grip_words(grip)}"


def _sizes(geoms: Sequence[GeomSummary]) -> str:
    """Return the sizes of shapes of one kind, with ranges in brackets where they are not the same."""
    columns = [(min(column), max(column)) for column in zip(*(geom.size_m for geom in geoms), strict=True)]
    values = [number(low) if low == high else f"({number(low)} to {number(high)})" for low, high in columns]
    meanings = _SIZES.get(geoms[0].shape, ())
    if len(meanings) == 1:
        return f", {meanings[0]} {' '.join(values)}"
    return "".join(f", {word} {value}" for word, value in zip(meanings, values, strict=False))


def _turned(geom: GeomSummary) -> str:
    """Say how a shape is turned, where it is."""
    said = ""
    for letter, axis in own_axes(geom).items():
        same = np.abs(axis - _WORLD[letter]).max() < _SAME
        opposite = np.abs(axis + _WORLD[letter]).max() < _SAME
        if not (same or (opposite and geom.shape in _EITHER_WAY)):
            said += f", its {letter} axis along {direction(axis)}"
    return said


def _turning(alike: Alike, circle: Circle) -> str:
    """Say how shapes are turned that turn along with their circle."""
    first = alike.geoms[0]
    out = _outwards(first, circle)
    known = {"outwards": out, "inwards": -out, "along the axis": circle.axis, "against the axis": -circle.axis}
    said = ""
    for letter, axis in own_axes(first).items():
        where = [word for word, way in known.items() if np.abs(axis - way).max() < _SAME]
        said += f", their {letter} {where[0]}" if where else f", the first's {letter} axis along {direction(axis)}"
    return said


def _outwards(geom: GeomSummary, circle: Circle) -> Array:
    return np.asarray((np.array(geom.position_m) - circle.centre_m) / circle.radius_m)


def _free_inside(alike: Alike, circle: Circle) -> str:
    """Say how wide a closed ring is inside, where it has a smooth wall or one of flat sides."""
    first = alike.geoms[0]
    x, z = np.array(first.x_axis), np.array(first.z_axis)
    half = np.max([geom.size_m for geom in alike.geoms], axis=0)
    out = _outwards(first, circle)
    if first.shape == "box" and alike.turning:
        outward = [size for size, axis in zip(half, (x, np.cross(z, x), z), strict=True) if abs(axis @ out) > 1 - _SAME]
    else:
        upright = first.shape in ("capsule", "cylinder") and abs(z @ circle.axis) > 1 - _SAME
        outward = [half[0]] if upright or first.shape == "sphere" else []
    return f", free radius inside {number(circle.radius_m - outward[0])}" if circle.closed and outward else ""
