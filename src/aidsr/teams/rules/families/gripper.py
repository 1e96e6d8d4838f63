"""Gripper: fingers around a palm that curl inwards, each with a closing cable inside and an opening cable outside."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from lxml import etree
from pydantic import Field

from aidsr.core.artifacts import ActuatorGroup, Robot
from aidsr.core.formatting import deg, mm, numeral
from aidsr.sim import beam
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2
from aidsr.teams.rules.chain import GUIDE_CLEARANCE_M, Backbone, Cable, Chain, route_cable, uniform, write_chain
from aidsr.teams.rules.families.family import Description, Family, Is, Parameters, Suits
from aidsr.teams.rules.job import Job
from aidsr.teams.rules.mjcf_builder import MjcfBuilder, add
from aidsr.teams.rules.parts import add_base, add_pad, add_touch_sensor
from aidsr.teams.rules.sizing import bending_stiffness, damping_time, more_damping, rod


class GripperParameters(Parameters):
    """Parameters of a gripper."""

    fingers: Annotated[int, Field(ge=2, le=6), Is("count")]
    opposed: Annotated[int, Field(ge=0, le=1)]
    """1: the fingers stand in two facing rows; 0: evenly around the palm."""
    finger_length_m: Annotated[float, Field(ge=0.04, le=0.3), Is("length")]
    segments: Annotated[int, Field(ge=5, le=15)]
    radius_m: Annotated[float, Field(ge=0.002, le=0.015), Is("thickness")]
    pad_half_width_m: Annotated[float, Field(ge=0.0, le=0.05), Is("tip width")]
    """Half width of a bar across each fingertip; 0 for round tips."""
    palm_radius_m: Annotated[float, Field(ge=0.01, le=0.15), Is("width")]
    splay_rad: Annotated[float, Field(ge=0.0, le=0.8)]
    wrist_m: Annotated[float, Field(ge=0.01, le=0.5), Is("length")]
    closing_n: Annotated[float, Field(ge=2.0, le=30.0), Is("tension")]
    opening_n: Annotated[float, Field(ge=1.0, le=20.0), Is("tension")]
    bending_stiffness_n_m2: Annotated[float, Field(gt=0.0), Is("stiffness")]
    damping_time_s: Annotated[float, Field(ge=0.01, le=beam.MOST_DAMPING_TIME_S), Is("damping")]
    density_kg_m3: Annotated[float, Field(ge=200.0, le=2000.0), Is("density")]

    def count_step(self, name: str) -> int:
        """Return the step of a number of parts, see `Parameters`: fingers in facing rows come in pairs."""
        return 2 if name == "fingers" and self.opposed else 1


_SHAPES = {
    "three fingers": (3, 0),
    "four fingers": (4, 0),
    "facing pairs": (4, 1),
    "five fingers": (5, 0),
    "pincer": (2, 1),
}
"""Number of fingers, and whether they face each other in two rows, of each variant."""

_PAD_SHARE = {2: 0.8, 3: 0.45, 4: 0.25, 5: 0.0, 6: 0.0}
"""Half width of the fingertips as a share of the object's half width, by number of fingers. Our choice: fewer fingers
need wider tips, otherwise a ball slips out between them."""

_FULL_CURL_RAD = 3.4
"""Curl of a free finger at full tension [rad]. Our choice: enough to close on the smallest object from fully open."""

_CLOSING_N = 12.0
"""Closing tension of one of three fingers [N]. Source: three fingers at 8 N held 440 g (docs/physics.md)."""

_DEFAULT_HALF_WIDTH_M = 0.03
_CLEARANCE_M = 0.015
"""Sideways gap between the open fingers and the object [m]. Our choice: the placement error of the grasping tasks."""

_FLOOR_CLEARANCE_M = 0.012
"""Gap between fingertips and the table [m]. Our choice: room for the tips to swing through."""

_START_GAP_M = 0.02


def size(job: Job, rng: np.random.Generator, variant: str) -> GripperParameters:
    """Choose the parameters of a gripper for the object.

    Its fingers open around the object and end just below its middle when the mount is nearest.
    """
    fingers, opposed = _SHAPES[variant]
    half = float(np.clip(job.target.half_width_m if job.target else _DEFAULT_HALF_WIDTH_M, 0.012, 0.06))
    length = float(np.clip(2.0 * half + rng.uniform(0.012, 0.02), 0.06, 0.2))
    segments = 8
    radius = float(np.clip(0.2 * half, 0.003, 0.008)) * rng.uniform(0.95, 1.1)
    palm = half + 0.008 + (0.004 if fingers > 3 else 0.0)
    opening = 1.41 * half + _CLEARANCE_M + radius
    splay = math.asin(min(max((opening - palm) / length, 0.1), 0.6))
    closing = job.pull * _CLOSING_N * (3.0 / fingers) ** 0.5 * rng.uniform(1.0, 1.3)
    offset = radius + GUIDE_CLEARANCE_M
    stiffness = bending_stiffness(closing, offset, length, _FULL_CURL_RAD)
    density = rng.uniform(900.0, 1150.0)
    return GripperParameters(
        fingers=fingers,
        opposed=opposed,
        finger_length_m=round(length, 3),
        segments=segments,
        radius_m=round(radius, 4),
        pad_half_width_m=round(_PAD_SHARE[fingers] * half, 4),
        palm_radius_m=round(palm, 3),
        splay_rad=round(splay, 3),
        wrist_m=round(_wrist(job, half, length * math.cos(splay)), 3),
        closing_n=round(closing, 1),
        opening_n=round(closing * 0.5, 1),
        bending_stiffness_n_m2=round(stiffness, 6),
        damping_time_s=round(damping_time(stiffness, density, radius, length, damping_ratio=0.5), 3),
        density_kg_m3=round(density),
    )


def _wrist(job: Job, half_width_m: float, finger_reach_m: float) -> float:
    """Return the length of the post between mount and palm [m]; the fingertips then reach the object's lower half."""
    if job.target is None:
        return 0.05
    if job.kind == "pull" and job.approach_m > 0:
        # The fingers start clear of the handle: the mount moves them, opened, around it.
        return float(np.clip(job.target.along_m - half_width_m - _START_GAP_M - finger_reach_m, 0.02, 0.4))
    if job.kind == "pull":
        return float(np.clip(job.target.along_m - 0.6 * finger_reach_m, 0.02, 0.4))
    depth = job.target.along_m - job.approach_m + 0.55 * half_width_m
    return float(np.clip(min(depth, job.room_m - _FLOOR_CLEARANCE_M) - finger_reach_m, 0.02, 0.4))


