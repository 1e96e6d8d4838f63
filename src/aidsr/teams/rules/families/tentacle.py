"""Tentacle: a tapering backbone that curls from the tip, to wrap round things or to point past them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from lxml import etree
from pydantic import Field

from aidsr.core.artifacts import Robot
from aidsr.core.formatting import deg, mm, numeral
from aidsr.sim import beam
from aidsr.teams.rules.chain import Cable, Chain, Segment, cable_offset_m, route_cable, write_chain
from aidsr.teams.rules.families.family import Description, Family, Is, Parameters, Preference, Suits
from aidsr.teams.rules.job import Job
from aidsr.teams.rules.mjcf_builder import MjcfBuilder, add
from aidsr.teams.rules.orientation import Orientation, angle_to_down_deg, lean_aside, looks_sideways
from aidsr.teams.rules.parts import add_base, add_pad, add_tip_sensors
from aidsr.teams.rules.sizing import damping_time, more_damping, reach_length, rod


class TentacleParameters(Parameters):
    """Parameters of a tentacle."""

    length_m: Annotated[float, Field(ge=0.1, le=0.8), Is("length")]
    segments: Annotated[int, Field(ge=8, le=20)]
    base_radius_m: Annotated[float, Field(ge=0.004, le=0.03), Is("thickness")]
    tip_radius_m: Annotated[float, Field(ge=0.002, le=0.02), Is("thickness")]
    cables: Annotated[int, Field(ge=2, le=3)]
    """2: curls in one plane; 3: bends to every side."""
    short_cables: Annotated[int, Field(ge=0, le=3)] = 0
    """Number of further cables that end half way, so that base and tip bend independently."""
    tension_n: Annotated[float, Field(ge=2.0, le=60.0), Is("tension")]
    bending_stiffness_n_m2: Annotated[float, Field(gt=0.0), Is("stiffness")]
    """Bending stiffness at the base; it falls with the square of the radius, so that the tip curls tighter."""
    damping_time_s: Annotated[float, Field(ge=0.01, le=beam.MOST_DAMPING_TIME_S), Is("damping")]
    density_kg_m3: Annotated[float, Field(ge=200.0, le=2000.0), Is("density")]
    stalk_m: Annotated[float, Field(ge=0.0, le=0.6), Is("length")] = 0.0
    """Length of a stiff post from which the tentacle leaves sideways; 0 to grow straight from the mount."""
    stalk_aside_m: Annotated[float, Field(ge=0.0, le=0.3)] = 0.0
    """Distance of that post from the mount's axis."""
    ahead: Annotated[int, Field(ge=0, le=1)] = 0
    """Direction in which a tentacle on a post curls: 1: to what is ahead of the mount; 0: around the mount's axis."""


_FULL_CURL_RAD = {"curl": 4.6, "wrap": 11.0, "space": 4.2, "two stages": 3.8, "sweep": 3.7}
"""Curl of each variant at full tension [rad]. Our choice: three quarters of a turn hook a bar; a wrap that could curl
to a third of its own size squeezes the object that stops it; a sweep uses most of its cable's tension to press on the
surface, not to bend its own springs, so that the force depends little on the distance of the surface."""

_TAPER = 0.45
_SWEEP_SEGMENTS = 10
_SWEEP_FORCE = 1.05
"""Force of a sweep's tip at full tension, hardly bent, as a share of the required force. Our choice: in a trial with
constant pulls on the benchmark's wall half the tension brushed most cells, and full tension pressed too hard."""
_FREE_AHEAD_M = 0.3
"""Length assumed to be free ahead of the mount if nothing is there [m]. Our choice."""
_WRAP_CLEARANCE_M = 0.018
"""Gap between the stretched tentacle and the widest object [m]. Our choice: the placement error of the grasping
tasks."""


def _shape(
    length_m: float, segments: int, base_radius_m: float, tip_radius_m: float, stiffness: float
) -> tuple[Segment, ...]:
    """Return segments whose length falls with their radius, as in a logarithmic spiral."""
    ratio = (tip_radius_m / base_radius_m) ** (1.0 / (segments - 1))
    radii = [base_radius_m * ratio**number for number in range(segments)]
    total = sum(radii)
    return tuple(
        Segment(length_m * radius / total, radius, stiffness * (radius / base_radius_m) ** 2) for radius in radii
    )


def _curl(shape: tuple[Segment, ...], tension_n: float) -> float:
    """Return the angle by which one cable along the whole tentacle curls it [rad]."""
    return sum(
        beam.cable_bending(tension_n, cable_offset_m(part), part.length_m, part.bending_stiffness_n_m2)
        for part in shape
    )


