"""Shapes of an environment that are alike and follow each other, taken together: rings, rows, or place by place."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from aidsr.core.artifacts import GeomSummary
from aidsr.teams.llm.arrangements import Array, Circle, before_a_pattern, circle, row_length, turned

__all__ = ["Alike", "alike_shapes", "follow", "own_axes", "place"]

_CLOSE = 1e-3
"""Axes whose numbers differ by less point the same way, to the eye of a reader. Our choice."""
_MOST_UNEVEN = 2.0
"""Shapes of one ring may differ in size by this factor, as the walls of a bent pipe do. Our choice."""
_FEWEST = 3
"""Fewer are told one by one. Our choice: two lines are read as quickly as one with two places."""
_NUMBERED = re.compile(r"(.*?)(\d+)")
_AXES = {"sphere": "", "plane": "z", "capsule": "z", "cylinder": "z"}
"""The axes that say how a shape is turned; of the others x and z."""


@dataclass(frozen=True)
class Alike:
    """One shape, or several of one kind that follow each other."""

    geoms: tuple[GeomSummary, ...]
    circle: Circle | None = None
    in_a_row: bool = False

    @property
    def turning(self) -> bool:
        """Whether they turn as they follow each other on their circle."""
        return not all(_same_way(self.geoms[0], geom) for geom in self.geoms)


def follow(name: str, other: str) -> bool:
    """Say whether a name is the next one after another, as post_2 after post_1; nameless things follow each other."""
    one, two = _NUMBERED.fullmatch(name), _NUMBERED.fullmatch(other)
    if one is None or two is None:
        return name == other == ""
    return other == one[1] + str(int(one[2]) + 1).zfill(len(one[2]))


def own_axes(geom: GeomSummary) -> dict[str, Array]:
    """Return the axes that say how a shape is turned, in world coordinates, by their letters."""
    known = {"x": np.array(geom.x_axis), "z": np.array(geom.z_axis)}
    return {letter: known[letter] for letter in _AXES.get(geom.shape, "xz")}


def alike_shapes(geoms: Sequence[GeomSummary]) -> Iterator[Alike]:
    """Yield shapes in their order, those together that are of one kind, follow each other and lie in a pattern."""
    for kind in _runs(geoms, _same_kind):
        while kind:
            found = _ring(kind) or _row(kind) or _as_placed(kind)
            yield from found
            kind = kind[sum(len(group.geoms) for group in found) :]


def place(geoms: Sequence[GeomSummary]) -> Array:
    """Return where shapes are, (n, 3) [m]."""
    return np.array([geom.position_m for geom in geoms])


def _runs(
    geoms: Sequence[GeomSummary], alike: Callable[[GeomSummary, GeomSummary], bool]
) -> Iterator[tuple[GeomSummary, ...]]:
    """Yield shapes in their order, those together that are like the first of them and whose names count up."""
    start = 0
    for end in range(1, len(geoms) + 1):
        if end == len(geoms) or not (follow(geoms[end - 1].name, geoms[end].name) and alike(geoms[start], geoms[end])):
            yield tuple(geoms[start:end])
            start = end


def _same_kind(one: GeomSummary, other: GeomSummary) -> bool:
    return all(getattr(one, field) == getattr(other, field) for field in ("shape", "solid", "friction", "priority"))


def _same_way(one: GeomSummary, other: GeomSummary) -> bool:
    axes = own_axes(other)
    return all(np.abs(axis - axes[letter]).max() < _CLOSE for letter, axis in own_axes(one).items())


def _copy(one: GeomSummary, other: GeomSummary) -> bool:
    return one.size_m == other.size_m and _same_way(one, other)


def _ring(kind: Sequence[GeomSummary]) -> list[Alike]:
    """Return the first shapes as one group, if they lie on a circle."""
    found = circle(place(kind))
    if found is None:
        return []
    ring = Alike(tuple(kind[: found.count]), circle=found)
    sizes = np.array([geom.size_m for geom in ring.geoms])
    even = (sizes.max(axis=0) <= _MOST_UNEVEN * sizes.min(axis=0)).all()
    return [ring] if even and (not ring.turning or _turns_along(ring, found)) else []


def _turns_along(ring: Alike, on: Circle) -> bool:
    return all(
        np.abs(turned(axis, on.axis, on.step_rad, on.count) - [own_axes(geom)[letter] for geom in ring.geoms]).max()
        < _CLOSE
        for letter, axis in own_axes(ring.geoms[0]).items()
    )


def _row(kind: Sequence[GeomSummary]) -> list[Alike]:
    """Return the first shapes as one group, if they are copies that lie in a straight row."""
    copies = next(_runs(kind, _copy))
    count = row_length(place(copies))
    return [Alike(copies[:count], in_a_row=True)] if count else []


def _as_placed(kind: Sequence[GeomSummary]) -> list[Alike]:
    """Return the first shapes, up to the next pattern, together if they are copies and enough, else one by one."""
    copies = next(_runs(kind, _copy))
    copies = copies[: before_a_pattern(place(copies))]
    return [Alike(copies)] if len(copies) >= _FEWEST else [Alike((geom,)) for geom in copies]
