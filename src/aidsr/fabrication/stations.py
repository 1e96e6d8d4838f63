"""Printed parts of a winch: a station, which is a motor mount with a stop for the sheath, and the spool.

Each cable has its own station, screwed to a board that is not part of the export, so that any number of cables fits
any printer bed.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from manifold3d import Manifold

from aidsr.core.artifacts import Artifact
from aidsr.core.motors import MOST_TURNS, Motor
from aidsr.fabrication.materials import Sheath
from aidsr.fabrication.printers import Printer
from aidsr.fabrication.solids import M4_HOLE_MM, rounded, union

SPARE_TURNS = 1.5
"""Turns of cable that stay on a spool. Our choice: they keep the load off the knot."""

_PLATE_MM, _WALL_MM = 4.0, 5.0
_LEAST_DRUM_MM, _ROOM = 8.0, 1.1
"""Smallest width of a drum, and pitch of the turns / diameter of the line. Our choice: one layer with gaps."""

_RIM_MM, _RIM_THICK_MM = 3.0, 1.5
_STOP_WIDTHS = 4.4
"""Distance from spool to stop / width of the drum; keeps the fleet angle of the line below 7 degrees."""

_HORN_MM = 12.5
"""Radius of the plate on the spool that is screwed to a servo's horn. Source: horns of these servos are 20 to 25 mm
wide."""

HORN_SCREWS = 4
"""Number of screws that hold a spool on the horn or output flange of a motor."""

_M3_MM = 3.4
"""Diameter of the holes for M3 screws."""

_SLOT_MM, _SLOT_END_MM = 1.3, 8.0
"""Half width of the slots for a horn's screws, and distance of the screws of the widest horns from the shaft."""

_STRAP_MM = (2.0, 5.5)
_OVER_STRAP_MM = 1.2
"""Thickness of the floor above the strap that holds a motor down. Our choice: three printed lines."""

_SPOOL_WALL_MM = 0.8
"""Smallest wall between the surface of a drum or a rim and the screws' slots in it."""

_STOP_SEAT_MM = 6.0
"""Depth of the seat of a sheath in the stop of a station."""

_X, _Y, _Z = np.eye(3)


@dataclass(frozen=True)
class Drum:
    """The drum on which a line is wound.

    Attributes:
        reach_mm: Distance from the axis of the shaft to the middle of the line.
        line_mm: Diameter of the line.
    """

    reach_mm: float
    line_mm: float

    @property
    def radius_mm(self) -> float:
        """Radius of its surface."""
        return self.reach_mm - self.line_mm / 2

    @property
    def rim_mm(self) -> float:
        """Radius of the rims on both sides."""
        return self.radius_mm + _RIM_MM

    @property
    def width_mm(self) -> float:
        """Width between the rims, for one layer of the largest number of turns."""
        return max(_LEAST_DRUM_MM, _ROOM * (MOST_TURNS + SPARE_TURNS) * self.line_mm)

    @property
    def free_run_mm(self) -> float:
        """Length of line between the spool and the end of the sheath."""
        return self.rim_mm + _STOP_WIDTHS * self.width_mm - _STOP_SEAT_MM


class Face(Artifact):
    """Mounting face of a round gearmotor."""

    screws: int
    """Number of screws, evenly spaced on the bolt circle."""
    circle_mm: float
    """Diameter of the bolt circle."""
    shaft_mm: float
    """Diameter of the shaft."""
    offset_mm: float
    """Distance of the shaft from the centre of the motor."""
    boss_mm: float
    """Diameter of the hole for the boss around the shaft."""


class Seat(Artifact):
    """Dimensions of a motor that its station needs."""

    motors: tuple[str, ...]
    """Names of the motors with these dimensions."""
    box_mm: tuple[float, float, float] | None = None
    """Length, width and depth along the shaft of a servo; None for a round gearmotor."""
    diameter_mm: float = 40.0
    """Diameter of a round gearmotor."""
    face: Face | None = None
    """Mounting face of a round gearmotor; None leaves the wall without holes."""
    source: str = ""

    @property
    def shaft_height_mm(self) -> float:
        """Height of the shaft above the bottom of the motor."""
        if self.box_mm:
            return self.box_mm[1] / 2
        return self.diameter_mm / 2 + (self.face.offset_mm if self.face else 0.0)