def size(job: Job, rng: np.random.Generator, variant: str) -> TentacleParameters:
    """Choose the parameters of a tentacle that reaches past the target, wraps it from beside it, or sweeps over it.

    A wrap is long enough for one turn around the target.
    """
    if variant == "sweep":
        return _sample_sweep(job, rng)
    wrap = variant == "wrap"
    half = job.target.half_width_m if job.target else 0.03
    length = float(np.clip(7.4 * half, 0.15, 0.45)) * rng.uniform(1.0, 1.12) if wrap else reach_length(job, rng)
    segments = int(rng.integers(13, 16)) if wrap else 13
    base_radius = float(np.clip(length * 0.036, 0.006, 0.012)) * rng.uniform(0.95, 1.05)
    tip_radius = base_radius * _TAPER
    tension = job.pull * (rng.uniform(30.0, 36.0) if wrap else rng.uniform(20.0, 26.0))
    unit = _shape(length, segments, base_radius, tip_radius, 1.0)
    stiffness = _curl(unit, tension) / _FULL_CURL_RAD[variant]
    density = rng.uniform(700.0, 950.0)
    damping = damping_time(stiffness, density, base_radius, length, damping_ratio=0.4)
    depth = job.target.along_m - job.approach_m + 0.15 * half if wrap and job.target else 0.0
    return TentacleParameters(
        length_m=round(length, 3),
        segments=segments,
        base_radius_m=round(base_radius, 4),
        tip_radius_m=round(tip_radius, 4),
        cables=2 if variant in ("wrap", "curl") else 3,
        short_cables=3 if variant == "two stages" else 0,
        tension_n=round(tension, 1),
        bending_stiffness_n_m2=round(stiffness, 5),
        damping_time_s=round(damping, 3),
        density_kg_m3=round(density),
        stalk_m=round(float(np.clip(min(depth, job.room_m - base_radius - 0.008), 0.03, 0.5)), 3) if wrap else 0.0,
        stalk_aside_m=round(min(1.41 * half + _WRAP_CLEARANCE_M + base_radius, 0.3), 3) if wrap else 0.0,
    )


