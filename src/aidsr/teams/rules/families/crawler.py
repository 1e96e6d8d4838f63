"""Crawler: a small trunk on four or six soft legs, each swung and lifted by its own cables."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from lxml import etree
from pydantic import Field

from aidsr.core.artifacts import ActuatorGroup, Robot
from aidsr.core.formatting import deg, mm, numeral
from aidsr.sim import beam
from aidsr.teams.rules.chain import GUIDE_CLEARANCE_M, Backbone, Cable, Chain, route_cable, uniform, write_chain
from aidsr.teams.rules.families.family import Description, Family, Is, Parameters, Preference, Suits
from aidsr.teams.rules.job import Job
from aidsr.teams.rules.mjcf_builder import MjcfBuilder, add
from aidsr.teams.rules.parts import add_pad, add_touch_sensor
from aidsr.teams.rules.sizing import bending_stiffness, damping_time, more_damping, rod


class CrawlerParameters(Parameters):
    """Parameters of a crawler."""

    legs: Annotated[int, Field(ge=4, le=6), Is("count")]
    leg_length_m: Annotated[float, Field(ge=0.03, le=0.2), Is("length")]
    segments: Annotated[int, Field(ge=3, le=8)]
    radius_m: Annotated[float, Field(ge=0.003, le=0.015), Is("thickness")]
    lean_rad: Annotated[float, Field(ge=0.0, le=1.0)]
    """Angle by which the legs lean outwards from straight down."""
    trunk_length_m: Annotated[float, Field(ge=0.04, le=0.4)]
    trunk_width_m: Annotated[float, Field(ge=0.02, le=0.2), Is("width")]
    trunk_mass_kg: Annotated[float, Field(ge=0.02, le=0.5), Is("mass")]
    cables_per_leg: Annotated[int, Field(ge=2, le=3)]
    tension_n: Annotated[float, Field(ge=2.0, le=40.0), Is("tension")]
    bending_stiffness_n_m2: Annotated[float, Field(gt=0.0), Is("stiffness")]
    damping_time_s: Annotated[float, Field(ge=0.01, le=beam.MOST_DAMPING_TIME_S), Is("damping")]
    density_kg_m3: Annotated[float, Field(ge=200.0, le=2000.0), Is("density")]

    def count_step(self, name: str) -> int:
        """Return the step of a number of parts, see `Parameters`: legs come in pairs."""
        return 2 if name == "legs" else 1


_SHAPES = {"four legs": (4, 3), "six legs": (6, 2), "four legs, two cables": (4, 2)}
"""Number of legs, and of cables per leg, of each variant."""

_FULL_BEND_RAD = 1.2
_CABLES = {2: (("front", 65.0), ("back", -65.0)), 3: (("front", 110.0), ("back", -110.0), ("lift", 0.0))}
"""Cables of a leg by their number: names, and positions around the leg, from its outer side towards the front [deg]."""

_HEIGHT_M = 0.014
"""Half height of the trunk [m]. Our choice: a row of micro winches."""


def _foot_radius(p: CrawlerParameters) -> float:
    return p.radius_m * 1.35


def rest_height(p: CrawlerParameters) -> float:
    """Return the height of the trunk's middle above the ground when all feet stand and no leg bends [m]."""
    return p.leg_length_m * math.cos(p.lean_rad) + _foot_radius(p)


