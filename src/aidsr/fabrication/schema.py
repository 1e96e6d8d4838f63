"""The files of an export: verdict.json and parts.json.

Reading an export needs no library of solids.
"""

from __future__ import annotations

from typing import Literal

from aidsr.core.artifacts import Artifact, Fault

MARK = "verdict.json"
"""File by which a folder is known to be an export, and may be replaced by the next."""

REACH_TOLERANCE = 0.1
"""Largest relative difference of the largest displacement. Source: what the project asks of a built robot."""

BUILDING_LAYERS = ("scope", "realizability")
"""Layers whose faults say what cannot be built of cables, winches and printed limbs."""


def motion_errors(faults: tuple[Fault, ...]) -> tuple[Fault, ...]:
    """Return the errors in how a robot moves, which do not bear on whether it can be built."""
    return tuple(fault for fault in faults if fault.severity == "error" and fault.layer not in BUILDING_LAYERS)


class Change(Artifact):
    """Something in which the built robot differs from the simulated one."""

    what: str
    simulated: str
    built: str


class Retest(Artifact):
    """The robot as built, beside the robot as designed, both driven by the validator."""

    stable: bool
    """Whether the robot as built moves without a fault: no errors among `motion_faults`."""
    reach_m: float
    """Largest displacement in any test, by one actuator or several."""
    designed_reach_m: float
    """The same of the robot as designed."""
    faults: tuple[Fault, ...]
    designed_faults: tuple[Fault, ...] = ()
    success_share: float | None = None
    """Of the trained policy, in the scene with the robot as built; None where none was tried."""
    designed_success_share: float | None = None

    @property
    def motion_faults(self) -> tuple[Fault, ...]:
        """Errors in how the robot as built moves, which decide `stable`."""
        return motion_errors(self.faults)

    @property
    def building_faults(self) -> tuple[Fault, ...]:
        """Errors in its cables, winches and parts, which the verdict weighs with the rest of the export."""
        return tuple(fault for fault in self.faults if fault.severity == "error" and fault.layer in BUILDING_LAYERS)

    @property
    def motion(self) -> str:
        """How the robot as built moves, in words; the rest of its faults is told under the verdict."""
        return "moves without a fault" if self.stable else "has faults of motion"

    @property
    def same_reach(self) -> bool:
        """Whether the largest displacement is within tolerance."""
        return abs(self.reach_m - self.designed_reach_m) <= REACH_TOLERANCE * self.designed_reach_m


class Verdict(Artifact):
    """Whether a robot can be built, with reasons, changes, mass and cost."""

    verdict: Literal["buildable", "buildable with changes", "not buildable"]
    reasons: tuple[Fault, ...]
    """Errors keep it from being built; warnings are to be watched."""
    changes: tuple[Change, ...]
    printer: str
    material: str
    simulated_g: float
    """Mass of what is printed, and of the rods in it, as simulated."""
    built_g: float
    moving_simulated_g: float
    """The same without pieces that hold still."""
    moving_built_g: float
    winches_g: float | None
    """Mass of the motors, which stand beside the robot; None where one is unknown."""
    cost_usd: float
    """Of all that has a price; `unpriced` has none."""
    unpriced: tuple[str, ...]
    retest: Retest | None = None


class PartEntry(Artifact):
    """One kind of part in parts.json."""

    file: str
    """Name of its files in parts/, without an ending."""
    what: str
    """ "robot", "station" or "spool"."""
    copies: int
    used_for: tuple[str, ...]
    material: str
    infill: float
    mass_g: float
    """Of its plastic."""
    simulated_g: float | None
    """None for what no simulation holds."""
    size_mm: tuple[float, float, float]
    support_cm3: float
    thinnest_wall_mm: float
    watertight: bool
    fits_bed: bool
