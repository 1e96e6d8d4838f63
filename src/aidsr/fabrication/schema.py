"""Data models of the exported files verdict.json and parts.json.

This module does not import the solid-modelling library, so an export can be read without it.
"""

from __future__ import annotations

from typing import Literal

from aidsr.core.artifacts import Artifact, Fault
from aidsr.core.formatting import counted

MARK = "verdict.json"
"""File that marks a folder as an export, which a later export may replace."""

REACH_TOLERANCE = 0.1
"""Largest allowed relative difference between the largest displacements of the built and of the designed robot.
Source: the project's requirement on a built robot."""

BUILDING_LAYERS = ("scope", "realizability")
"""Layers whose faults say what cannot be built from cables, winches and printed limbs."""


def motion_errors(faults: tuple[Fault, ...]) -> tuple[Fault, ...]:
    """Return the errors in how a robot moves, without those about whether it can be built."""
    return tuple(fault for fault in faults if fault.severity == "error" and fault.layer not in BUILDING_LAYERS)


class Change(Artifact):
    """One difference between the built robot and the simulated one, in words."""

    what: str
    simulated: str
    built: str


class Retest(Artifact):
    """Comparison of the robot as built with the robot as designed, both tested by the validator."""

    stable: bool
    """Whether the robot as built moves without a fault: no errors among `motion_faults`."""
    reach_m: float
    """Largest displacement in any test, with one or several actuators driven."""
    designed_reach_m: float
    """Largest displacement of the robot as designed."""
    faults: tuple[Fault, ...]
    designed_faults: tuple[Fault, ...] = ()
    success_share: float | None = None
    """Success rate (0 to 1) of the trained policy in the scene with the robot as built; None where none was tried."""
    designed_success_share: float | None = None
    """Success rate (0 to 1) of the same policy in the scene with the robot as designed."""

    @property
    def motion_faults(self) -> tuple[Fault, ...]:
        """Errors in how the robot as built moves, which decide `stable`."""
        return motion_errors(self.faults)

    @property
    def building_faults(self) -> tuple[Fault, ...]:
        """Errors in its cables, winches and parts, which the verdict judges with the rest of the export."""
        return tuple(fault for fault in self.faults if fault.severity == "error" and fault.layer in BUILDING_LAYERS)

    @property
    def motion(self) -> str:
        """How the robot as built moves, in words; its other faults are listed under the verdict."""
        return "moves without a fault" if self.stable else "has faults of motion"

    @property
    def same_reach(self) -> bool:
        """Whether the largest displacement is within `REACH_TOLERANCE` of the designed one."""
        return abs(self.reach_m - self.designed_reach_m) <= REACH_TOLERANCE * self.designed_reach_m


class Verdict(Artifact):
    """Whether a robot can be built, with reasons, changes, mass and cost."""

    verdict: Literal["buildable", "buildable with changes", "not buildable"]
    reasons: tuple[Fault, ...]
    """Errors prevent building; warnings need attention."""
    changes: tuple[Change, ...]
    printer: str
    material: str
    simulated_g: float
    """Mass of the printed pieces and the rods in them, as simulated."""
    built_g: float
    """Mass of the printed pieces and the rods in them, as built."""
    moving_simulated_g: float
    """Simulated mass without the pieces that are fixed to the world."""
    moving_built_g: float
    """Built mass without the pieces that are fixed to the world."""
    winches_g: float | None
    """Mass of the motors, which stand beside the robot; None where the mass of one is unknown."""
    cost_usd: float
    """Total cost of all items with a known price."""
    unpriced: tuple[str, ...]
    """Items without a known price."""
    retest: Retest | None = None

    @property
    def answer(self) -> str:
        """Whether the robot can be built, in words, with the numbers of errors, differences and warnings."""
        errors = [fault for fault in self.reasons if fault.severity == "error"]
        warnings = len(self.reasons) - len(errors)
        match self.verdict:
            case "buildable":
                told = "can be built as simulated"
            case "buildable with changes":
                told = f"can be built, with {counted(len(self.changes), 'difference')} from the simulation"
            case "not buildable":
                told = f"cannot be built: {counted(len(errors), 'error')}"
        return told + f"; {counted(warnings, 'warning')}" * bool(warnings)


class PartEntry(Artifact):
    """One kind of part in parts.json."""

    file: str
    """Name of its files in parts/, without the file extension."""
    title: str = ""
    """Its name in words; empty in older exports."""
    what: str
    """ "robot", "station" (the mount of a motor) or "spool"."""
    copies: int
    used_for: tuple[str, ...]
    material: str
    infill: float
    mass_g: float
    """Mass of its plastic."""
    simulated_g: float | None
    """Mass in simulation; None for parts that are not simulated (motor mounts and spools)."""
    size_mm: tuple[float, float, float]
    support_cm3: float
    thinnest_wall_mm: float
    watertight: bool
    fits_bed: bool

    @property
    def in_words(self) -> str:
        """Its title, or its file name with spaces."""
        return self.title or self.file.replace("_", " ")
