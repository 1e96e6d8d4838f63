"""Materials: plastics to print, and rods, lines and sheaths to buy. materials.toml gives the source of each value."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any

from aidsr.core.artifacts import Artifact
from aidsr.core.errors import UserError
from aidsr.fabrication.printers import Printer

LINE_SAFETY = 4.0
"""Breaking load of a line / its working tension. Our choice: knots halve the strength of a braided line, and using
only half of the remaining strength prevents creep."""


class Material(Artifact):
    """A plastic to print with."""

    name: str
    label: str
    printers: tuple[str, ...]
    young_modulus_pa: float
    density_kg_m3: float
    largest_strain: float
    """Largest allowed bending strain of a printed hinge."""
    elastomer: bool = False
    """Whether a whole limb is printed from it in one piece, with necks as joints."""
    cost_usd_kg: float
    source: str
    strain_source: str


class Rod(Artifact):
    """Straight round rod stock for backbones."""

    label: str
    young_modulus_pa: float
    density_kg_m3: float
    largest_strain: float
    linear_strain: float
    """Strain up to which its stiffness is constant."""
    diameters_mm: tuple[float, ...]
    cost_usd_m: float
    source: str


class Line(Artifact):
    """Cord from which cables are cut."""

    label: str
    diameter_mm: float
    breaking_n: float
    cost_usd_m: float
    source: str


class Sheath(Artifact):
    """The tube in which a cable runs from its winch to the robot."""

    label: str
    outer_mm: float
    inner_mm: float
    cost_usd_m: float
    source: str


@cache
def _table() -> dict[str, Any]:
    return tomllib.loads(files("aidsr.fabrication").joinpath("materials.toml").read_text(encoding="utf-8"))


@cache
def materials() -> tuple[Material, ...]:
    """Return all plastics in the order in which they are tried."""
    return tuple(map(Material.model_validate, _table()["material"]))


@cache
def rods() -> tuple[Rod, ...]:
    """Return all rod stock for backbones."""
    return tuple(map(Rod.model_validate, _table()["rod"]))


@cache
def lines() -> tuple[Line, ...]:
    """Return all lines, thinnest first."""
    return tuple(sorted(map(Line.model_validate, _table()["line"]), key=lambda line: line.diameter_mm))


def line_for(pull_n: float) -> Line | None:
    """Return the thinnest line that is strong enough for a tension, or None."""
    return next((line for line in lines() if line.breaking_n >= LINE_SAFETY * pull_n), None)


def sheath_for(line: Line) -> Sheath:
    """Return the narrowest sheath a line slides in."""
    tubes = sorted(map(Sheath.model_validate, _table()["sheath"]), key=lambda tube: tube.inner_mm)
    return next(tube for tube in tubes if tube.inner_mm > 1.1 * line.diameter_mm)


def material_for(printer: Printer, name: str | None) -> tuple[Material, ...]:
    """Return the plastics to try on a printer, in order: the requested one, or all that it can print.

    Raises:
        UserError: There is no such plastic, or this printer cannot print it.
    """
    fitting = tuple(material for material in materials() if printer.name in material.printers)
    if name is None:
        return fitting
    chosen = tuple(material for material in fitting if material.name == name)
    if not chosen:
        known = ", ".join(material.name for material in fitting)
        raise UserError(f'the {printer.name} printer has no material "{name}"; choose one of {known}')
    return chosen
