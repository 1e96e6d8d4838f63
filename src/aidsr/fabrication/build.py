"""Computation of a robot build from MJCF: material, hinges, parts, their weight and checks, and winches."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from manifold3d import Manifold

from aidsr.core.artifacts import Fault, ValidationReport
from aidsr.fabrication.anatomy import Anatomy, Vector, read_anatomy
from aidsr.fabrication.checks import Print, to_print
from aidsr.fabrication.cut_parts import Piece, distinct
from aidsr.fabrication.deduplicate import moments, same_shape
from aidsr.fabrication.hinges import Hinges, design_hinges
from aidsr.fabrication.inspect_parts import Passage, duct_faults, overlap_faults, passages
from aidsr.fabrication.materials import Line, Material, lines, material_for, sheath_for
from aidsr.fabrication.printers import Printer
from aidsr.fabrication.routing import SHEATH_SEAT_MM, Bore, bore_for, routing_faults
from aidsr.fabrication.shape_parts import Shaping, shape
from aidsr.fabrication.skeleton import Skeleton
from aidsr.fabrication.solids import Triangles
from aidsr.fabrication.stations import Drum, seat_of, spool, station
from aidsr.fabrication.unsupported import unsupported_faults
from aidsr.fabrication.weight import LEAST_INFILL, Weight, weigh
from aidsr.fabrication.winches import Demand, Winch, choose_winches, demands, winch_faults

_SAME_MASS = 0.02
"""Largest relative difference between the simulated masses of copies of one part. Our choice: less than a step of
infill."""


@dataclass(frozen=True)
class PrintedPart:
    """One kind of printed part, printed once or several times.

    Attributes:
        name: File name without extension.
        title: Its name in words; `name` has no spaces, and the number of copies at its end.
        what: "robot", "station" or "spool".
        material: Material it is printed from.
        used_for: Names of the pieces of the robot, or of the actuators, it is used for; one for each copy.
        lying: The part in its orientation on the bed, with the results of the checks.
        full: Portion that must be printed solid, in the same orientation; None where there is none.
        weight: Its mass and infill.
    """

    name: str
    title: str
    what: str
    material: Material
    used_for: tuple[str, ...]
    lying: Print
    full: Triangles | None
    weight: Weight


@dataclass(frozen=True)
class RobotBuild:
    """The parts and winches of a robot; `faults` lists what cannot be built."""

    anatomy: Anatomy
    skeleton: Skeleton
    material: Material
    printer: Printer
    hinges: Hinges
    shaping: Shaping
    bores: tuple[Bore, ...]
    winches: tuple[Winch, ...]
    passages: tuple[Passage, ...]
    parts: tuple[PrintedPart, ...]

    @property
    def robot_parts(self) -> tuple[PrintedPart, ...]:
        """The pieces of the robot itself."""
        return tuple(part for part in self.parts if part.what == "robot")

    @property
    def moving_parts(self) -> tuple[PrintedPart, ...]:
        """The pieces of the robot that are not fixed to the world."""
        parts = self.anatomy.parts
        fixed = {piece.name for piece in self.shaping.pieces if all(parts[part].held for part in piece.parts)}
        return tuple(part for part in self.robot_parts if not fixed & set(part.used_for))

    @property
    def faults(self) -> tuple[Fault, ...]:
        """All faults found while building, errors first."""
        found = [
            *routing_faults(self.anatomy),
            *unsupported_faults(self.anatomy),
            *self.hinges.faults,
            *duct_faults(self.anatomy, self.passages),
            *winch_faults(self.anatomy, self.winches),
            *_piece_faults(self),
            *overlap_faults(self.shaping.pieces),
        ]
        return tuple(sorted(found, key=lambda fault: fault.severity != "error"))


def build_robot(
    mjcf: str,
    reports: Sequence[ValidationReport],
    printer: Printer,
    *,
    material: str | None = None,
) -> RobotBuild:
    """Build a robot from the first of the materials whose hinges have the fewest errors.

    Args:
        mjcf: MJCF of the robot alone.
        reports: Reports of the validator on the robot alone and in its scene; they give the winches' requirements.
        printer: Printer for all parts.
        material: Name of a material; None tries all materials of the printer.

    Raises:
        UserError: The printer has no such material.
        MjcfError: The robot cannot be loaded.
    """
    choices = material_for(printer, material)
    anatomy = read_anatomy(mjcf)
    demands_by_actuator = demands(anatomy, reports)
    used = _lines(anatomy, demands_by_actuator)
    bores = tuple(bore_for(line, sheath_for(line), printer) for line in used)
    skeleton = Skeleton(anatomy, max((bore.outside_mm for bore in bores), default=0.0))
    designed = [(choice, design_hinges(anatomy, skeleton, choice)) for choice in choices]
    chosen, hinges = min(designed, key=lambda pair: len([f for f in pair[1].faults if f.severity == "error"]))
    return _build(anatomy, skeleton, chosen, hinges, demands_by_actuator, used, bores, printer)


def _lines(anatomy: Anatomy, demands_by_actuator: dict[str, Demand]) -> tuple[Line, ...]:
    """Return the line of each cable; the thinnest line where none is chosen."""
    first = {winch.cable: winch.line for winch in choose_winches(anatomy, demands_by_actuator, {})}
    return tuple(first.get(index) or lines()[0] for index in range(len(anatomy.cables)))


def _build(
    anatomy: Anatomy,
    skeleton: Skeleton,
    material: Material,
    hinges: Hinges,
    demands_by_actuator: dict[str, Demand],
    used: tuple[Line, ...],
    bores: tuple[Bore, ...],
    printer: Printer,
) -> RobotBuild:
    shaping = shape(anatomy, skeleton, hinges, bores, material, printer)
    entries = {
        duct.cable: max(0.0, float(np.linalg.norm(duct.seat - duct.path[0])) - SHEATH_SEAT_MM)
        for duct in shaping.ducts
        if duct.sheathed
    }
    winches = choose_winches(anatomy, demands_by_actuator, entries)
    found = passages(shaping, bores, tuple(line.diameter_mm / 2 for line in used))
    parts = (*_robot_parts(anatomy, shaping, hinges, printer), *_bench_parts(anatomy, winches, material, printer))
    named = tuple(replace(p, name=name) for p, name in zip(parts, distinct(p.name for p in parts), strict=True))
    return RobotBuild(anatomy, skeleton, material, printer, hinges, shaping, bores, winches, found, named)


def _robot_parts(anatomy: Anatomy, shaping: Shaping, hinges: Hinges, printer: Printer) -> list[PrintedPart]:
    """Return the parts of the robot; each moving piece gets an equal share of rod mass.

    Pieces of the same shape, material and simulated mass are copies of one part: another mass takes another infill.
    """
    moving = {piece.name for piece in shaping.pieces if not all(anatomy.parts[p].held for p in piece.parts)}
    rods = sum(
        math.pi * hinges.backbones[r.backbone].diameter_mm ** 2 / 4 * r.length_mm * 1e-9
        * hinges.backbones[r.backbone].rod.density_kg_m3
        for r in shaping.rods
    )  # fmt: skip
    shares = Counter(part for piece in shaping.pieces for part in piece.parts)
    groups: list[tuple[Vector, float, list[Piece]]] = []
    for piece in shaping.pieces:
        own = moments(piece.solid, anatomy.parts[piece.parts[0]])
        simulated = sum(anatomy.parts[part].mass_kg / shares[part] for part in piece.parts)
        same = (
            pieces
            for known, mass_kg, pieces in groups
            if same_shape(known, own)
            and math.isclose(mass_kg, simulated, rel_tol=_SAME_MASS)
            and pieces[0].material == piece.material
        )
        if (copies := next(same, None)) is None:
            groups.append((own, simulated, [piece]))
        else:
            copies.append(piece)
    parts = []
    for _, simulated, pieces in groups:
        piece = pieces[0]
        name = piece.name if len(pieces) == 1 else f"{piece.name}_x{len(pieces)}"
        lying, full = to_print(piece.solid, piece.up, printer, piece.necks)
        rods_kg = rods / len(moving) if piece.name in moving else 0.0
        weight = weigh(piece.solid, simulated, rods_kg, piece.material, printer, necks=piece.necks)
        names, title = tuple(p.name for p in pieces), piece.name.replace("_", " ")
        parts.append(PrintedPart(_file_name(name), title, "robot", piece.material, names, lying, full, weight))
    return parts


_BENCH_TITLES = {"station": "motor mount", "spool": "spool"}


def _bench_parts(
    anatomy: Anatomy, winches: tuple[Winch, ...], material: Material, printer: Printer
) -> list[PrintedPart]:
    """Return the stations and spools, with equal ones grouped.

    They are printed from the robot's material, or from the first that is no elastomer where the robot's is one.
    """
    stiff = max(
        material_for(printer, None), key=lambda m: (m.name == material.name and not m.elastomer, not m.elastomer)
    )
    groups: dict[tuple[str, Drum], list[Winch]] = {}
    for winch in winches:
        if winch.fit is not None:
            groups.setdefault((winch.fit.motor.name, winch.drum), []).append(winch)
    up, parts = np.array([0.0, 0.0, 1.0]), []
    for (motor, drum), group in groups.items():
        fit = group[0].fit
        if fit is None:
            continue
        seat = seat_of(fit.motor)
        label = f"{motor.split()[-1] if seat.box_mm else motor.split(',')[0].replace(':', '-')}_{drum.reach_mm:g}mm"
        names = tuple(anatomy.cables[winch.cable].actuator for winch in group)
        build: tuple[tuple[str, Manifold, float], ...] = (
            ("station", station(seat, drum, group[0].sheath, printer), LEAST_INFILL),
            ("spool", spool(seat, drum, printer), 1.0),
        )
        for what, solid, infill in build:
            lying, _ = to_print(solid, up, printer)
            mass = weigh(solid, 0.0, 0.0, stiff, printer, infill=infill)
            title = f"{_BENCH_TITLES[what]}, {motor.split(',')[0]}, spool radius {drum.reach_mm:g} mm"
            name = _file_name(f"{what}_{label}_x{len(group)}")
            parts.append(PrintedPart(name, title, what, stiff, names, lying, None, mass))
    return parts


def _piece_faults(build: RobotBuild) -> list[Fault]:
    found = []
    too_large = [part for part in build.parts if not part.lying.fits]
    sides = [build.printer.side_most(part.lying.size_mm) for part in too_large]
    side, bed = max(sides, key=lambda each: each[0] / each[1], default=(0.0, 0.0))
    for code, severity, message, limit, unit, concerned in (
        ("part_open", "error", "has a surface that is not closed", None, "", {
            part.name: 0.0 for part in build.parts if not part.lying.watertight}),
        ("part_exceeds_bed", "error", "does not fit the bed", bed, "mm", {part.name: side for part in too_large}),
        ("thin_wall", "warning", "has a wall thinner than the printer makes well", build.printer.wall_mm, "mm", {
            part.name: part.lying.wall_mm for part in build.parts if part.lying.wall_mm < build.printer.wall_mm}),
        ("part_in_pieces", "error", "falls into pieces: some shapes of a body do not touch", 1.0, "piece", {
            piece.name: float(count) for piece in build.shaping.pieces
            if (count := len(piece.solid.decompose())) > 1}),
    ):  # fmt: skip
        if concerned:
            worst = (min if code == "thin_wall" else max)(concerned.values())
            found.append(
                Fault(
                    code=code,
                    layer="realizability",
                    severity="error" if severity == "error" else "warning",
                    names=tuple(concerned),
                    measured=worst if limit is not None else None,
                    limit=limit,
                    unit=unit,
                    message=message,
                )
            )
    return found


def _file_name(name: str) -> str:
    return "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in name)
