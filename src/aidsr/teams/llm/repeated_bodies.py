"""Bodies of an environment that are equal except for their position and the number in their names."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from aidsr.core.artifacts import BodySummary, Vec3
from aidsr.teams.llm.arrangements import Array
from aidsr.teams.llm.shape_groups import is_next_name

_TOLERANCE_M = 1e-5
"""Positions that differ by less are equal. Our choice: below the precision of any summary."""
_MIN_COUNT = 3
"""Number of equal bodies from which they are described together: a single copy is described like any other body. Our
choice."""

_Tree = tuple[BodySummary, ...]
"""A body and its descendants."""


@dataclass(frozen=True)
class RepeatedBody:
    """A body with its descendants, and its copies, if any."""

    first: _Tree
    copies: tuple[_Tree, ...] = ()


def group_repeated_bodies(bodies: Sequence[BodySummary]) -> Iterator[RepeatedBody]:
    """Yield bodies in order, grouped where they have consecutive names and are copies of the first one."""
    start = 0
    while start < len(bodies):
        trees = [_tree(bodies, start)]
        end = start + len(trees[0])
        while end < len(bodies):
            other = _tree(bodies, end)
            if not is_next_name(trees[-1][0].name, other[0].name) or not _is_copy(trees[0], other):
                break
            trees.append(other)
            end += len(other)
        if len(trees) < _MIN_COUNT:
            trees, end = [trees[0][:1]], start + 1
        yield RepeatedBody(trees[0], tuple(trees[1:]))
        start = end


def _tree(bodies: Sequence[BodySummary], start: int) -> _Tree:
    """Return the body at index `start` and its descendants, which directly follow it in the list."""
    on = {bodies[start].name}
    end = start + 1
    while end < len(bodies) and bodies[end].parent in on:
        on.add(bodies[end].name)
        end += 1
    return tuple(bodies[start:end])


def _is_copy(first: _Tree, other: _Tree) -> bool:
    (facts, positions), (other_facts, other_positions) = _relative_description(first), _relative_description(other)
    return facts == other_facts and bool(np.abs(positions - other_positions).max() < _TOLERANCE_M)


def _relative_description(tree: _Tree) -> tuple[list[Any], Array]:
    """Return the facts of a body and its descendants without its number, and all positions relative to the body [m]."""
    number = re.search(r"\d*$", tree[0].name)
    own = re.compile(rf"(?<!\d){number[0]}(?!\d)" if number and number[0] else "$^")
    facts: list[Any] = []
    positions: list[Vec3] = []
    for body in tree:
        parent = body.parent if body is tree[0] else own.sub("#", body.parent)
        joints = [own.sub("#", name) + rest for name, _, rest in (joint.partition(": ") for joint in body.joints)]
        facts += [own.sub("#", body.name), parent, body.mass_kg, joints]
        facts += [(own.sub("#", g.name), g.model_dump(exclude={"name", "position_m"})) for g in body.geoms]
        positions += [body.position_m, *(geom.position_m for geom in body.geoms)]
    return facts, np.subtract(positions, tree[0].position_m)
