"""Ring: a closed loop that stands upright and rolls by changing its own shape."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field

from aidsr.core.artifacts import Robot
from aidsr.core.formatting import mm, numeral
from aidsr.sim import beam
from aidsr.teams.rules.chain import GUIDE_CLEARANCE_M, Backbone, Cable, Chain, route_cable, uniform, write_chain
from aidsr.teams.rules.families.family import Description, Family, Is, Parameters, Preference, Suits
from aidsr.teams.rules.job import Job
from aidsr.teams.rules.mjcf_builder import TIMESTEP_S, MjcfBuilder, add
from aidsr.teams.rules.sizing import bending_stiffness, damping_time, more_damping, rod


class RingParameters(Parameters):
    """Parameters of a ring."""

    radius_m: Annotated[float, Field(ge=0.015, le=0.2), Is("thickness")]
    sectors: Annotated[int, Field(ge=3, le=6), Is("count")]
    segments_per_sector: Annotated[int, Field(ge=2, le=6)]
    half_width_m: Annotated[float, Field(ge=0.015, le=0.12), Is("width")]
    thickness_m: Annotated[float, Field(ge=0.006, le=0.04), Is("thickness")]
    tread_mass_kg: Annotated[float, Field(ge=0.002, le=0.05), Is("mass")]
    """Mass of one of the cross bars on which the ring rolls."""
    tension_n: Annotated[float, Field(ge=2.0, le=60.0), Is("tension")]
    bending_stiffness_n_m2: Annotated[float, Field(gt=0.0), Is("stiffness")]
    damping_time_s: Annotated[float, Field(ge=0.01, le=beam.MOST_DAMPING_TIME_S), Is("damping")]
    density_kg_m3: Annotated[float, Field(ge=200.0, le=2000.0), Is("density")]


_SHAPES = {"four sectors": (4, 4), "five sectors": (5, 3), "six sectors": (6, 3)}
"""Number of sectors, and of segments per sector, of each variant."""

_SMALL = {"small, four sectors": (4, 2), "small, five sectors": (5, 2)}
"""The same for rings that roll under something; more than two segments would touch each other when a sector curls."""

_LOW = 0.8
"""Height of a small ring as a share of the headroom. Our choice: the egg shape that it takes is a tenth higher."""

_LOWEST_M = 0.055
"""Height of the smallest ring [m]. Our choice: its segments are then as long as its cross bars are thick."""

_FULL_BEND_RAD = 1.3
"""Bend of one sector at full tension if it were free [rad]. Our choice: it pulls the ring into a clear egg shape."""


def size(job: Job, rng: np.random.Generator, variant: str) -> RingParameters:
    """Choose the parameters of a ring that keeps its shape under its own weight and is deformed by its cables."""
    small = variant in _SMALL
    sectors, per_sector = (_SMALL if small else _SHAPES)[variant]
    radius, thickness = _small_size(job, rng) if small else (rng.uniform(0.075, 0.095), rng.uniform(0.012, 0.014))
    tension = rng.uniform(14.0, 18.0) if small else rng.uniform(18.0, 24.0)
    density = rng.uniform(700.0, 900.0)
    half_width = rng.uniform(0.032, 0.037) if small else rng.uniform(0.036, 0.044)
    tread_mass = rng.uniform(0.003, 0.005) if small else rng.uniform(0.005, 0.007)
    sector = 2.0 * math.pi * radius / sectors
    stiffness = bending_stiffness(tension, thickness / 2.0 + GUIDE_CLEARANCE_M, sector, _FULL_BEND_RAD)
    return RingParameters(
        radius_m=round(float(radius), 4),
        sectors=sectors,
        segments_per_sector=per_sector,
        half_width_m=round(float(half_width), 4),
        thickness_m=round(float(thickness), 4),
        tread_mass_kg=round(float(tread_mass), 4),
        tension_n=round(tension, 1),
        bending_stiffness_n_m2=round(stiffness, 5),
        damping_time_s=round(damping_time(stiffness, density, thickness / 2.0, sector, damping_ratio=0.4), 3),
        density_kg_m3=round(density),
    )


def _small_size(job: Job, rng: np.random.Generator) -> tuple[float, float]:
    """Choose the radius and the thickness of a ring that fits under the lowest obstacle [m]."""
    thickness = rng.uniform(0.006, 0.007)
    height = max(min(_LOW * job.headroom_m, rng.uniform(0.076, 0.084)), _LOWEST_M)
    return height / 2.0 - thickness / 2.0 - GUIDE_CLEARANCE_M, thickness


def tread_radius(p: RingParameters) -> float:
    """Return the radius of the cross bars [m]; they are thicker than the rim, so that the ring rolls on them alone."""
    return p.thickness_m / 2.0 + GUIDE_CLEARANCE_M


def write(p: RingParameters) -> Robot:
    """Write a ring as MJCF; it stands upright at its resting height and rolls towards +x."""
    count = p.sectors * p.segments_per_sector
    about = (
        f"Rolling ring of {p.radius_m:g} m radius in {p.sectors} sectors, driven by cables. Built-in rules, SI units."
    )
    builder = MjcfBuilder("ring", about, p.variation)
    rim = add(builder.worldbody, "body", name="rim", pos=(0.0, 0.0, tread_radius(p)))
    add(rim, "freejoint", name="root")
    # The chain starts at the lowest point towards +x and turns upwards; its inner side is its own -x.
    root = add(rim, "body", name="rim_start", euler=(0.0, math.pi / 2.0, 0.0))
    segments = uniform(count, _side(p.radius_m, count) * count, p.thickness_m / 2.0, p.bending_stiffness_n_m2)
    chain = Chain("seg", segments, "y", p.damping_time_s, p.density_kg_m3, rest_turn_rad=-2.0 * math.pi / count)
    backbone = write_chain(builder, root, chain)
    _close(builder, f"seg{count:02d}")
    _write_treads(backbone, p)
    for sector in range(1, p.sectors + 1):
        first, last = (sector - 1) * p.segments_per_sector + 1, sector * p.segments_per_sector
        route_cable(builder, backbone, Cable(f"tendon_sector_{sector}", math.pi, last, p.tension_n, first))
    add(rim, "site", name="rim_mark", size=(0.003,), material="working")
    add(builder.sensor, "framepos", name="rim_position", objtype="site", objname="rim_mark")
    add(builder.sensor, "framequat", name="rim_attitude", objtype="xbody", objname="rim")
    add(builder.sensor, "touch", name="tread_contact", site="rim_touch")
    touched = (tread_radius(p) * 1.2, p.half_width_m * 1.4, tread_radius(p) * 1.2)
    add(rim, "site", name="rim_touch", type="box", size=touched, rgba="0 0 0 0")
    return Robot(mjcf=builder.text(), functional_part="rim_mark", notes="Written by the built-in rules.")


def _side(radius_m: float, count: int) -> float:
    """Return the side of a regular polygon with `count` corners around a circle of this radius [m]."""
    return 2.0 * radius_m * math.tan(math.pi / count)


def _close(builder: MjcfBuilder, last: str) -> None:
    """Close the loop: join the last link to the first one by a weld."""
    builder.exclude("rim_start", last)
    add(
        builder.equality,
        "weld",
        name="loop",
        body1="rim_start",
        body2=last,
        solref=beam.solref(TIMESTEP_S),
        solimp=beam.SOLIMP,
    )


def _write_treads(backbone: Backbone, p: RingParameters) -> None:
    """Add a cross bar in the middle of every link; the first one is on the root, where the last link ends the loop."""
    half_side = backbone.chain.segments[0].length_m / 2.0
    for number, link in enumerate(backbone.links[:-1]):
        at = half_side if number else 0.0
        bar = (0.0, -p.half_width_m, at, 0.0, p.half_width_m, at)
        material = "working" if number == 0 else "base"
        name = f"tread{number + 1:02d}"
        add(
            link,
            "geom",
            name=name,
            type="capsule",
            size=(tread_radius(p),),
            fromto=bar,
            mass=p.tread_mass_kg,
            material=material,
        )


def describe(p: RingParameters, job: Job) -> Description:
    """Describe the parameters in words."""
    del job
    count = p.sectors * p.segments_per_sector
    return Description(
        name=f"Rolling ring, {numeral(p.sectors)} sectors, {mm(2 * p.radius_m)} across",
        morphology=(
            f"A closed hoop, {mm(2 * p.radius_m)} across and {mm(p.thickness_m)} thick, of {count} segments that "
            f"bend in its plane and are as stiff as {rod(p.bending_stiffness_n_m2)}. It stands upright on cross "
            f"bars {mm(2 * p.half_width_m)} wide, one a segment, which keep it from falling over."
        ),
        actuation=(
            f"{numeral(p.sectors).capitalize()} cables along its inner side, one a sector, with winches of at most "
            f"{p.tension_n:.0f} N: a shortened sector curls tighter and flattens the others."
        ),
        rationale=(
            "Squeezed into an egg that leans forward, its weight lies ahead of where it stands, so it tips and "
            "rolls; sector by sector this goes on. It goes straight and cannot steer."
        ),
    )


def reinforce(p: RingParameters) -> RingParameters:
    """Return the parameters of a stiffer, wider ring with more damping and more tension."""
    return p.model_copy(
        update={
            "tension_n": round(min(p.tension_n * 1.1, 60.0), 1),
            "bending_stiffness_n_m2": round(p.bending_stiffness_n_m2 * 1.2, 5),
            "damping_time_s": more_damping(p.damping_time_s),
            "half_width_m": round(min(p.half_width_m * 1.1, 0.12), 4),
            "variation": p.variation + 1,
        }
    )


RING = Family(
    name="ring",
    doc="A closed loop that stands upright and rolls by changing its own shape.",
    jobs={
        "crawl": Suits(
            ("four sectors", "five sectors", "six sectors"),
            rank=3,
            preferred=(
                Preference(
                    r"gap\b|ditch|trench",
                    "a hoop rolls over an opening narrower than itself, which legs step into",
                    rank=2,
                ),
            ),
        ),
        "squeeze": Suits(
            ("small, four sectors", "small, five sectors"),
            rank=2,
            preferred=(Preference("", "a small hoop is several times as fast as a worm"),),
        ),
    },
    parameters=RingParameters,
    size=size,
    write=write,
    describe=describe,
    reinforce=reinforce,
)
