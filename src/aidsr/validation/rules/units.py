"""Rules for wrong units: lengths not in metres, masses not in kilograms, gravity not in m/s2."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2
from aidsr.validation.consequences import COLLAPSE, FALL, NO_MOTION, SHAKING
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.rules.density import DENSITY_HIGH_KG_M3, densities_kg_m3

LENGTH_LOW_M, LENGTH_HIGH_M = 0.005, 10.0
"""Range of the characteristic length of cable-driven robots: catheters have millimetres, the longest arms a few
metres."""
_GRAVITY_LOW, _GRAVITY_HIGH = 0.1, 3.0
"""Range of gravity / standard gravity. The moon has 0.17 and no planet with a solid surface more than 2.5. Zero gravity
is allowed too."""


_KNOWN_SHARE = 0.5
"""Mass of the bodies with known volume / mass of all, above which these bodies represent the robot. Our choice: in a
robot made of meshes only a few small parts have a known volume."""


def _find_wrong_length(robot: RobotUnderTest) -> Iterator[Fault]:
    if not LENGTH_LOW_M <= robot.length_m <= LENGTH_HIGH_M:
        large = robot.length_m > LENGTH_HIGH_M
        yield LENGTH_UNIT.fault(
            "no such robot is that long" if large else "no such robot is that short",
            measured=robot.length_m,
            limit=LENGTH_HIGH_M if large else LENGTH_LOW_M,
            likely_cause="lengths are written in millimetres; MuJoCo has no units, AID-SR takes metres"
            if large
            else "",
        )


LENGTH_UNIT = Rule(
    code="length_unit",
    stage=Stage.RANGES,
    finds="The robot is longer or shorter than any of its kind.",
    why="With lengths in millimetres its weight, its stiffness and its forces do not fit each other.",
    limit=f"characteristic length: {LENGTH_LOW_M:g} to {LENGTH_HIGH_M:g} m",
    check=_find_wrong_length,
    unit="m",
    cure="Write all positions and sizes in metres.",
    explains=(*COLLAPSE, *FALL, *SHAKING, *NO_MOTION, "implausible_density"),
    example=Example(
        (
            ('pos="0 0 0.025"', 'pos="0 0 25"'),
            ('size="0.011 0.012" pos="0 0 0.0125"', 'size="11 12" pos="0 0 12.5"'),
            ('0.009 0 0.0125"', '9 0 12.5"'),
        )
    ),
)


def _find_wrong_masses(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find robots whose median body is denser than any solid; single bodies are faults of `implausible_density`."""
    moving = robot.structure.moving
    densities = {body: density for body, density in densities_kg_m3(robot).items() if body in moving}
    median = float(np.median(list(densities.values()))) if densities else 0.0
    known_kg = float(robot.model.body_mass[list(densities)].sum())
    if median > DENSITY_HIGH_KG_M3 and known_kg > _KNOWN_SHARE * robot.structure.mass_kg:
        yield MASS_UNIT.fault(
            "mass / volume of the median body",
            names=(robot.body(body) for body, density in densities.items() if density > DENSITY_HIGH_KG_M3),
            measured=median,
            limit=DENSITY_HIGH_KG_M3,
            likely_cause="masses are written in grams, or sizes are too small",
        )


MASS_UNIT = Rule(
    code="mass_unit",
    stage=Stage.RANGES,
    finds="Most bodies are denser than any solid.",
    why="With masses in grams a robot is a thousand times too heavy for its cables and springs.",
    limit=f"median of mass / volume over the robot's bodies: at most {DENSITY_HIGH_KG_M3:,.0f} kg/m3, where the bodies "
    "whose geoms have a volume make up half of its mass",
    check=_find_wrong_masses,
    unit="kg/m3",
    cure="Write masses in kilograms, or give geoms a density instead.",
    explains=(*COLLAPSE, *NO_MOTION, "implausible_density"),
    example=Example((('mass="0.01"', 'mass="10"'), ('mass="0.05"', 'mass="50"'))),
)


def _find_odd_gravity(robot: RobotUnderTest) -> Iterator[Fault]:
    gravity_m_s2 = float(np.linalg.norm(robot.model.opt.gravity))
    share = gravity_m_s2 / STANDARD_GRAVITY_M_S2
    if gravity_m_s2 and not _GRAVITY_LOW <= share <= _GRAVITY_HIGH:
        yield ODD_GRAVITY.fault(
            "gravity of the document's option",
            measured=gravity_m_s2,
            limit=(_GRAVITY_HIGH if share > 1 else _GRAVITY_LOW) * STANDARD_GRAVITY_M_S2,
            likely_cause="it is written in mm/s2" if share > 100 else "",
        )


ODD_GRAVITY = Rule(
    code="odd_gravity",
    stage=Stage.RANGES,
    finds="Gravity is far from that of any place where a robot works.",
    why="Everything that is measured in weights then says nothing about a real robot. No gravity at all is a choice.",
    limit=f"gravity: 0, or {_GRAVITY_LOW:g} to {_GRAVITY_HIGH:g} times {STANDARD_GRAVITY_M_S2:g} m/s2",
    check=_find_odd_gravity,
    unit="m/s2",
    cure='Leave gravity out of <option>, or write gravity="0 0 -9.81".',
    explains=(*COLLAPSE, *FALL, *SHAKING, *NO_MOTION),
    example=Example((('timestep="0.002"', 'timestep="0.002" gravity="0 0 -9810"'),)),
)