def _sample_sweep(job: Job, rng: np.random.Generator) -> TentacleParameters:
    """Choose the parameters of a short tentacle beside the surface that it sweeps.

    At full tension it presses with the required force.
    """
    length = float(rng.uniform(0.12, 0.14))
    base_radius = float(rng.uniform(0.0065, 0.0075))
    shape = _shape(length, _SWEEP_SEGMENTS, base_radius, base_radius * _TAPER, 1.0)
    tension = float(np.clip(_SWEEP_FORCE * job.press_n * length / cable_offset_m(shape[len(shape) // 2]), 2.0, 60.0))
    stiffness = _curl(shape, tension) / _FULL_CURL_RAD["sweep"]
    density = rng.uniform(700.0, 950.0)
    ahead_m = job.room_m if math.isfinite(job.room_m) else _FREE_AHEAD_M
    return TentacleParameters(
        length_m=round(length, 3),
        segments=_SWEEP_SEGMENTS,
        base_radius_m=round(base_radius, 4),
        tip_radius_m=round(base_radius * _TAPER, 4),
        cables=2,
        tension_n=round(tension, 1),
        bending_stiffness_n_m2=round(stiffness, 5),
        damping_time_s=round(damping_time(stiffness, density, base_radius, length, damping_ratio=0.4), 3),
        density_kg_m3=round(density),
        stalk_m=round(float(np.clip(ahead_m - base_radius - rng.uniform(0.032, 0.04), 0.03, 0.5)), 3),
        stalk_aside_m=round(0.9 * length, 3),
        ahead=1,
    )


def write(p: TentacleParameters) -> Robot:
    """Write a tentacle as MJCF."""
    about = f"Tapering tentacle, {p.length_m:g} m long, driven by cables. Built-in rules, SI units."
    builder = MjcfBuilder("tentacle", about, p.variation)
    base = add_base(builder, "base", radius_m=max(2.2 * p.base_radius_m, 0.02), thickness_m=0.012)
    root = _write_stalk(base, p) if p.stalk_m > 0 else base
    shape = _shape(p.length_m, p.segments, p.base_radius_m, p.tip_radius_m, p.bending_stiffness_n_m2)
    axes = "y" if p.cables == 2 else "xy"
    backbone = write_chain(
        builder, root, Chain("seg", shape, axes, p.damping_time_s, p.density_kg_m3, armature_kg_m2=5e-6)
    )
    names = ("tendon_curl", "tendon_uncurl") if p.cables == 2 else tuple(f"tendon_long_{120 * k:03d}" for k in range(3))
    for number, name in enumerate(names):
        turn = 2.0 * math.pi * number / p.cables
        route_cable(
            builder, backbone, Cable(name, turn, p.segments, p.tension_n * (0.6 if name.endswith("uncurl") else 1.0))
        )
    for number in range(p.short_cables):
        degrees = 60 + 120 * number
        route_cable(
            builder, backbone, Cable(f"tendon_short_{degrees:03d}", math.radians(degrees), p.segments // 2, p.tension_n)
        )
    add_pad(backbone, "tip_pad", 1.3 * p.tip_radius_m)
    add_tip_sensors(builder, backbone, 1.6 * p.tip_radius_m)
    part = "tip"
    if p.stalk_m > 0 and not p.ahead:
        part = "grasp"
        add(base, "site", name=part, pos=(0.0, 0.0, p.stalk_m), size=(0.003,), material="working")
        add(builder.sensor, "framepos", name="grasp_position", objtype="site", objname=part)
    return Robot(mjcf=builder.text(), functional_part=part, notes="Written by the built-in rules.")


def _write_stalk(base: etree._Element, p: TentacleParameters) -> etree._Element:
    """Write a beam to the side and a post along the mount's axis; the tentacle leaves the post along +x.

    It curls towards +y around the mount's axis, or towards +z, ahead.
    """
    aside, before = (0.0, -p.stalk_aside_m) if p.ahead else (-p.stalk_aside_m, -0.25 * p.stalk_aside_m)
    axes = (0.0, 0.0, 1.0, 0.0, -1.0, 0.0) if p.ahead else (0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    add(
        base,
        "geom",
        name="stalk_beam",
        type="capsule",
        size=(0.007,),
        fromto=(0.0, 0.0, 0.004, before, aside, 0.004),
        mass=0.03,
        material="base",
    )
    add(
        base,
        "geom",
        name="stalk_post",
        type="capsule",
        size=(0.007,),
        fromto=(before, aside, 0.004, before, aside, p.stalk_m),
        mass=0.05,
        material="base",
    )
    return add(base, "body", name="stalk", pos=(before, aside, p.stalk_m), xyaxes=axes)


def _kind(p: TentacleParameters) -> str:
    if p.stalk_m:
        return "Sweeping" if p.ahead else "Wrapping"
    if p.cables == 2:
        return "Curling"
    return "Two-stage tapered" if p.short_cables else "Tapered"


def describe(p: TentacleParameters, job: Job) -> Description:
    """Describe the parameters in words."""
    del job
    shape = _shape(p.length_m, p.segments, p.base_radius_m, p.tip_radius_m, p.bending_stiffness_n_m2)
    planar = p.cables == 2
    where = f"It grows straight from the mount and {'curls in one plane' if planar else 'bends to every side'}."
    if p.stalk_m:
        where = (
            f"It leaves a post of {mm(p.stalk_m)} sideways, {mm(p.stalk_aside_m)} beside the mount's axis, and "
            f"curls {'towards what is ahead' if p.ahead else 'in a level plane around what stands on that axis'}."
        )
    short = f", and {numeral(p.short_cables)} that end half way, so that base and tip bend apart"
    return Description(
        name=f"{_kind(p)} tentacle, {mm(p.length_m)}",
        morphology=(
            f"A tentacle of {mm(p.length_m)} that tapers from {mm(2 * p.base_radius_m)} to "
            f"{mm(2 * p.tip_radius_m)}, in {p.segments} segments that get shorter with their thickness. {where} At "
            f"its base it is as stiff as {rod(p.bending_stiffness_n_m2)}, and softer with the square of its "
            "thickness, so the tip curls tightest."
        ),
        actuation=(
            f"{numeral(p.cables).capitalize()} cables along the whole length{short if p.short_cables else ''}, each "
            f"with a winch of at most {p.tension_n:.0f} N; "
            f"{'one curls, the other uncurls' if planar else 'they stand 120 deg apart'}."
        ),
        rationale=(
            f"One cable at full tension would curl it by {deg(_curl(shape, p.tension_n))} if nothing stopped it; a "
            "hold spreads over its length instead of a tip."
        ),
    )


def reinforce(p: TentacleParameters) -> TentacleParameters:
    """Return the parameters of a stiffer tentacle with more damping and more tension."""
    return p.model_copy(
        update={
            "tension_n": round(min(p.tension_n * 1.1, 60.0), 1),
            "bending_stiffness_n_m2": round(p.bending_stiffness_n_m2 * 1.2, 5),
            "damping_time_s": more_damping(p.damping_time_s),
            "variation": p.variation + 1,
        }
    )


def orient(job: Job, parameters: Mapping[str, Any]) -> Orientation:
    """Return the rotation of a tentacle on its mount.

    A tentacle that sweeps ahead curls sideways to its own weight; any other leans away from a target straight in front.
    """
    if not parameters.get("ahead"):
        return lean_aside(job, parameters.get("length_m", 0.0))
    turn_deg = angle_to_down_deg(job) - 90.0 if looks_sideways(job) else 0.0
    reason = "It curls towards what is ahead, and sideways to its own weight where it can."
    return Orientation((0.0, 0.0, turn_deg), reason)


TENTACLE = Family(
    name="tentacle",
    doc="A tapering backbone that curls from the tip, to wrap round things or to point past them.",
    jobs={
        "reach": Suits(("space", "two stages"), rank=2),
        "brush": Suits(
            ("sweep",),
            rank=1,
            preferred=(
                Preference("", "one beside the surface presses as hard as its cable pulls, however far away that is"),
            ),
        ),
        "grasp": Suits(("wrap",), rank=2),
        "insert": Suits(("space", "two stages"), rank=2),
        "pull": Suits(("curl",), rank=2),
    },
    parameters=TentacleParameters,
    size=size,
    write=write,
    describe=describe,
    reinforce=reinforce,
    orient=orient,
)