def size(job: Job, rng: np.random.Generator, variant: str) -> CrawlerParameters:
    """Choose the parameters of a crawler whose legs lift their own feet, and carry the trunk almost without bending.

    Under the trunk's weight they bend by a few degrees.
    """
    del job
    legs, cables = _SHAPES[variant]
    length = float(rng.uniform(0.068, 0.084))
    radius = float(rng.uniform(0.0055, 0.0065))
    tension = rng.uniform(17.0, 22.0)
    stiffness = bending_stiffness(tension, radius + GUIDE_CLEARANCE_M, length, _FULL_BEND_RAD)
    density = rng.uniform(900.0, 1100.0)
    return CrawlerParameters(
        legs=legs,
        leg_length_m=round(length, 3),
        segments=5 if legs == 4 else 4,
        radius_m=round(radius, 4),
        lean_rad=round(float(rng.uniform(0.5, 0.7)), 3),
        trunk_length_m=round(float(rng.uniform(0.12, 0.145)) + 0.035 * (legs - 4), 3),
        trunk_width_m=round(float(rng.uniform(0.05, 0.06)), 3),
        trunk_mass_kg=round(float(rng.uniform(0.09, 0.12)) + 0.02 * (legs - 4), 3),
        cables_per_leg=cables,
        tension_n=round(tension, 1),
        bending_stiffness_n_m2=round(stiffness, 6),
        damping_time_s=round(damping_time(stiffness, density, radius, length, damping_ratio=0.5), 3),
        density_kg_m3=round(density),
    )


def feet(p: CrawlerParameters) -> list[tuple[str, float, int]]:
    """Return each leg's name, its position along the trunk [m] and its side (1 left, -1 right)."""
    rows = p.legs // 2
    names = ("front", "rear") if rows == 2 else ("front", "middle", "rear")
    half = p.trunk_length_m / 2.0 - p.radius_m
    at = [half - 2.0 * half * row / (rows - 1) for row in range(rows)]
    return [
        (f"{side}_{name}", x, sign)
        for name, x in zip(names, at, strict=True)
        for side, sign in (("left", 1), ("right", -1))
    ]


def write(p: CrawlerParameters) -> Robot:
    """Write a crawler as MJCF; it stands at its resting height and faces +x."""
    about = f"Crawler on {p.legs} soft legs of {p.leg_length_m:g} m, driven by cables. Built-in rules, SI units."
    builder = MjcfBuilder("crawler", about, p.variation)
    trunk = add(builder.worldbody, "body", name="trunk", pos=(0.0, 0.0, rest_height(p)))
    add(trunk, "freejoint", name="root")
    size = (p.trunk_length_m / 2.0, p.trunk_width_m / 2.0, _HEIGHT_M)
    add(
        trunk,
        "geom",
        name="trunk",
        type="box",
        size=size,
        pos=(0.0, 0.0, 0.3 * _HEIGHT_M),
        mass=p.trunk_mass_kg,
        material="base",
    )
    nose = (p.trunk_length_m / 2.0, 0.0, 0.3 * _HEIGHT_M)
    add(trunk, "geom", name="nose", type="sphere", size=(0.8 * _HEIGHT_M,), pos=nose, mass=0.004, material="working")
    for name, along, side in feet(p):
        backbone = _write_leg(builder, trunk, p, name, along, side)
        for cable, degrees in _CABLES[p.cables_per_leg]:
            turn = math.radians(degrees * side)
            route_cable(builder, backbone, Cable(f"tendon_{name}_{cable}", turn, p.segments, p.tension_n))
        add_pad(backbone, f"{name}_foot", _foot_radius(p))
        add_touch_sensor(builder, backbone, f"{name}_foot", 1.2 * _foot_radius(p))
    add(trunk, "site", name="trunk_center", pos=(0.0, 0.0, 0.3 * _HEIGHT_M), size=(0.003,), material="working")
    add(builder.sensor, "framepos", name="trunk_position", objtype="site", objname="trunk_center")
    add(builder.sensor, "framequat", name="trunk_attitude", objtype="xbody", objname="trunk")
    return Robot(
        mjcf=builder.text(),
        functional_part="trunk_center",
        actuator_groups=groups(p),
        notes="Written by the built-in rules.",
    )