@cache
def _seats() -> tuple[Seat, ...]:
    text = files("aidsr.fabrication").joinpath("stations.toml").read_text(encoding="utf-8")
    return tuple(map(Seat.model_validate, tomllib.loads(text)["station"]))


def seat_of(motor: Motor) -> Seat:
    """Return the seat of a motor, or a default one without screw holes where stations.toml does not list the motor."""
    return next((seat for seat in _seats() if motor.name in seat.motors), Seat(motors=(motor.name,)))


def spool(seat: Seat, drum: Drum, printer: Printer) -> Manifold:
    """Return the spool of a motor: a drum between two rims, on a horn plate or on a shaft with a set screw."""
    high = drum.width_mm + 2 * _RIM_THICK_MM
    solid = union(
        [
            rounded(0 * _Z, _RIM_THICK_MM * _Z, drum.rim_mm),
            rounded(0 * _Z, high * _Z, drum.radius_mm),
            rounded((high - _RIM_THICK_MM) * _Z, high * _Z, drum.rim_mm),
        ]
    )
    tie_mm = max(printer.hole_mm, drum.line_mm + printer.clearance_mm)
    tie_at = (_RIM_THICK_MM + tie_mm / 2 + _SPOOL_WALL_MM) * _Z
    cuts = [rounded(tie_at - 2 * drum.rim_mm * _X, tie_at + 2 * drum.rim_mm * _X, tie_mm / 2)]
    if seat.face is None:
        solid += rounded(-3.0 * _Z, 0 * _Z + 0.1 * _Z, _HORN_MM)
        cuts.append(rounded(-4.0 * _Z, (high + 1) * _Z, 1.6))
        cuts += _horn_slots(drum, high)
    else:
        hub = seat.face.shaft_mm / 2 + 4.0
        solid += rounded(-8.0 * _Z, 0.1 * _Z, hub)
        cuts.append(rounded(-9.0 * _Z, (high + 1) * _Z, (seat.face.shaft_mm + printer.fit_mm) / 2))
        cuts.append(rounded(-4.0 * _Z, -4.0 * _Z + 2 * hub * _X, 1.25))
    return solid - union(cuts)


def _horn_slots(drum: Drum, high: float) -> list[Manifold]:
    """Return the slots for a horn's screws, with room for countersunk heads in a large drum."""
    sunk = drum.radius_mm >= _HORN_MM
    ends = (6.0, 9.5) if sunk else (5.5, _slot_end(drum))
    slots = []
    for angle in np.arange(HORN_SCREWS) * 2 * math.pi / HORN_SCREWS + math.pi / 4:
        out = math.cos(angle) * _X + math.sin(angle) * _Y
        for begin, wide in ((-4.0, _SLOT_MM), (0.0, 2.0 if sunk else _SLOT_MM)):
            rods = [rounded(r * out + begin * _Z, r * out + (high + 1) * _Z, wide) for r in ends]
            slots.append(Manifold.batch_hull(rods))
    return slots


def _slot_end(drum: Drum) -> float:
    """Return the outer end of the slots for a horn's screws, chosen so that no thin wall is left outside of them."""
    inside = drum.radius_mm - _SPOOL_WALL_MM - _SLOT_MM
    if inside > 6.5:
        return min(_SLOT_END_MM, inside)
    left = drum.rim_mm - _SLOT_END_MM - _SLOT_MM
    return _SLOT_END_MM if left >= _SPOOL_WALL_MM else max(_SLOT_END_MM, drum.rim_mm)


