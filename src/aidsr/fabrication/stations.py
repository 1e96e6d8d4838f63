"""What holds a winch: a station with a seat for the motor and a stop for the sheath, and the spool on its shaft.

A station stands on a board of the builder's; one for each cable, so that any number of cables fits any bed.
"""

from __future__ import annotations

import math
import tomllib
from functools import cache
from importlib.resources import files

import numpy as np
from manifold3d import Manifold

from aidsr.artifacts import Artifact
from aidsr.catalogue.motors import Motor
from aidsr.fabrication.materials import Sheath
from aidsr.fabrication.printers import Printer
from aidsr.fabrication.solids import rounded, union

__all__ = ["Seat", "free_run_mm", "seat_of", "spool", "station"]

_PLATE_MM, _WALL_MM = 4.0, 5.0
_DRUM_MM = 8.0
"""Width of a drum: one layer of ten turns of line with room between."""

_RIM_MM, _RIM_THICK_MM = 3.0, 1.5
_STOP_MM = 35.0
"""From spool to sheath: so that the line leaves the drum at less than 7 degrees over its whole width."""

_HORN_MM = 12.5
"""Radius of the plate that is screwed to a servo's horn. Source: horns of these servos are 20 to 25 mm wide."""

_M3_MM, _M4_MM, _TIE_MM = 3.4, 4.5, 1.2
_STRAP_MM = (2.0, 5.5)
_OVER_STRAP_MM = 1.2
"""Floor that is left over the strap that holds a motor down. Our choice: three lines."""

_DRUM_WALL_MM = 0.8
"""Least wall between a drum's surface and the screws' slots in it."""

_SOCKET_MM = 6.0
_X, _Y, _Z = np.eye(3)


class Face(Artifact):
    """How a round gearmotor is screwed to a wall."""

    screws: int
    circle_mm: float
    shaft_mm: float
    offset_mm: float
    boss_mm: float


class Seat(Artifact):
    """The sizes of a motor that its station needs."""

    motors: tuple[str, ...]
    box_mm: tuple[float, float, float] | None = None
    diameter_mm: float = 40.0
    face: Face | None = None
    source: str = ""

    @property
    def shaft_height_mm(self) -> float:
        """Of the shaft above the motor's own foot."""
        if self.box_mm:
            return self.box_mm[1] / 2
        return self.diameter_mm / 2 + (self.face.offset_mm if self.face else 0.0)


@cache
def _seats() -> tuple[Seat, ...]:
    text = files("aidsr.fabrication").joinpath("stations.toml").read_text(encoding="utf-8")
    return tuple(map(Seat.model_validate, tomllib.loads(text)["station"]))


def seat_of(motor: Motor) -> Seat:
    """Return the seat of a motor; a blank one for a motor whose sizes are not in the table."""
    return next((seat for seat in _seats() if motor.name in seat.motors), Seat(motors=(motor.name,)))


def spool(seat: Seat, radius_mm: float, printer: Printer) -> Manifold:
    """Return the spool of a motor: a drum between two rims, on a horn plate or on a shaft with a set screw."""
    rim = radius_mm + _RIM_MM
    drum = union(
        [
            rounded(0 * _Z, _RIM_THICK_MM * _Z, rim),
            rounded(0 * _Z, (_DRUM_MM + 2 * _RIM_THICK_MM) * _Z, radius_mm),
            rounded((_DRUM_MM + _RIM_THICK_MM) * _Z, (_DRUM_MM + 2 * _RIM_THICK_MM) * _Z, rim),
        ]
    )
    top = (_DRUM_MM + 2 * _RIM_THICK_MM) * _Z
    tie_at = (_RIM_THICK_MM + 1.5) * _Z
    cuts = [rounded(tie_at - 2 * rim * _X, tie_at + 2 * rim * _X, _TIE_MM / 2)]
    if seat.face is None:
        drum += rounded(-3.0 * _Z, 0 * _Z + 0.1 * _Z, _HORN_MM)
        cuts.append(rounded(-4.0 * _Z, top + _Z, 1.6))
        for angle in np.arange(4) * math.pi / 2 + math.pi / 4:
            out = math.cos(angle) * _X + math.sin(angle) * _Y
            sunk = radius_mm >= _HORN_MM
            for begin, finish, wide in ((-4 * _Z, top + _Z, 1.3), (0 * _Z, top + _Z, 2.0 if sunk else 1.3)):
                ends = (6.0, 9.5) if sunk else (5.5, _slot_end(radius_mm))
                cuts.append(Manifold.batch_hull([rounded(r * out + begin, r * out + finish, wide) for r in ends]))
    else:
        hub = seat.face.shaft_mm / 2 + 4.0
        drum += rounded(-8.0 * _Z, 0.1 * _Z, hub)
        cuts.append(rounded(-9.0 * _Z, top + _Z, (seat.face.shaft_mm + printer.fit_mm) / 2))
        cuts.append(rounded(-4.0 * _Z, -4.0 * _Z + 2 * hub * _X, 1.25))
    return drum - union(cuts)