def _write_leg(
    builder: MjcfBuilder, trunk: etree._Element, p: CrawlerParameters, name: str, along: float, side: int
) -> Backbone:
    """Write one leg: its z axis points down and outwards, its x axis outwards and up."""
    lean, drop = math.sin(p.lean_rad), math.cos(p.lean_rad)
    outwards = (0.0, side * drop, lean)
    root = add(
        trunk,
        "body",
        name=f"{name}_hip",
        pos=(along, side * p.trunk_width_m / 2.0, 0.0),
        xyaxes=(*outwards, float(side), 0.0, 0.0),
    )
    segments = uniform(p.segments, p.leg_length_m, p.radius_m, p.bending_stiffness_n_m2)
    return write_chain(
        builder, root, Chain(f"{name}_seg", segments, "xy", p.damping_time_s, p.density_kg_m3, armature_kg_m2=2e-6)
    )


def groups(p: CrawlerParameters) -> tuple[ActuatorGroup, ...]:
    """Return the groups of winches that act together.

    With six legs these are the winches of one tripod on one side, so that the crawler can still steer; with four legs
    there are no groups.
    """
    if p.legs != 6:
        return ()
    sets = {
        "a_left": ("left_front", "left_rear"),
        "a_right": ("right_middle",),
        "b_left": ("left_middle",),
        "b_right": ("right_front", "right_rear"),
    }
    return tuple(
        ActuatorGroup(name=f"{cable}_{name}", actuators=tuple(f"pull_{leg}_{cable}" for leg in legs))
        for name, legs in sets.items()
        for cable, _ in _CABLES[p.cables_per_leg]
    )


def describe(p: CrawlerParameters, job: Job) -> Description:
    """Describe the parameters in words."""
    del job
    lift = p.leg_length_m * (1.0 - math.sin(_FULL_BEND_RAD) / _FULL_BEND_RAD)
    pulls = "one lifts it forward, one lifts it back, both lift it high."
    if p.cables_per_leg == 3:
        pulls = "one swings it forward, one back, one lifts it."
    if p.legs == 6:
        pulls += " Those of a tripod act together on each side, so that few actions walk and still steer."
    return Description(
        name=f"Crawler on {numeral(p.legs)} legs, {numeral(p.cables_per_leg)} cables a leg",
        morphology=(
            f"A trunk of {mm(p.trunk_length_m)} by {mm(p.trunk_width_m)}, {1000 * p.trunk_mass_kg:.0f} g with its "
            f"winches, stands {mm(rest_height(p))} high on {numeral(p.legs)} legs of {mm(p.leg_length_m)} that "
            f"lean out by {deg(p.lean_rad)}. A leg has {p.segments} segments that bend about two axes and is as "
            f"stiff as {rod(p.bending_stiffness_n_m2)}; its foot is round."
        ),
        actuation=f"Winches of at most {p.tension_n:.0f} N, {p.cables_per_leg} cables a leg: {pulls}",
        rationale=(
            f"Full tension bends a leg by {deg(_FULL_BEND_RAD)} and lifts its foot by about {mm(lift)}, enough to "
            "swing it clear while the others stand: it needs no difference in friction between forward and back."
        ),
    )


def reinforce(p: CrawlerParameters) -> CrawlerParameters:
    """Return the parameters of a crawler with stiffer legs, more damping and more tension."""
    return p.model_copy(
        update={
            "tension_n": round(min(p.tension_n * 1.1, 40.0), 1),
            "bending_stiffness_n_m2": round(p.bending_stiffness_n_m2 * 1.25, 6),
            "damping_time_s": more_damping(p.damping_time_s),
            "variation": p.variation + 1,
        }
    )


CRAWLER = Family(
    name="crawler",
    doc="A small trunk on four or six soft legs, each swung and lifted by its own cables.",
    jobs={
        "crawl": Suits(
            ("four legs", "six legs", "four legs, two cables"),
            rank=1,
            preferred=(
                Preference(
                    r"stair|steps?\b|climb",
                    "legs are set down higher up, where a hoop rolls against a riser",
                    rank=1,
                ),
                Preference(
                    "obstacle|between|around|avoid",
                    "legs steer round what stands in the way, and a hoop cannot",
                    rank=3,
                ),
            ),
        ),
    },
    parameters=CrawlerParameters,
    size=size,
    write=write,
    describe=describe,
    reinforce=reinforce,
)
