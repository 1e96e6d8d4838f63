"""Mass of printed pieces, and the infill with which they reach the simulated mass."""

from __future__ import annotations

from dataclasses import dataclass

from manifold3d import Manifold

from aidsr.fabrication.materials import Material
from aidsr.fabrication.printers import Printer

LEAST_INFILL, _STEP = 0.15, 0.05
"""Smallest infill, and step between infills. Our choice: below 15 % the top layers sag; slicers are set in steps of
5 %."""


@dataclass(frozen=True)
class Weight:
    """The mass of a piece and its infill.

    Attributes:
        infill: Share of the inside that is filled.
        printed_kg: Mass of its plastic at this infill.
        simulated_kg: Mass of its bodies in simulation; 0 for a part that is not simulated.
        extra_kg: Mass of the items put into it.
    """

    infill: float
    printed_kg: float
    simulated_kg: float
    extra_kg: float

    @property
    def mass_kg(self) -> float:
        """Mass with the items put into it [kg]."""
        return self.printed_kg + self.extra_kg


def printed_kg(
    solid: Manifold, infill: float, material: Material, printer: Printer, necks: Manifold | None = None
) -> float:
    """Return the mass of a printed solid: a solid shell, solid necks, and a partly filled inside [kg]."""
    volume = solid.volume()
    full = solid.surface_area() * printer.shell_mm
    if necks is not None:
        full += max(0.0, necks.volume() - necks.surface_area() * printer.shell_mm)
    shell = min(volume, full) if printer.shell_mm else volume
    return float((shell + infill * (volume - shell)) * 1e-9 * material.density_kg_m3)


def weigh(
    piece: Manifold,
    simulated_kg: float,
    extra_kg: float,
    material: Material,
    printer: Printer,
    necks: Manifold | None = None,
    *,
    infill: float | None = None,
) -> Weight:
    """Return the infill with which a piece is closest to the simulated mass, or a given infill, and its masses.

    Args:
        piece: Solid of the piece.
        simulated_kg: Mass of its bodies in simulation.
        extra_kg: Mass of the items put into it: rods, screws.
        material: Material of the piece.
        printer: Printer; its shell thickness is always solid.
        necks: Portion that must be solid because it bends.
        infill: Infill of a part whose mass does not matter; None finds the one with the simulated mass. A printer of
            solid parts fills everything.
    """
    count = round((1 - LEAST_INFILL) / _STEP) + 1
    steps = [LEAST_INFILL + _STEP * number for number in range(count)] if infill is None else [infill]
    if not printer.shell_mm:
        steps = [1.0]
    masses = {infill: printed_kg(piece, infill, material, printer, necks) for infill in steps}
    best = min(masses, key=lambda infill: abs(masses[infill] + extra_kg - simulated_kg))
    return Weight(round(best, 2), masses[best], simulated_kg, extra_kg)