def stances(p: GripperParameters) -> list[tuple[float, float, float]]:
    """Return the position of each finger on the palm (x, y) [m] and its direction away from the middle [rad]."""
    if not p.opposed:
        angles = [2.0 * math.pi * number / p.fingers for number in range(p.fingers)]
        return [(p.palm_radius_m * math.cos(angle), p.palm_radius_m * math.sin(angle), angle) for angle in angles]
    row = p.fingers // 2
    spread = [0.0] if row == 1 else [p.palm_radius_m * 0.5 * (2.0 * number / (row - 1) - 1.0) for number in range(row)]
    return [(side * p.palm_radius_m, y, 0.0 if side > 0 else math.pi) for side in (1.0, -1.0) for y in spread]


def write(p: GripperParameters) -> Robot:
    """Write a gripper as MJCF."""
    about = f"Gripper of {p.fingers} fingers, {p.finger_length_m:g} m long, driven by cables. Built-in rules, SI units."
    builder = MjcfBuilder("gripper", about, p.variation)
    palm = add_base(builder, "palm", radius_m=0.03, thickness_m=0.01)
    _write_palm(palm, p)
    backbones = [_write_finger(builder, palm, p, number, stance) for number, stance in enumerate(stances(p), start=1)]
    for first in range(1, p.fingers + 1):
        # The roots of the fingers may be closer together than the skin of a bent first segment.
        builder.exclude("palm", f"finger{first}_seg01")
    for number, backbone in enumerate(backbones, start=1):
        route_cable(builder, backbone, Cable(f"tendon_close_{number}", 0.0, p.segments, p.closing_n))
        route_cable(builder, backbone, Cable(f"tendon_open_{number}", math.pi, p.segments, p.opening_n))
        add_pad(backbone, f"fingertip{number}", 1.1 * p.radius_m, p.pad_half_width_m)
        add_touch_sensor(builder, backbone, f"fingertip{number}", 1.3 * p.radius_m + p.pad_half_width_m)
    add(builder.sensor, "framepos", name="grasp_position", objtype="site", objname="grasp")
    return Robot(
        mjcf=builder.text(), functional_part="grasp", actuator_groups=groups(p), notes="Written by the built-in rules."
    )


def _write_palm(palm: etree._Element, p: GripperParameters) -> None:
    add(
        palm,
        "geom",
        name="wrist",
        type="cylinder",
        size=(0.011,),
        fromto=(0.0, 0.0, 0.0, 0.0, 0.0, p.wrist_m),
        mass=0.06,
        material="base",
    )
    width = p.palm_radius_m + p.radius_m + 0.003
    add(
        palm,
        "geom",
        name="palm_plate",
        type="cylinder",
        size=(width, 0.004),
        pos=(0.0, 0.0, p.wrist_m - 0.004),
        mass=0.05,
        material="base",
    )
    depth = p.wrist_m + 0.75 * p.finger_length_m * math.cos(p.splay_rad)
    add(palm, "site", name="grasp", pos=(0.0, 0.0, depth), size=(0.003,), material="working")


