"""Arm: a fixed backbone in one to three sections, each bent to every side by its own cables."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from aidsr.core.artifacts import Robot
from aidsr.core.formatting import deg, mm, numeral
from aidsr.sim import beam
from aidsr.teams.rules.chain import GUIDE_CLEARANCE_M, Cable, Chain, route_cable, uniform, write_chain
from aidsr.teams.rules.families.family import Description, Family, Is, Parameters, Preference, Suits
from aidsr.teams.rules.job import Job
from aidsr.teams.rules.mjcf_builder import MjcfBuilder
from aidsr.teams.rules.orientation import Orientation, lean_aside
from aidsr.teams.rules.parts import HOOK_RADIUS_M, HOOK_SHAFT_M, add_base, add_hook, add_pad, add_tip_sensors
from aidsr.teams.rules.sizing import bending_stiffness, damping_time, more_damping, reach_length, rod

_SECTION_NAMES = {1: ("arm",), 2: ("proximal", "distal"), 3: ("proximal", "middle", "distal")}


class ArmParameters(Parameters):
    """Parameters of an arm."""

    length_m: Annotated[float, Field(ge=0.1, le=0.8), Is("length")]
    sections: Annotated[int, Field(ge=1, le=3), Is("count")]
    segments_per_section: Annotated[int, Field(ge=4, le=12)]
    cables_per_section: Annotated[int, Field(ge=2, le=4)]
    radius_m: Annotated[float, Field(ge=0.004, le=0.03), Is("thickness")]
    tension_n: Annotated[float, Field(ge=2.0, le=60.0), Is("tension")]
    bending_stiffness_n_m2: Annotated[float, Field(gt=0.0), Is("stiffness")]
    damping_time_s: Annotated[float, Field(ge=0.01, le=beam.MOST_DAMPING_TIME_S), Is("damping")]
    density_kg_m3: Annotated[float, Field(ge=200.0, le=2000.0), Is("density")]
    pad_radius_m: Annotated[float, Field(ge=0.004, le=0.04)]
    hook_m: Annotated[float, Field(ge=0.0, le=0.08)] = 0.0
    """Length of a hook at the tip, across the backbone; 0 for a round pad."""


_SHAPES = {
    "two sections": (2, 7, 3),
    "three sections": (3, 5, 3),
    "four cables": (2, 7, 4),
    "three sections, four cables": (3, 5, 4),
    "hook": (2, 6, 3),
}
"""Number of sections, of segments per section and of cables per section of each variant; with 12 to 15 segments a joint
bends by less than 0.35 rad."""

_FULL_BEND_RAD = {
    "two sections": 2.3,
    "three sections": 1.8,
    "four cables": 2.3,
    "three sections, four cables": 1.8,
    "hook": 1.0,
}
"""Bend of one section at full tension [rad]. Our choice: well over a quarter turn for the whole arm, below the limits
of the joints; a hook needs a stiff arm that hardly sags."""


_LONG_TENSION = 1.7
"""Factor on the tension of an arm that lies along something: it is twice as long, and sags unless it is stiffer and
pulled harder. Our choice: with 1.5 times the tension and stiffness arms of 0.44 m no longer collapse in the validator,
with 1.7 times those of 0.5 m."""


_HOOK_RANGE_M = (0.018, 0.022)
"""Range of the length of a hook [m]. Our choice: it holds a bar of 12 mm and still comes off it. With hooks of 28 to
34 mm, policies got stuck behind the first handle that they had pushed shut."""


def size(job: Job, rng: np.random.Generator, variant: str) -> ArmParameters:
    """Choose the parameters of an arm that reaches the target, see `reach_length`."""
    sections, per_section, cables = _SHAPES[variant]
    length = reach_length(job, rng) - (HOOK_SHAFT_M + HOOK_RADIUS_M if variant == "hook" else 0.0)
    count = sections * per_section
    # Links that do not overlap across a joint need a radius below half their length.
    radius = float(np.clip(0.42 * length / count, 0.005, 0.012)) * rng.uniform(0.9, 1.0)
    tension = rng.uniform(24.0, 32.0) * (_LONG_TENSION if job.kind == "conform" else 1.0)
    offset = radius + GUIDE_CLEARANCE_M
    stiffness = bending_stiffness(tension, offset, length / sections, _FULL_BEND_RAD[variant])
    density = rng.uniform(350.0, 450.0) if variant == "hook" else rng.uniform(550.0, 800.0)
    return ArmParameters(
        length_m=round(length, 3),
        sections=sections,
        segments_per_section=per_section,
        cables_per_section=cables,
        radius_m=round(radius, 4),
        tension_n=round(tension, 1),
        bending_stiffness_n_m2=round(stiffness, 5),
        damping_time_s=round(damping_time(stiffness, density, radius, length, damping_ratio=0.3), 3),
        density_kg_m3=round(density),
        pad_radius_m=round(radius * 1.25, 4),
        hook_m=round(rng.uniform(*_HOOK_RANGE_M), 3) if variant == "hook" else 0.0,
    )


def write(parameters: ArmParameters) -> Robot:
    """Write an arm as MJCF."""
    p = parameters
    count = p.sections * p.segments_per_section
    builder = MjcfBuilder(
        "arm",
        f"Arm of {p.sections} sections, {p.length_m:g} m long, driven by cables. Built-in rules, SI units.",
        p.variation,
    )
    base = add_base(builder, "base", radius_m=p.radius_m * 2.2, thickness_m=0.012)
    segments = uniform(count, p.length_m, p.radius_m, p.bending_stiffness_n_m2)
    backbone = write_chain(builder, base, Chain("seg", segments, "xy", p.damping_time_s, p.density_kg_m3))
    for cable in _cables(p):
        route_cable(builder, backbone, cable)
    if p.hook_m > 0:
        add_hook(backbone, p.hook_m)
        add_tip_sensors(builder, backbone, p.hook_m, (p.hook_m / 2.0, 0.0, backbone.tip_at_m + HOOK_SHAFT_M))
    else:
        add_pad(backbone, "tip_pad", p.pad_radius_m)
        add_tip_sensors(builder, backbone, 1.2 * p.pad_radius_m)
    return Robot(mjcf=builder.text(), functional_part="tip", notes="Written by the built-in rules.")


def _cables(p: ArmParameters) -> list[Cable]:
    """Return the cables of all sections; those of a section run along the sections before it, between their cables."""
    cables = []
    turn = 360.0 / (p.cables_per_section * p.sections)
    for section, name in enumerate(_SECTION_NAMES[p.sections]):
        for number in range(p.cables_per_section):
            degrees = round(number * 360.0 / p.cables_per_section + section * turn)
            last = (section + 1) * p.segments_per_section
            label = f"tendon_{name}_{degrees:03d}"
            cables.append(Cable(label, math.radians(degrees), last, p.tension_n))
    return cables


def describe(p: ArmParameters, job: Job) -> Description:
    """Describe the parameters in words."""
    del job
    offset = p.radius_m + GUIDE_CLEARANCE_M
    bend = beam.cable_bending(p.tension_n, offset, p.length_m / p.sections, p.bending_stiffness_n_m2)
    low, high = beam.tip_force_range(p.tension_n, offset, p.length_m)
    end = f"a hook of {mm(p.hook_m)} across" if p.hook_m else f"a round pad of {mm(2 * p.pad_radius_m)} at"
    winches, segments = p.sections * p.cables_per_section, p.sections * p.segments_per_section
    return Description(
        name=f"{numeral(p.sections).capitalize()}-section arm{' with a hook' if p.hook_m else ''}, {mm(p.length_m)}",
        morphology=(
            f"A backbone of {mm(p.length_m)} in {p.sections} sections of {mm(p.length_m / p.sections)}, "
            f"{mm(2 * p.radius_m)} thick, modelled as {segments} segments that bend about two axes; {end} the tip. "
            f"Its bending stiffness of {p.bending_stiffness_n_m2:.3g} N m2 is that of "
            f"{rod(p.bending_stiffness_n_m2)}."
        ),
        actuation=(
            f"{winches} winches of at most {p.tension_n:.0f} N. Each section has {p.cables_per_section} cables, "
            f"evenly around the backbone and {mm(offset)} off it; those of outer sections pass the inner ones. "
            "Cables only pull."
        ),
        rationale=(
            f"Full tension bends a section by about {deg(bend)} to any side and gives {low:.1f} to {high:.1f} N at "
            "the tip."
        ),
    )


def reinforce(p: ArmParameters) -> ArmParameters:
    """Return the parameters of an arm with a stiffer backbone, more damping and more tension."""
    return p.model_copy(
        update={
            "tension_n": round(min(p.tension_n * 1.1, 60.0), 1),
            "bending_stiffness_n_m2": round(p.bending_stiffness_n_m2 * 1.2, 5),
            "damping_time_s": more_damping(p.damping_time_s),
            "variation": p.variation + 1,
        }
    )


def orient(job: Job, parameters: Mapping[str, Any]) -> Orientation:
    """Return the rotation of an arm on its mount: it leans away from a target straight in front."""
    return lean_aside(job, parameters.get("length_m", 0.0))


ARM = Family(
    name="arm",
    doc="A fixed backbone in one to three sections, each bent to every side by its own cables.",
    jobs={
        "reach": Suits(("two sections", "three sections", "four cables"), rank=1),
        "brush": Suits(("two sections", "three sections", "four cables"), rank=2),
        "conform": Suits(("three sections", "three sections, four cables"), rank=1),
        "insert": Suits(("two sections", "three sections"), rank=1),
        "pull": Suits(
            ("hook",),
            rank=1,
            preferred=(Preference("", "a short stiff hook holds a bar and comes off it again"),),
        ),
    },
    parameters=ArmParameters,
    size=size,
    write=write,
    describe=describe,
    reinforce=reinforce,
    orient=orient,
)
