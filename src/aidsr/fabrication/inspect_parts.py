"""Geometric checks of the finished pieces: cables free in their ducts, walls around ducts, no overlapping pieces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from manifold3d import Manifold

from aidsr.core.artifacts import Fault
from aidsr.fabrication.anatomy import Anatomy
from aidsr.fabrication.cut_parts import Piece
from aidsr.fabrication.routing import Bore, Duct
from aidsr.fabrication.shape_parts import Shaping
from aidsr.fabrication.solids import rounded, union

_FREE_SHARE, _HELD_SHARE = 0.01, 0.95
"""Largest share of a cable's volume that may be inside plastic, and smallest share of the wall around it that must be
plastic. Our choice: allows for the facets of a drilled circle and the fillets at the mouths."""

_NEAR_MM = 5.0
"""Margin around the ducts of a part, larger than the radius of any probe."""

_CROWDED_MM3 = 1.0
"""Largest overlap of two pieces. Our choice: trimming a print with a knife removes more."""

_CURE = (
    "Move the routing sites away from other parts, or nearer to the part they belong to; beside a joint, place them at "
    "equal distances before and behind it."
)

_MIDDLE = (0.2, 0.8)
"""Range of a duct, as shares of its length, in which its wall is measured; mouths widen at its ends."""


@dataclass(frozen=True)
class Passage:
    """One section of a cable, measured on the finished solids.

    Attributes:
        cable: Index of the cable in the anatomy.
        parts: Index of the part it lies in, or of the two parts between which it runs.
        blocked: Share of the cable's own volume that is plastic.
        held: Share of a wall around the duct that is plastic; 1 between parts, where there is none.
    """

    cable: int
    parts: tuple[int, ...]
    blocked: float
    held: float

    @property
    def sound(self) -> bool:
        """Whether the cable is not blocked and the wall around it is complete."""
        return self.blocked <= _FREE_SHARE and self.held >= _HELD_SHARE


def passages(shaping: Shaping, bores: tuple[Bore, ...], line_radii_mm: tuple[float, ...]) -> tuple[Passage, ...]:
    """Return the sections of each cable in each part and between parts, intersected with the robot at rest."""
    whole, near = union([piece.solid for piece in shaping.pieces]), {}
    found = []
    for duct in shaping.ducts:
        if duct.part not in near:
            near[duct.part] = _around(whole, [one for one in shaping.ducts if one.part == duct.part])
        solid = near[duct.part]
        bore = bores[duct.cable]
        points = duct.path if len(duct.path) > 1 else np.array([duct.begin, duct.end])
        line = union([rounded(a, b, line_radii_mm[duct.cable]) for a, b in pairwise(points)])
        begin, end = duct.narrow
        low, high = (begin + share * (end - begin) for share in _MIDDLE)
        ring = rounded(low, high, bore.radius_mm + 0.6) - rounded(
            low - (high - low), high + (high - low), bore.radius_mm + 0.1
        )
        found.append(Passage(duct.cable, (duct.part,), _share(line, solid), _share(ring, solid)))
    for duct, following in pairwise(shaping.ducts):
        if duct.cable == following.cable:
            line = rounded(duct.path[-1], following.path[0], line_radii_mm[duct.cable])
            found.append(Passage(duct.cable, (duct.part, following.part), _share(line, whole), 1.0))
    return tuple(found)


def duct_faults(anatomy: Anatomy, found: tuple[Passage, ...]) -> Iterator[Fault]:
    """Yield faults for cables that are blocked by plastic, or whose wall is incomplete."""
    blocked = [one for one in found if one.blocked > _FREE_SHARE]
    if blocked:
        yield Fault(
            code="tendon_through_body",
            layer="realizability",
            severity="error",
            names=_sections(anatomy, blocked),
            measured=max(100 * one.blocked for one in blocked),
            limit=100 * _FREE_SHARE,
            unit="%",
            message="runs through plastic",
            cure=_CURE,
        )
    bare = [one for one in found if one.held < _HELD_SHARE]
    if bare:
        yield Fault(
            code="duct_open",
            layer="realizability",
            severity="warning",
            names=_sections(anatomy, bare),
            measured=min(100 * one.held for one in bare),
            limit=100 * _HELD_SHARE,
            unit="%",
            message="has no wall all around it in some part",
            cure=_CURE,
        )


def overlap_faults(pieces: tuple[Piece, ...]) -> Iterator[Fault]:
    """Yield a fault for the pairs of pieces that overlap."""
    shared = {(one.name, other.name): (one.solid ^ other.solid).volume() for one, other in combinations(pieces, 2)}
    crowded = {names: volume for names, volume in shared.items() if volume > _CROWDED_MM3}
    if crowded:
        yield Fault(
            code="parts_overlap",
            layer="realizability",
            severity="error",
            names=tuple(f"{one} and {other}" for one, other in crowded),
            measured=max(crowded.values()),
            limit=_CROWDED_MM3,
            unit="mm³",
            message="are in one place at rest",
            cure="Move their shapes apart, or make them one body.",
        )


def _sections(anatomy: Anatomy, found: list[Passage]) -> tuple[str, ...]:
    """Return the tendon and the parts of each passage in words, without duplicates."""
    names = (
        f"{anatomy.cables[one.cable].tendon} {'in' if len(one.parts) == 1 else 'between'} "
        + " and ".join(anatomy.parts[part].name for part in one.parts)
        for one in found
    )
    return tuple(dict.fromkeys(names))


def _around(whole: Manifold, ducts: list[Duct]) -> Manifold:
    """Return the portion of the robot near the ducts of one part, which is faster to intersect with each of them."""
    points = np.vstack([np.vstack([duct.path, duct.begin, duct.end, duct.seat]) for duct in ducts])
    low, high = points.min(axis=0) - _NEAR_MM, points.max(axis=0) + _NEAR_MM
    return whole ^ Manifold.cube(tuple(high - low)).translate(tuple(low))


def _share(probe: Manifold, solid: Manifold) -> float:
    volume = probe.volume()
    return float((probe ^ solid).volume() / volume) if volume > 0 else 0.0