def _write_finger(
    builder: MjcfBuilder, palm: etree._Element, p: GripperParameters, number: int, stance: tuple[float, float, float]
) -> Backbone:
    """Write one finger: its x axis points to the middle of the palm, its z axis leans outwards by the splay angle."""
    x, y, away = stance
    lean, rise = math.sin(p.splay_rad), math.cos(p.splay_rad)
    inwards = (-math.cos(away) * rise, -math.sin(away) * rise, lean)
    root = add(
        palm,
        "body",
        name=f"finger{number}",
        pos=(x, y, p.wrist_m),
        xyaxes=(*inwards, math.sin(away), -math.cos(away), 0.0),
    )
    segments = uniform(p.segments, p.finger_length_m, p.radius_m, p.bending_stiffness_n_m2)
    return write_chain(
        builder,
        root,
        Chain(f"finger{number}_seg", segments, "y", p.damping_time_s, p.density_kg_m3, armature_kg_m2=2e-6),
    )


def groups(p: GripperParameters) -> tuple[ActuatorGroup, ...]:
    """Return the groups of winches that act together: all opening ones, and the closing ones in one or two groups.

    The closing ones are grouped by pairs of opposite fingers with four fingers around the palm, and by rows with facing
    rows.
    """
    numbers = range(1, p.fingers + 1)
    opening = ActuatorGroup(name="open", actuators=tuple(f"pull_open_{number}" for number in numbers))
    half = p.fingers // 2
    pairs: list[tuple[str, Sequence[int]]]
    if p.fingers == 4 and not p.opposed:
        pairs = [("close_a", (1, 3)), ("close_b", (2, 4))]
    elif p.opposed:
        pairs = [("close_a", numbers[:half]), ("close_b", numbers[half:])]
    else:
        pairs = [("close", numbers)]
    closing = [ActuatorGroup(name=name, actuators=tuple(f"pull_close_{n}" for n in chosen)) for name, chosen in pairs]
    return (*closing, opening)


def describe(p: GripperParameters, job: Job) -> Description:
    """Describe the parameters in words."""
    low, high = beam.tip_force_range(p.closing_n, p.radius_m + GUIDE_CLEARANCE_M, p.finger_length_m)
    held = f"what is {mm(2 * job.target.half_width_m)} wide" if job.target else "what is about 60 mm wide"
    opening = 2 * (p.palm_radius_m + p.finger_length_m * math.sin(p.splay_rad))
    grouped = ", ".join(group.name for group in groups(p))
    return Description(
        name=f"{numeral(p.fingers).capitalize()}-finger gripper{', facing rows' if p.opposed else ''}",
        morphology=(
            f"{numeral(p.fingers).capitalize()} fingers of {mm(p.finger_length_m)} stand "
            f"{'in two facing rows' if p.opposed else 'evenly'} on a palm of {mm(2 * p.palm_radius_m)} and lean "
            f"out by {deg(p.splay_rad)}, so that they open {mm(opening)} wide around {held}; a wrist of "
            f"{mm(p.wrist_m)} brings their tips there. A finger has {p.segments} segments that bend in its own "
            f"plane only and is as stiff as {rod(p.bending_stiffness_n_m2)}."
        ),
        actuation=(
            f"Two cables a finger: one inside closes with at most {p.closing_n:.1f} N, one outside opens with "
            f"{p.opening_n:.1f} N. The winches act in {len(groups(p))} groups: {grouped}."
        ),
        rationale=(
            f"{low:.1f} to {high:.1f} N a fingertip; with friction 0.9, {numeral(p.fingers)} fingers hold "
            f"{p.fingers * 0.9 * low / STANDARD_GRAVITY_M_S2 * 1000:.0f} g or more by friction alone, and curling "
            "under adds to it."
        ),
    )


def reinforce(p: GripperParameters) -> GripperParameters:
    """Return the parameters of a gripper with stiffer fingers, more damping and more tension."""
    return p.model_copy(
        update={
            "closing_n": round(min(p.closing_n * 1.15, 30.0), 1),
            "opening_n": round(min(p.opening_n * 1.15, 20.0), 1),
            "bending_stiffness_n_m2": round(p.bending_stiffness_n_m2 * 1.2, 6),
            "damping_time_s": more_damping(p.damping_time_s),
            "variation": p.variation + 1,
        }
    )


GRIPPER = Family(
    name="gripper",
    doc="Fingers around a palm that curl inwards, each with a closing cable inside and an opening cable outside.",
    jobs={
        "grasp": Suits(("three fingers", "four fingers", "five fingers", "facing pairs", "pincer"), rank=1),
        "pull": Suits(("pincer", "facing pairs", "three fingers"), rank=3),
    },
    parameters=GripperParameters,
    size=size,
    write=write,
    describe=describe,
    reinforce=reinforce,
)
