"""What parts are made of: plastics to print, rods, lines and sheaths to buy. Each value has its source in the table."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any

from aidsr.core.artifacts import Artifact
from aidsr.core.errors import UserError
from aidsr.fabrication.printers import Printer

LINE_SAFETY = 4.0
"""Breaking load of a line / the pull it works under. Our choice: knots halve the strength of a braided line, and half
of what is left keeps it from creeping."""


class Material(Artifact):
    """A plastic for a printer."""

    name: str
    label: str
    printers: tuple[str, ...]
    young_modulus_pa: float
    density_kg_m3: float
    largest_strain: float
    """Bending strain a printed hinge may see."""
    elastomer: bool = False
    """Whether whole limbs are printed of it in one piece, with necks for joints."""
    cost_usd_kg: float
    source: str
    strain_source: str


class Rod(Artifact):
    """Straight round stock for backbones."""

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
    """What a cable is made of."""

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
    """Return all plastics, those to try first before others."""
    return tuple(map(Material.model_validate, _table()["material"]))


@cache
def rods() -> tuple[Rod, ...]:
    """Return all stock for backbones."""
    return tuple(map(Rod.model_validate, _table()["rod"]))


@cache
def lines() -> tuple[Line, ...]:
    """Return all lines, thinnest first."""
    return tuple(sorted(map(Line.model_validate, _table()["line"]), key=lambda line: line.diameter_mm))


def line_for(pull_n: float) -> Line | None:
    """Return the thinnest line that works under a pull, or None."""
    return next((line for line in lines() if line.breaking_n >= LINE_SAFETY * pull_n), None)


def sheath_for(line: Line) -> Sheath:
    """Return the narrowest sheath a line slides in."""
    tubes = sorted(map(Sheath.model_validate, _table()["sheath"]), key=lambda tube: tube.inner_mm)
    return next(tube for tube in tubes if tube.inner_mm > 1.1 * line.diameter_mm)


def material_for(printer: Printer, name: str | None) -> tuple[Material, ...]:
    """Return the plastics to try on a printer, in order: the one that was asked for, or all it can print.

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
