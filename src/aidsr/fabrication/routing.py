"""Routing of cables inside parts: straight ducts along the guides, a seat for the sheath and a seat for the knot."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np
from manifold3d import Manifold

from aidsr.core.artifacts import Fault
from aidsr.fabrication.anatomy import Anatomy, Cable, Guide, Vector
from aidsr.fabrication.materials import Line, Sheath
from aidsr.fabrication.printers import Printer
from aidsr.fabrication.skeleton import Skeleton, unit
from aidsr.fabrication.solids import bell_mouth, first_hits, rounded

_FILLET_MM = 0.6
"""Fillet radius at the mouth of a duct. Our choice: twice the radius of the line, and less than the wall around it."""

_WALL_MM = 1.0
"""Wall thickness around a cable's hole. Our choice: more than the thinnest wall, as lines cut into plastic."""

SHEATH_SEAT_MM = 5.0
"""Depth of the seat of a sheath in the robot. Our choice: two and a half times its diameter."""

_KNOT_MM = (2.4, 3.0)
"""Smallest diameter and smallest depth of the seat of a knot or a crimped sleeve. Our choice: a 2 mm sleeve."""

_LONGEST_ENTRY_MM = 15.0
"""Largest distance behind a cable's first guide at which the body is used to hold the cable's sheath."""

_SHORT_DUCT_MM = 3.0
"""Length of the duct where a cable passes only one site of a part."""

_REACH_MM = 400.0
"""Length of the rays with which bodies are probed."""


@dataclass(frozen=True)
class Bore:
    """Radii of the holes for one cable.

    Attributes:
        radius_mm: Radius of the duct.
        sheath_mm: Radius of the seat of the sheath.
        knot_mm: Radius of the seat of the knot.
    """

    radius_mm: float
    sheath_mm: float
    knot_mm: float

    @property
    def outside_mm(self) -> float:
        """Outer radius of the wall around the duct, without the seats of sheath and knot [mm]."""
        return self.radius_mm + _WALL_MM

    def wall_radius(self, duct: Duct) -> float:
        """Return the outer radius of the wall around a duct, with the seats it contains [mm]."""
        widest = max(self.radius_mm, self.sheath_mm * duct.sheathed, self.knot_mm * duct.ends)
        return widest + _WALL_MM


@dataclass(frozen=True)
class Duct:
    """The duct of one cable through one part. Positions are in the robot's frame [mm].

    Attributes:
        cable: Index of the cable in the anatomy.
        part: Index of the part in the anatomy.
        body: Number of the body of the part that carries the first guide.
        path: Guides that the simulated cable passes in the part (n, 3).
        begin: Start of the wall around the duct, on the side of the winch (3,).
        end: End of the wall around the duct (3,).
        sheathed: Whether the sheath ends in this part, at `seat`.
        ends: Whether the cable is tied in this part.
        seat: Mouth of the sheath's seat, into which the sheath is pushed `SHEATH_SEAT_MM` deep (3,).
        open_mm: Length by which the seat of the knot is cut beyond the duct's end, so that it is accessible.
    """

    cable: int
    part: int
    body: int
    path: Vector
    begin: Vector
    end: Vector
    sheathed: bool
    ends: bool
    seat: Vector
    open_mm: float

    @property
    def direction(self) -> Vector:
        """Unit vector from the winch towards the tied end (3,)."""
        return unit(self.end - self.begin)

    @property
    def narrow(self) -> tuple[Vector, Vector]:
        """Ends of the narrow portion of the duct, between the seats of sheath and knot."""
        along = self.direction
        begin = self.seat + SHEATH_SEAT_MM * along if self.sheathed else self.begin
        return begin, self.end - _KNOT_MM[1] * self.ends * along

    def drills(self, bore: Bore) -> Iterator[Manifold]:
        """Yield the solids to cut out of the part."""
        along = self.direction
        points = [self.seat if self.sheathed else self.begin, *self.path[1:-1], self.end]
        for one, other in pairwise(points):
            step = unit(other - one)
            yield rounded(one - 0.3 * step, other + 0.3 * step, bore.radius_mm)
        if self.sheathed:
            yield rounded(self.seat - 2 * bore.sheath_mm * along, self.seat + SHEATH_SEAT_MM * along, bore.sheath_mm)
        else:
            yield bell_mouth(self.begin, -along, bore.radius_mm, _FILLET_MM)
        if self.ends:
            deep = self.end - _KNOT_MM[1] * along
            yield rounded(deep, self.end + self.open_mm * along, bore.knot_mm)
        else:
            yield bell_mouth(self.end, along, bore.radius_mm, _FILLET_MM)


def bore_for(line: Line, sheath: Sheath, printer: Printer) -> Bore:
    """Return the radii of the holes for a line and its sheath on a printer."""
    return Bore(
        radius_mm=max(printer.hole_mm, line.diameter_mm + printer.clearance_mm) / 2,
        sheath_mm=(sheath.outer_mm + printer.fit_mm) / 2,
        knot_mm=max(_KNOT_MM[0], 3 * line.diameter_mm) / 2,
    )


