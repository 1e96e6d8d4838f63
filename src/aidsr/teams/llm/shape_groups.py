"""Groups of similar geoms of an environment with consecutive names: rings, rows, or lists of positions."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from aidsr.core.artifacts import GeomSummary
from aidsr.teams.llm.arrangements import Array, Circle, count_before_pattern, fit_circle, rotations, row_length

_TOLERANCE = 1e-3
"""Axes whose components differ by less count as equal. Our choice."""
_MAX_SIZE_RATIO = 2.0
"""Shapes of one ring may differ in size by this factor, as the walls of a bent pipe do. Our choice."""
_MIN_COUNT = 3
"""Minimum number of shapes in a list of positions; fewer are described one by one. Our choice: two lines are read as
quickly as one with two positions."""
_NUMBERED = re.compile(r"(.*?)(\d+)")
_AXES = {"sphere": "", "plane": "z", "capsule": "z", "cylinder": "z"}
"""Axes that define the orientation of a shape; x and z for shapes not listed."""


@dataclass(frozen=True)
class ShapeGroup:
    """One shape, or several of one kind with consecutive names."""

    geoms: tuple[GeomSummary, ...]
    circle: Circle | None = None
    is_row: bool = False

    @property
    def rotates(self) -> bool:
        """Whether the orientations of the shapes differ, as around a circle."""
        return not all(_same_orientation(self.geoms[0], geom) for geom in self.geoms)


def is_next_name(name: str, other: str) -> bool:
    """Whether the second name follows the first, as post_2 follows post_1; an empty name follows an empty one."""
    one, two = _NUMBERED.fullmatch(name), _NUMBERED.fullmatch(other)
    if one is None or two is None:
        return name == other == ""
    return other == one[1] + str(int(one[2]) + 1).zfill(len(one[2]))


def orientation_axes(geom: GeomSummary) -> dict[str, Array]:
    """Return the axes that define the orientation of a shape, by axis letter, in world coordinates."""
    known = {"x": np.array(geom.x_axis), "z": np.array(geom.z_axis)}
    return {letter: known[letter] for letter in _AXES.get(geom.shape, "xz")}


def group_shapes(geoms: Sequence[GeomSummary]) -> Iterator[ShapeGroup]:
    """Yield shapes in order, grouped where they are of one kind, have consecutive names and form a pattern."""
    for kind in _runs(geoms, _same_kind):
        while kind:
            found = _ring(kind) or _row(kind) or _ungrouped(kind)
            yield from found
            kind = kind[sum(len(group.geoms) for group in found) :]


def positions(geoms: Sequence[GeomSummary]) -> Array:
    """Return the positions of shapes, (n, 3) [m]."""
    return np.array([geom.position_m for geom in geoms])


def _runs(
    geoms: Sequence[GeomSummary], matches: Callable[[GeomSummary, GeomSummary], bool]
) -> Iterator[tuple[GeomSummary, ...]]:
    """Yield runs of shapes, in order; the shapes of a run have consecutive names, and each matches the first one."""
    start = 0
    for end in range(1, len(geoms) + 1):
        if end == len(geoms) or not (
            is_next_name(geoms[end - 1].name, geoms[end].name) and matches(geoms[start], geoms[end])
        ):
            yield tuple(geoms[start:end])
            start = end


def _same_kind(one: GeomSummary, other: GeomSummary) -> bool:
    return all(getattr(one, field) == getattr(other, field) for field in ("shape", "solid", "friction", "priority"))


def _same_orientation(one: GeomSummary, other: GeomSummary) -> bool:
    axes = orientation_axes(other)
    return all(np.abs(axis - axes[letter]).max() < _TOLERANCE for letter, axis in orientation_axes(one).items())


def _is_copy(one: GeomSummary, other: GeomSummary) -> bool:
    return one.size_m == other.size_m and _same_orientation(one, other)


def _ring(kind: Sequence[GeomSummary]) -> list[ShapeGroup]:
    """Return the first shapes as one group if they are evenly spaced on a circle; else an empty list."""
    found = fit_circle(positions(kind))
    if found is None:
        return []
    ring = ShapeGroup(tuple(kind[: found.count]), circle=found)
    sizes = np.array([geom.size_m for geom in ring.geoms])
    even = (sizes.max(axis=0) <= _MAX_SIZE_RATIO * sizes.min(axis=0)).all()
    return [ring] if even and (not ring.rotates or _rotates_along(ring, found)) else []


def _rotates_along(ring: ShapeGroup, on: Circle) -> bool:
    return all(
        np.abs(
            rotations(axis, on.axis, on.step_rad, on.count) - [orientation_axes(geom)[letter] for geom in ring.geoms]
        ).max()
        < _TOLERANCE
        for letter, axis in orientation_axes(ring.geoms[0]).items()
    )


def _row(kind: Sequence[GeomSummary]) -> list[ShapeGroup]:
    """Return the first shapes as one group if they are copies in a straight row; else an empty list."""
    copies = next(_runs(kind, _is_copy))
    count = row_length(positions(copies))
    return [ShapeGroup(copies[:count], is_row=True)] if count else []


def _ungrouped(kind: Sequence[GeomSummary]) -> list[ShapeGroup]:
    """Return the first copies up to the next pattern: as one group if there are enough, else each as its own group."""
    copies = next(_runs(kind, _is_copy))
    copies = copies[: count_before_pattern(positions(copies))]
    return [ShapeGroup(copies)] if len(copies) >= _MIN_COUNT else [ShapeGroup((geom,)) for geom in copies]
