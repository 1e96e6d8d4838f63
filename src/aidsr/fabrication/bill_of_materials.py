"""Bill of materials: motors, what drives them, rods, lines, sheaths, small parts and plastic, with known prices."""

from __future__ import annotations

import math
from collections import Counter, defaultdict

from aidsr.core.artifacts import Artifact
from aidsr.core.formatting import counted
from aidsr.fabrication.build import RobotBuild
from aidsr.fabrication.shape_parts import FLANGE_SCREWS
from aidsr.fabrication.stations import HORN_SCREWS, seat_of


class Item(Artifact):
    """One line of the bill of materials."""

    what: str
    amount: str
    used_for: str
    cost_usd: float | None
    """Cost of the whole amount; None where no price is known."""
    source: str = ""


def bill(build: RobotBuild) -> tuple[Item, ...]:
    """Return all items to buy."""
    return (*_motors(build), *_electronics(build), *_rods(build), *_lines(build), *_small(build), *_plastic(build))


def _motors(build: RobotBuild) -> list[Item]:
    groups: dict[str, list[str]] = defaultdict(list)
    motors = {}
    for winch in build.winches:
        if winch.fit is not None:
            motors[winch.fit.motor.name] = winch.fit.motor
            groups[winch.fit.motor.name].append(build.anatomy.cables[winch.cable].actuator)
    return [
        Item(
            what=f"motor {name}, {motors[name].voltage_v:g} V",
            amount=str(len(used)),
            used_for=", ".join(used),
            cost_usd=None if (price := motors[name].price_usd) is None else round(len(used) * price, 2),
            source=motors[name].source,
        )
        for name, used in groups.items()
    ]


def _electronics(build: RobotBuild) -> list[Item]:
    """Return power supplies and adapters; they have no price, because the currents of the motors are not known here."""
    motors = [winch.fit.motor for winch in build.winches if winch.fit is not None]
    volts = Counter(motor.voltage_v for motor in motors)
    makers = Counter(motor.name.split()[0] for motor in motors)
    return [
        *(
            Item(what=f"power supply of {volt:g} V", amount="1", used_for=counted(count, "motor"), cost_usd=None)
            for volt, count in volts.items()
        ),
        *(
            Item(
                what=f"adapter from USB to {maker} motors", amount="1", used_for=counted(count, "motor"), cost_usd=None
            )
            for maker, count in makers.items()
        ),
    ]


def _rods(build: RobotBuild) -> list[Item]:
    lengths: dict[tuple[str, float], list[float]] = defaultdict(list)
    stock = {}
    for rod in build.shaping.rods:
        backbone = build.hinges.backbones[rod.backbone]
        stock[backbone.rod.label] = backbone.rod
        lengths[(backbone.rod.label, backbone.diameter_mm)].append(rod.length_mm)
    return [
        Item(
            what=f"{label}, {diameter:g} mm",
            amount=f"{len(cut)} pieces: " + ", ".join(f"{n} x {mm:.0f} mm" for mm, n in _counted(cut)),
            used_for="backbones",
            cost_usd=round(sum(cut) / 1000 * stock[label].cost_usd_m, 2),
            source=stock[label].source,
        )
        for (label, diameter), cut in lengths.items()
    ]


def _counted(lengths: list[float]) -> list[tuple[int, int]]:
    rounded = [round(length) for length in lengths]
    return [(length, rounded.count(length)) for length in sorted(set(rounded))]


def _lines(build: RobotBuild) -> list[Item]:
    items: list[Item] = []
    cut: dict[str, float] = defaultdict(float)
    lines = {winch.line.label: winch.line for winch in build.winches if winch.line is not None}
    sheaths: dict[str, list[float]] = defaultdict(list)
    tubes = {winch.sheath.label: winch.sheath for winch in build.winches}
    for winch in build.winches:
        sheaths[winch.sheath.label].append(winch.sheath_mm)
        if winch.line is not None:
            cut[winch.line.label] += winch.cut_mm
    for label, total in cut.items():
        cost = round(total / 1000 * lines[label].cost_usd_m, 2)
        metres = f"{math.ceil(total / 100) / 10:g} m"
        items.append(Item(what=label, amount=metres, used_for="cables", cost_usd=cost, source=lines[label].source))
    for label, pieces in sheaths.items():
        cost = round(sum(pieces) / 1000 * tubes[label].cost_usd_m, 2)
        amount = f"{len(pieces)} x {pieces[0]:.0f} mm"
        items.append(Item(what=label, amount=amount, used_for="sheaths", cost_usd=cost, source=tubes[label].source))
    return items


def _small(build: RobotBuild) -> list[Item]:
    """Return small parts; board, glue and the horns' screws have no price: sizes or amounts are not computed."""
    ends, seats = len(build.winches), [seat_of(winch.fit.motor) for winch in build.winches if winch.fit]
    straps, horns = sum(seat.box_mm is not None for seat in seats), sum(seat.face is None for seat in seats)
    screws = {"motor mounts": 4 * len(build.winches), "foot": FLANGE_SCREWS if build.shaping.flange_mm else 0}
    used_for = ", ".join(place for place, count in screws.items() if count)
    return [
        Item(what=what, amount=str(count), used_for=places, cost_usd=round(0.1 * count, 2))
        for what, count, places in (
            ("crimp sleeve or bead, 2 mm", ends, "tied ends"),
            ("screw M4 x 12", sum(screws.values()), used_for),
            ("cable tie, at most 5 mm wide", straps, "motors in their mounts"),
        )
        if count
    ] + [
        Item(what=what, amount=str(count), used_for=places, cost_usd=None)
        for what, count, places in (
            ("screw for the horn or output flange of a motor", HORN_SCREWS * horns, "spools"),
            ("board", min(ends, 1), "motor mounts"),
            _glue(build),
        )
        if count
    ]


def _glue(build: RobotBuild) -> tuple[str, int, str]:
    """Return the glue that the sheet's steps call for, how many packs of it, and what for."""
    places = ["cut pieces"] if any(piece.cut for piece in build.shaping.pieces) else []
    if build.shaping.rods:
        return "cyanoacrylate or epoxy", 1, ", ".join([*places, "rods"])
    if build.material.elastomer:
        return "cyanoacrylate with primer for elastomers", 1, ", ".join([*places, "limbs"])
    return "cyanoacrylate", len(places), ", ".join(places)


def _plastic(build: RobotBuild) -> list[Item]:
    masses: dict[str, float] = defaultdict(float)
    used = {part.material.label: part.material for part in build.parts}
    for part in build.parts:
        masses[part.material.label] += part.weight.printed_kg * len(part.used_for)
    return [
        Item(
            what=f"{label} to print",
            amount=f"{1000 * mass:.0f} g",
            used_for="printed parts, without support",
            cost_usd=round(mass * used[label].cost_usd_kg, 2),
            source=used[label].source,
        )
        for label, mass in masses.items()
    ]
