"""Rule for bodies with a density that no material has."""

from __future__ import annotations

from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.solids import volume_m3

DENSITY_LOW_KG_M3 = 5.0
DENSITY_HIGH_KG_M3 = 23_000.0
"""Density range of materials: from the lightest foam to the densest solid (osmium, 22,590 kg/m3)."""


def densities_kg_m3(robot: RobotUnderTest) -> dict[int, float]:
    """Return the mass / volume of each body of the robot whose geoms all have a known volume [kg/m3], by body id."""
    model = robot.model
    found: dict[int, float] = {}
    for body in robot.structure.bodies:
        geoms = [geom for geom in robot.structure.geoms if int(model.geom_bodyid[geom]) == body]
        volumes = [volume for geom in geoms if (volume := volume_m3(model, geom)) is not None]
        if volumes and len(volumes) == len(geoms) and model.body_mass[body] != 0:
            found[body] = float(model.body_mass[body]) / sum(volumes)
    return found


def _find_implausible_densities(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find moving bodies lighter than foam or denser than osmium. The mass of a body that cannot move has no effect."""
    odd = {
        robot.body(body): density
        for body, density in densities_kg_m3(robot).items()
        if body in robot.structure.moving and not DENSITY_LOW_KG_M3 <= density <= DENSITY_HIGH_KG_M3
    }
    if odd:
        worst = max(odd.values(), key=lambda density: max(density / DENSITY_HIGH_KG_M3, DENSITY_LOW_KG_M3 / density))
        heavy = worst > DENSITY_HIGH_KG_M3
        yield IMPLAUSIBLE_DENSITY.fault(
            names=tuple(odd),
            measured=worst,
            limit=DENSITY_HIGH_KG_M3 if heavy else DENSITY_LOW_KG_M3,
            message="mass / volume of its geoms is " + ("more than" if heavy else "less than") + " any solid has",
        )


IMPLAUSIBLE_DENSITY = Rule(
    code="implausible_density",
    stage=Stage.DRAWING,
    finds="A moving body is lighter than foam or denser than any solid.",
    why="A mass that no material has makes forces and inertias that no built robot has; mostly a mass does not fit "
    "the size.",
    limit=f"mass / volume of a body's geoms: {DENSITY_LOW_KG_M3:g} to {DENSITY_HIGH_KG_M3:,.0f} kg/m3",
    check=_find_implausible_densities,
    unit="kg/m3",
    cure="Give geoms a density (printed plastic 1,200, silicone 1,100, aluminium 2,700) instead of a mass.",
    example=Example((('<geom name="g6"/>', '<geom name="g6" size="0.001 0.002"/>'),)),
)
