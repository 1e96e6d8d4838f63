"""Worm: a body on the ground in sections that arch up, sag down and turn aside, so that waves carry it forward."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from lxml import etree
from pydantic import Field

from aidsr.core.artifacts import Robot
from aidsr.core.formatting import deg, mm, numeral
from aidsr.sim import beam
from aidsr.teams.rules.chain import GUIDE_CLEARANCE_M, Backbone, Cable, Chain, route_cable, uniform, write_chain
from aidsr.teams.rules.families.family import Description, Family, Is, Parameters, Suits
from aidsr.teams.rules.job import Job
from aidsr.teams.rules.mjcf_builder import MjcfBuilder, add
from aidsr.teams.rules.sizing import bending_stiffness, damping_time, more_damping, rod


class WormParameters(Parameters):
    """Parameters of a worm."""

    length_m: Annotated[float, Field(ge=0.15, le=0.8), Is("length")]
    sections: Annotated[int, Field(ge=2, le=4), Is("count")]
    segments_per_section: Annotated[int, Field(ge=3, le=8)]
    radius_m: Annotated[float, Field(ge=0.004, le=0.03), Is("thickness")]
    foot_half_width_m: Annotated[float, Field(ge=0.01, le=0.08), Is("width")]
    foot_mass_kg: Annotated[float, Field(ge=0.005, le=0.1), Is("mass")]
    """Mass of a foot, including the winches of the section behind it."""
    tension_n: Annotated[float, Field(ge=2.0, le=60.0), Is("tension")]
    bending_stiffness_n_m2: Annotated[float, Field(gt=0.0), Is("stiffness")]
    damping_time_s: Annotated[float, Field(ge=0.01, le=beam.MOST_DAMPING_TIME_S), Is("damping")]
    density_kg_m3: Annotated[float, Field(ge=200.0, le=2000.0), Is("density")]


_SHAPES = {"inchworm": (2, 6), "wave": (3, 4), "long wave": (4, 3)}
"""Number of sections, and of segments per section, of each variant: two sections arch in turn, three or four pass on a
wave."""

_FULL_BEND_RAD = 1.5
_CABLES = (("top", 180.0), ("left", 60.0), ("right", -60.0))
"""Cables of a section: name and position around the body, from straight down towards the left [deg]."""


def foot_radius(p: WormParameters) -> float:
    """Return the radius of the cross bars on which the worm stands [m]; it keeps the cables off the ground."""
    return p.radius_m + GUIDE_CLEARANCE_M + 0.0025


def size(job: Job, rng: np.random.Generator, variant: str) -> WormParameters:
    """Choose the parameters of a worm that is light enough to lift twice the weight of its own sections."""
    del job
    sections, per_section = _SHAPES[variant]
    length = rng.uniform(0.1, 0.115) * sections + (0.08 if variant == "inchworm" else 0.0)
    radius = float(rng.uniform(0.0085, 0.0105))
    tension = rng.uniform(20.0, 26.0)
    stiffness = bending_stiffness(tension, radius + GUIDE_CLEARANCE_M, length / sections, _FULL_BEND_RAD)
    density = rng.uniform(650.0, 850.0)
    return WormParameters(
        length_m=round(length, 3),
        sections=sections,
        segments_per_section=per_section,
        radius_m=round(radius, 4),
        foot_half_width_m=round(float(rng.uniform(0.028, 0.036)), 4),
        foot_mass_kg=round(float(rng.uniform(0.02, 0.03)), 4),
        tension_n=round(tension, 1),
        bending_stiffness_n_m2=round(stiffness, 5),
        damping_time_s=round(damping_time(stiffness, density, radius, length / sections, damping_ratio=0.4), 3),
        density_kg_m3=round(density),
    )


def write(p: WormParameters) -> Robot:
    """Write a worm as MJCF; it lies along +x at its resting height, its tail at the origin."""
    about = f"Worm of {p.sections} sections, {p.length_m:g} m long, driven by cables. Built-in rules, SI units."
    builder = MjcfBuilder("worm", about, p.variation)
    tail = add(builder.worldbody, "body", name="tail", pos=(0.0, 0.0, foot_radius(p)))
    add(tail, "freejoint", name="root")
    # The chain grows along its own +z. This rotation turns +z forward and the chain's +x to the ground.
    root = add(tail, "body", name="tail_end", euler=(0.0, math.pi / 2.0, 0.0))
    segments = uniform(p.sections * p.segments_per_section, p.length_m, p.radius_m, p.bending_stiffness_n_m2)
    backbone = write_chain(builder, root, Chain("seg", segments, "xy", p.damping_time_s, p.density_kg_m3))
    for section in range(1, p.sections + 1):
        first, last = (section - 1) * p.segments_per_section + 1, section * p.segments_per_section
        for side, degrees in _CABLES:
            route_cable(
                builder, backbone, Cable(f"tendon_{side}_{section}", math.radians(degrees), last, p.tension_n, first)
            )
    _write_feet(builder, backbone, p)
    add(builder.sensor, "framepos", name="head_position", objtype="site", objname="head")
    add(builder.sensor, "framequat", name="tail_attitude", objtype="xbody", objname="tail")
    return Robot(mjcf=builder.text(), functional_part="head", notes="Written by the built-in rules.")


def _write_feet(builder: MjcfBuilder, backbone: Backbone, p: WormParameters) -> None:
    """Add a cross bar at the tail, between sections and at the head."""
    for number in range(p.sections + 1):
        link = backbone.links[number * p.segments_per_section]
        at = p.length_m / len(backbone.chain.segments) / 2.0 if number else 0.0
        material = "working" if number == p.sections else "base"
        _write_foot(link, f"foot{number}", at, p, material)
        add(builder.sensor, "touch", name=f"foot{number}_contact", site=f"foot{number}_touch")
    add(backbone.tip, "site", name="head", pos=(0.0, 0.0, backbone.tip_at_m), size=(0.003,), material="working")


def _write_foot(link: etree._Element, name: str, at_m: float, p: WormParameters, material: str) -> None:
    half = p.foot_half_width_m
    bar = (0.0, -half, at_m, 0.0, half, at_m)
    add(
        link,
        "geom",
        name=name,
        type="capsule",
        size=(foot_radius(p),),
        fromto=bar,
        mass=p.foot_mass_kg,
        material=material,
    )
    touched = (foot_radius(p) * 1.1, half + foot_radius(p), foot_radius(p) * 1.1)
    add(link, "site", name=f"{name}_touch", type="box", size=touched, pos=(0.0, 0.0, at_m), rgba="0 0 0 0")


def describe(p: WormParameters, job: Job) -> Description:
    """Describe the parameters in words."""
    del job
    kind = "Inchworm" if p.sections == 2 else f"{numeral(p.sections).capitalize()}-section worm"
    gait = "two sections arch in turn" if p.sections == 2 else "a wave of arches runs along the body"
    return Description(
        name=f"{kind}, {mm(p.length_m)}",
        morphology=(
            f"A body of {mm(p.length_m)}, {mm(2 * p.radius_m)} thick, in {numeral(p.sections)} sections of "
            f"{mm(p.length_m / p.sections)} with {p.segments_per_section} segments each, as stiff as "
            f"{rod(p.bending_stiffness_n_m2)}. It stands on {numeral(p.sections + 1)} cross bars of "
            f"{mm(2 * p.foot_half_width_m)} that keep it from rolling over and carry the winches, "
            f"{1000 * p.foot_mass_kg:.0f} g each."
        ),
        actuation=(
            f"Three cables a section with winches of at most {p.tension_n:.0f} N: one along the back lifts its "
            "ends, two low at the sides together arch its middle up, and one of them alone turns the body aside."
        ),
        rationale=(
            "Ground friction is the same in all directions, so it moves by lifting what it carries forward and "
            f"standing on the rest: {gait}. Full tension bends a section by {deg(_FULL_BEND_RAD)}."
        ),
    )


def reinforce(p: WormParameters) -> WormParameters:
    """Return the parameters of a stiffer worm with wider feet, more damping and more tension."""
    return p.model_copy(
        update={
            "tension_n": round(min(p.tension_n * 1.1, 60.0), 1),
            "bending_stiffness_n_m2": round(p.bending_stiffness_n_m2 * 1.2, 5),
            "damping_time_s": more_damping(p.damping_time_s),
            "foot_half_width_m": round(min(p.foot_half_width_m * 1.15, 0.08), 4),
            "variation": p.variation + 1,
        }
    )


WORM = Family(
    name="worm",
    doc="A body on the ground in sections that arch up, sag down and turn aside, so that waves carry it forward.",
    jobs={
        "crawl": Suits(("inchworm", "wave", "long wave"), rank=2),
        "squeeze": Suits(("wave", "inchworm", "long wave"), rank=1),
    },
    parameters=WormParameters,
    size=size,
    write=write,
    describe=describe,
    reinforce=reinforce,
)
