"""Bodies of an environment that are copies of each other but for their place and the number in their names."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from aidsr.core.artifacts import BodySummary, Vec3
from aidsr.teams.llm.arrangements import Array
from aidsr.teams.llm.shape_groups import follow

__all__ = ["Copies", "copied_bodies"]

_CLOSE_M = 1e-5
"""Places that near are the same. Our choice: less than any summary tells."""
_FEWEST = 2
"""One copy alone is told like any other body. Our choice."""

_Tree = tuple[BodySummary, ...]
"""A body, and all that is on it."""


@dataclass(frozen=True)
class Copies:
    """A body with all that is on it, and its copies; one that has none stands alone."""

    first: _Tree
    others: tuple[_Tree, ...] = ()


def copied_bodies(bodies: Sequence[BodySummary]) -> Iterator[Copies]:
    """Yield bodies in their order, those together whose names count up and that are copies of the first of them."""
    start = 0
    while start < len(bodies):
        trees = [_tree(bodies, start)]
        end = start + len(trees[0])
        while end < len(bodies):
            other = _tree(bodies, end)
            if not follow(trees[-1][0].name, other[0].name) or not _is_copy(trees[0], other):
                break
            trees.append(other)
            end += len(other)
        if len(trees) <= _FEWEST:
            trees, end = [trees[0][:1]], start + 1
        yield Copies(trees[0], tuple(trees[1:]))
        start = end


def _tree(bodies: Sequence[BodySummary], start: int) -> _Tree:
    """Return a body and those on it, which stand right behind it."""
    on = {bodies[start].name}
    end = start + 1
    while end < len(bodies) and bodies[end].parent in on:
        on.add(bodies[end].name)
        end += 1
    return tuple(bodies[start:end])


def _is_copy(first: _Tree, other: _Tree) -> bool:
    (said, places), (other_said, other_places) = _apart(first), _apart(other)
    return said == other_said and bool(np.abs(places - other_places).max() < _CLOSE_M)


def _apart(tree: _Tree) -> tuple[list[Any], Array]:
    """Return all that is said of a body and what is on it without its number, and all places from where it stands."""
    number = re.search(r"\d*$", tree[0].name)
    own = re.compile(rf"(?<!\d){number[0]}(?!\d)" if number and number[0] else "$^")
    said: list[Any] = []
    places: list[Vec3] = []
    for body in tree:
        parent = body.parent if body is tree[0] else own.sub("#", body.parent)
        joints = [own.sub("#", name) + rest for name, _, rest in (joint.partition(": ") for joint in body.joints)]
        said += [own.sub("#", body.name), parent, body.mass_kg, joints]
        said += [(own.sub("#", g.name), g.model_dump(exclude={"name", "position_m"})) for g in body.geoms]
        places += [body.position_m, *(geom.position_m for geom in body.geoms)]
    return said, np.subtract(places, tree[0].position_m)