def ducts_of(anatomy: Anatomy, skeleton: Skeleton, bodies: dict[int, Manifold]) -> tuple[Duct, ...]:
    """Return the ducts of all cables that run through sites.

    Args:
        anatomy: The robot.
        skeleton: Gaps of the robot.
        bodies: Solid of each part before anything is cut, by the part's index.
    """
    found: list[Duct] = []
    for index, cable in enumerate(anatomy.cables):
        if not cable.wraps:
            found.extend(_ducts(index, cable, skeleton, bodies))
    return tuple(found)


def routing_faults(anatomy: Anatomy) -> Iterator[Fault]:
    """Yield faults for cables that cannot run in straight ducts, and for actuators that drive no tendon."""
    around = tuple(cable.tendon for cable in anatomy.cables if cable.wraps)
    if around:
        yield _fault("cable_wraps", around, "runs around a geom or a pulley, or is no cable through sites")
    outside = tuple(c.tendon for c in anatomy.cables if not c.wraps and any(g.part < 0 for g in c.guides))
    if outside:
        yield _fault("cable_wraps", outside, "is guided by the world, which is not printed")
    if anatomy.other_actuators:
        yield _fault("actuator_without_cable", anatomy.other_actuators, "drives a joint or a body and no tendon")


def _fault(code: str, names: tuple[str, ...], message: str) -> Fault:
    cure = "Lead a spatial tendon through sites of the robot's own bodies, and let the actuator pull on it."
    return Fault(code=code, layer="realizability", severity="error", names=names, message=message, cure=cure)


def _ducts(index: int, cable: Cable, skeleton: Skeleton, bodies: dict[int, Manifold]) -> Iterator[Duct]:
    visits = [(part, list(guides)) for part, guides in groupby(cable.guides, key=lambda guide: guide.part)]
    for number, (part, guides) in enumerate(visits):
        if part < 0:
            continue
        first, last = number == 0, number == len(visits) - 1
        along = _direction(skeleton, part, guides, visits, number)
        path = np.array([guide.position_mm for guide in guides])
        begin, end = path[0], path[-1]
        if len(guides) == 1 and not (first or last):
            begin, end = begin - _SHORT_DUCT_MM / 2 * along, end + _SHORT_DUCT_MM / 2 * along
        seat = begin
        if first:
            begin, seat = _entry(bodies[part], path[0], -along)
        if last:
            end = end + (_KNOT_MM[1] + _SHORT_DUCT_MM) * along
        yield Duct(index, part, guides[0].body, path, begin, end, first, last, seat, _way_out(bodies[part], end, along))


def _way_out(body: Manifold, end: Vector, along: Vector) -> float:
    """Return the distance from a duct's end to the surface of the body it lies in, plus a margin [mm]."""
    hits = first_hits(body, end, along, _REACH_MM)
    return (hits[0] if len(hits) % 2 else 0.0) + _SHORT_DUCT_MM / 2


def _direction(
    skeleton: Skeleton, part: int, guides: list[Guide], visits: list[tuple[int, list[Guide]]], number: int
) -> Vector:
    """Return the direction of a cable in a part: from first to last guide, or along the limb for a single guide."""
    if len(guides) > 1:
        return unit(np.array(guides[-1].position_mm) - np.array(guides[0].position_mm))
    here = np.array(guides[0].position_mm)
    before = visits[number - 1][1][-1].position_mm if number else here
    after = visits[number + 1][1][0].position_mm if number + 1 < len(visits) else here
    towards = np.array(after) - np.array(before)
    spines = [gap for index, gap in enumerate(skeleton.gaps) if part in _parts(skeleton, index)]
    if spines:
        nearest = min(spines, key=lambda gap: float(np.linalg.norm(gap.anchor - here)))
        axis = nearest.before if skeleton.anatomy.joints[nearest.joint].parent == part else nearest.after
        return axis if axis @ towards >= 0 else -axis
    return unit(towards)


def _parts(skeleton: Skeleton, joint: int) -> tuple[int, int]:
    bend = skeleton.anatomy.joints[joint]
    return bend.parent, bend.child


def _entry(body: Manifold, guide: Vector, backward: Vector) -> tuple[Vector, Vector]:
    """Return where the wall around a cable's first duct begins, and the mouth of the sheath's seat.

    From its first guide the cable continues backwards along the limb. Where it meets the body within
    `_LONGEST_ENTRY_MM`, the sheath sits in the far side of the body; elsewhere a short wall is added to hold it.
    """
    hits = first_hits(body, guide, backward, _REACH_MM)
    inside = len(hits) % 2 == 1
    if not inside and (not hits or hits[0] > _LONGEST_ENTRY_MM):
        seat = guide + (SHEATH_SEAT_MM + _SHORT_DUCT_MM) * backward
        return seat, seat
    entered = 0.0 if inside else hits[0]
    crossings = hits if inside else hits[1:]
    exits = crossings[0]
    if exits - entered < SHEATH_SEAT_MM + _SHORT_DUCT_MM:  # a thin plate alone holds no sheath
        exits = max(exits, SHEATH_SEAT_MM + _SHORT_DUCT_MM)
        return guide + exits * backward, guide + exits * backward
    return guide + (entered + 1.0) * backward, guide + exits * backward