def _slot_end(drum_mm: float) -> float:
    """How far out the slots for a horn's screws go: never so that a sliver of the drum is left outside of them."""
    inside = drum_mm - _DRUM_WALL_MM - 1.3
    return min(8.0, inside) if inside > 6.5 else 8.0


def free_run_mm(radius_mm: float) -> float:
    """Return how far a line runs free at a station, from a spool of this radius to its sheath's end [mm]."""
    return radius_mm + _RIM_MM + _STOP_MM - _SOCKET_MM


def station(seat: Seat, radius_mm: float, sheath: Sheath, printer: Printer) -> Manifold:
    """Return the station of a motor with a spool of this radius. The line leaves the drum at its lowest point."""
    rim = radius_mm + _RIM_MM
    length, depth = (seat.box_mm[0], seat.box_mm[2]) if seat.box_mm else (seat.diameter_mm + 6.0, 20.0)
    strap_room = _STRAP_MM[0] + _OVER_STRAP_MM if seat.box_mm else 0.0
    axle = _PLATE_MM + max(seat.shaft_height_mm + strap_room, rim + 2.0)
    before = free_run_mm(radius_mm) + _SOCKET_MM
    drum_y = depth + _WALL_MM + 6.0 + _DRUM_MM / 2
    end, wide = length / 2 + 2 * _WALL_MM, drum_y + _DRUM_MM
    plate = Manifold.cube((end + before + _WALL_MM, wide, _PLATE_MM)).translate((-end, 0, 0))
    body = [plate, _stop(before, drum_y, axle - radius_mm)]
    cuts = [_stop_hole(before, drum_y, axle - radius_mm, sheath, printer)]
    for x in (-end + _WALL_MM, before - _WALL_MM):
        for y in (5.0, wide - 5.0):
            cuts.append(rounded(x * _X + y * _Y - _Z, x * _X + y * _Y + (_PLATE_MM + 1) * _Z, _M4_MM / 2))
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
        size = max(seat.diameter_mm + 4.0, 2 * rim)
        wall = Manifold.cube((size, _WALL_MM, axle + max(12.0, seat.diameter_mm / 2))).translate((-size / 2, depth, 0))
        body.append(wall)
        cuts += _face_holes(seat, axle, depth)
    return union(body) - union(cuts)


def _stop(x: float, y: float, z: float) -> Manifold:
    post = Manifold.cube((2 * _WALL_MM, 2 * _WALL_MM, z + _WALL_MM)).translate((x - 2 * _WALL_MM, y - _WALL_MM, 0))
    foot = Manifold.cube((2 * _WALL_MM, 4 * _WALL_MM, _PLATE_MM + 2)).translate((x - 2 * _WALL_MM, y - 2 * _WALL_MM, 0))
    return post + foot


def _stop_hole(x: float, y: float, z: float, sheath: Sheath, printer: Printer) -> Manifold:
    """A narrow hole for the line, and on its far side a seat for the sheath."""
    through = rounded(np.array([x - 30, y, z]), np.array([x + 9, y, z]), max(printer.hole_mm, sheath.inner_mm) / 2)
    seat = rounded(np.array([x - _SOCKET_MM, y, z]), np.array([x + 9, y, z]), (sheath.outer_mm + printer.fit_mm) / 2)
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
