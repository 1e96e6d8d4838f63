"""Printers and their limits: walls, gaps and sizes for which parts are designed."""

from __future__ import annotations

from aidsr.core.artifacts import Artifact
from aidsr.core.errors import UserError


class Printer(Artifact):
    """One kind of printer."""

    name: str
    label: str
    bed_mm: tuple[float, float, float]
    wall_mm: float
    """Thinnest wall that prints reliably."""
    hole_mm: float
    """Narrowest hole that stays open."""
    clearance_mm: float
    """Added to the diameter of a hole in which something slides."""
    fit_mm: float
    """Added to the diameter of a hole in which something is glued."""
    overhang_deg: float
    """Largest overhang angle from the vertical that prints without support."""
    shell_mm: float
    """Thickness of the solid outer wall, inside of which the infill begins; 0 for printers that print solid parts."""
    source: str

    def fits(self, size_mm: tuple[float, float, float]) -> bool:
        """Whether a box of this size fits the build volume, turned by 90 degrees about the vertical if necessary."""
        size, bed = self.side_most(size_mm)
        return size <= bed

    def side_most(self, size_mm: tuple[float, float, float]) -> tuple[float, float]:
        """Return the most critical side of a box and the matching side of the bed [mm].

        The box is turned about the vertical so that it fits best; the most critical side is the one with the largest
        ratio to its side of the bed.
        """
        x, y, z = size_mm
        width, depth, height = self.bed_mm
        sides = ((max(x, y), max(width, depth)), (min(x, y), min(width, depth)), (z, height))
        return max(sides, key=lambda side: side[0] / side[1])


PRINTERS = (
    Printer(
        name="fdm",
        label="filament printer, 0.4 mm nozzle",
        bed_mm=(220.0, 220.0, 250.0),
        wall_mm=0.8,
        hole_mm=1.2,
        clearance_mm=0.5,
        fit_mm=0.2,
        overhang_deg=45.0,
        shell_mm=0.8,
        source="my3dpm, FDM design table: walls of 0.8 mm, 0.5 mm between parts that move, 45 degrees, holes print "
        "narrow; hycubeworks design guide: 0.2 mm for a tight fit. Holes below 2 mm are discouraged there; 1.2 mm is "
        "our choice, and the sheet tells to open them with a wire. Bed: our choice, of a usual desktop machine",
    ),
    Printer(
        name="sla",
        label="resin printer",
        bed_mm=(200.0, 125.0, 210.0),
        wall_mm=0.6,
        hole_mm=0.8,
        clearance_mm=0.3,
        fit_mm=0.1,
        overhang_deg=60.0,
        shell_mm=0.0,
        source="hycubeworks design guide: 0.3 mm between parts that move, less than 0.15 mm for a tight fit. Walls, "
        "holes and lean are our choice, coarser than makers claim; bed of a Formlabs Form 4",
    ),
)


def printer_named(name: str) -> Printer:
    """Return a printer.

    Raises:
        UserError: There is no printer of that name.
    """
    for printer in PRINTERS:
        if printer.name == name:
            return printer
    raise UserError(f'unknown printer "{name}"; choose one of {", ".join(p.name for p in PRINTERS)}')