def station(seat: Seat, drum: Drum, sheath: Sheath, printer: Printer) -> Manifold:
    """Return the station of a motor with a spool. The line leaves the drum at its lowest point."""
    length, depth = (seat.box_mm[0], seat.box_mm[2]) if seat.box_mm else (seat.diameter_mm + 6.0, 20.0)
    strap_room = _STRAP_MM[0] + _OVER_STRAP_MM if seat.box_mm else 0.0
    axle = _PLATE_MM + max(seat.shaft_height_mm + strap_room, drum.rim_mm + 2.0)
    before = drum.free_run_mm + _STOP_SEAT_MM
    drum_y = depth + _WALL_MM + 6.0 + drum.width_mm / 2
    end, wide = length / 2 + 2 * _WALL_MM, drum_y + drum.width_mm
    plate = Manifold.cube((end + before + _WALL_MM, wide, _PLATE_MM)).translate((-end, 0, 0))
    body = [plate, _stop(before, drum_y, axle - drum.reach_mm)]
    cuts = [_stop_hole(before, drum_y, axle - drum.reach_mm, sheath, printer)]
    for x in (-end + _WALL_MM, before - _WALL_MM):
        for y in (5.0, wide - 5.0):
            cuts.append(rounded(x * _X + y * _Y - _Z, x * _X + y * _Y + (_PLATE_MM + 1) * _Z, M4_HOLE_MM / 2))
    if seat.box_mm:
        floor = axle - seat.shaft_height_mm
        high = floor + 0.6 * seat.box_mm[1]
        slack = printer.fit_mm
        body.append(Manifold.cube((length, depth, floor)).translate((-length / 2, 0, 0)))
        body += [
            Manifold.cube((_WALL_MM, depth, high)).translate((x, 0, 0))
            for x in (length / 2 + slack, -length / 2 - slack - _WALL_MM)
        ]
        strap = Manifold.cube((length + 4 * _WALL_MM, _STRAP_MM[1], _STRAP_MM[0]))
        cuts.append(strap.translate((-length / 2 - 2 * _WALL_MM, depth / 2, _PLATE_MM)))
    else:
        size = max(seat.diameter_mm + 4.0, 2 * drum.rim_mm)
        wall = Manifold.cube((size, _WALL_MM, axle + max(12.0, seat.diameter_mm / 2))).translate((-size / 2, depth, 0))
        body.append(wall)
        cuts += _face_holes(seat, axle, depth)
    return union(body) - union(cuts)


def _stop(x: float, y: float, z: float) -> Manifold:
    post = Manifold.cube((2 * _WALL_MM, 2 * _WALL_MM, z + _WALL_MM)).translate((x - 2 * _WALL_MM, y - _WALL_MM, 0))
    foot = Manifold.cube((2 * _WALL_MM, 4 * _WALL_MM, _PLATE_MM + 2)).translate((x - 2 * _WALL_MM, y - 2 * _WALL_MM, 0))
    return post + foot


def _stop_hole(x: float, y: float, z: float, sheath: Sheath, printer: Printer) -> Manifold:
    """Return a narrow hole for the line and, on the side away from the spool, a seat for the sheath."""
    through = rounded(np.array([x - 30, y, z]), np.array([x + 9, y, z]), max(printer.hole_mm, sheath.inner_mm) / 2)
    seat = rounded(np.array([x - _STOP_SEAT_MM, y, z]), np.array([x + 9, y, z]), (sheath.outer_mm + printer.fit_mm) / 2)
    return through + seat


def _face_holes(seat: Seat, axle: float, depth: float) -> list[Manifold]:
    if seat.face is None:
        return []
    centre = np.array([0.0, depth, axle - seat.face.offset_mm])
    across = (_WALL_MM + 2) * _Y
    cuts = [rounded(np.array([0, depth - 1, axle]), np.array([0, depth - 1, axle]) + across, seat.face.boss_mm / 2)]
    for angle in np.arange(seat.face.screws) * 2 * math.pi / seat.face.screws:
        at = centre + seat.face.circle_mm / 2 * np.array([math.cos(angle), 0.0, math.sin(angle)]) - _Y
        cuts.append(rounded(at, at + across, _M3_MM / 2))
    return cuts
