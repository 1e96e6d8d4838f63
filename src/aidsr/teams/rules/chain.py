"""A soft chain in MJCF: segments that bend in their middle, and the cables that run along them.

A chain of N segments has N joints, each in the middle of a segment, and N links between and after the joints; the first
half segment belongs to the body from which the chain grows. In each segment, cables pass two guides, at a quarter and
at three quarters of its length, just outside the body. docs/physics.md gives the reasons.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from lxml import etree

from aidsr.mjcf.edit import format_value
from aidsr.sim import beam
from aidsr.teams.rules.mjcf_builder import MjcfBuilder, add

GUIDE_CLEARANCE_M = 0.0015
"""Distance of a cable from the body's surface [m]. Our choice: a cable of 1 mm in an eyelet, free of the skin."""

_LARGEST_JOINT_ANGLE_RAD = 0.6
"""Limit of a segment's joint [rad]. Our choice: nearly twice the 0.35 rad up to which straight cable spans are
accurate."""


@dataclass(frozen=True)
class Segment:
    """One segment of a chain."""

    length_m: float
    radius_m: float
    bending_stiffness_n_m2: float


@dataclass(frozen=True)
class Chain:
    """A soft limb along its own +z.

    Attributes:
        prefix: Prefix of the links' names: "seg" gives seg01, seg02 …
        axes: Axes about which the segments bend: "xy" in space, "y" in the x-z plane.
        damping_time_s: Damping time beta = c / k of every joint [s].
        rest_turn_rad: Rotation about y at every joint with relaxed springs, for a body that is curved at rest [rad].
    """

    prefix: str
    segments: tuple[Segment, ...]
    axes: str
    damping_time_s: float
    density_kg_m3: float
    armature_kg_m2: float = 1e-5
    joint_range_rad: float = _LARGEST_JOINT_ANGLE_RAD
    rest_turn_rad: float = 0.0

    @property
    def length_m(self) -> float:
        """Length along the backbone [m]."""
        return sum(segment.length_m for segment in self.segments)


def uniform(count: int, length_m: float, radius_m: float, bending_stiffness_n_m2: float) -> tuple[Segment, ...]:
    """Return `count` equal segments with a total length of `length_m`."""
    return (Segment(length_m / count, radius_m, bending_stiffness_n_m2),) * count


@dataclass(frozen=True)
class Cable:
    """A cable along a chain, straight beside the backbone.

    Attributes:
        name: Name of the tendon; its guides are NAME_01a, NAME_01b, …
        angle_rad: Position around the backbone, from the chain's +x towards +y [rad].
        last: Number of the last segment along which the cable runs.
        tension_n: Maximum tension of its winch [N].
        first: Number of the first such segment; with a winch inside the body, a cable can start later than at 1.
    """

    name: str
    angle_rad: float
    last: int
    tension_n: float
    first: int = 1


@dataclass(frozen=True)
class Backbone:
    """A chain that has been written.

    Attributes:
        links: The body from which the chain grows, with the first half segment, then one body per joint.
        joint_at_m: Position of the next joint along the z axis of each link but the last [m].
    """

    chain: Chain
    links: tuple[etree._Element, ...]
    joint_at_m: tuple[float, ...]

    @property
    def tip(self) -> etree._Element:
        """The last link."""
        return self.links[-1]

    @property
    def tip_at_m(self) -> float:
        """Position of the chain's end along the last link's z axis [m]."""
        return self.chain.segments[-1].length_m / 2.0


def write_chain(builder: MjcfBuilder, root: etree._Element, chain: Chain) -> Backbone:
    """Write a chain that starts at `root`'s origin along its +z, and return it."""
    segments = chain.segments
    halves = [segment.length_m / 2.0 for segment in segments] + [0.0]
    kind = add(builder.default, "default", class_=chain.prefix)
    _joint_defaults(kind, chain)
    add(kind, "geom", type="capsule")
    _skin(root, chain, 0, halves[0])
    links, joint_at = [root], [halves[0]]
    for number, segment in enumerate(segments, start=1):
        body = add(links[-1], "body", name=f"{chain.prefix}{number:02d}", pos=(0.0, 0.0, joint_at[-1]))
        if number == 1:
            body.set("childclass", chain.prefix)
        if chain.rest_turn_rad:
            body.set("euler", format_value((0.0, chain.rest_turn_rad, 0.0)))
        _joints(body, chain, segment)
        joint_at.append(halves[number - 1] + halves[number])
        _skin(body, chain, number, joint_at[-1])
        links.append(body)
    # MuJoCo filters contacts between parent and child, but not if the parent is fixed to the world.
    builder.exclude(str(root.get("name")), f"{chain.prefix}01")
    _exclude_overlapping(builder, chain, links)
    return Backbone(chain, tuple(links), tuple(joint_at[:-1]))


def _exclude_overlapping(builder: MjcfBuilder, chain: Chain, links: list[etree._Element]) -> None:
    """Exclude contacts between links two apart that are thicker than long, because they overlap at rest."""
    for number in range(2, len(links)):
        between = chain.segments[number - 1].length_m / 2.0 + chain.segments[number - 2].length_m / 2.0
        if 2.0 * chain.segments[number - 2].radius_m > between * 0.95:
            builder.exclude(str(links[number - 2].get("name")), str(links[number].get("name")))


def _is_uniform(chain: Chain) -> bool:
    return all(segment == chain.segments[0] for segment in chain.segments)


def _elasticity(chain: Chain, segment: Segment) -> dict[str, float]:
    stiffness = beam.joint_stiffness(segment.bending_stiffness_n_m2, segment.length_m)
    return {"stiffness": stiffness, "damping": beam.joint_damping(stiffness, chain.damping_time_s)}


def _joint_defaults(kind: etree._Element, chain: Chain) -> None:
    elasticity = _elasticity(chain, chain.segments[0]) if _is_uniform(chain) else {}
    limits = (-chain.joint_range_rad, chain.joint_range_rad)
    add(kind, "joint", range_=limits, armature=chain.armature_kg_m2, **elasticity)


def _joints(body: etree._Element, chain: Chain, segment: Segment) -> None:
    elasticity = {} if _is_uniform(chain) else _elasticity(chain, segment)
    for axis in chain.axes:
        direction = (1.0, 0.0, 0.0) if axis == "x" else (0.0, 1.0, 0.0)
        add(body, "joint", name=f"{body.get('name')}_bend_{axis}", axis=direction, **elasticity)


def _skin(body: etree._Element, chain: Chain, number: int, length_m: float) -> None:
    attributes = {"class_": chain.prefix} if number == 0 else {}
    radius = chain.segments[max(number - 1, 0)].radius_m
    add(
        body,
        "geom",
        name=f"{chain.prefix}{number:02d}_skin",
        fromto=(0.0, 0.0, 0.0, 0.0, 0.0, length_m),
        size=(radius,),
        mass=chain.density_kg_m3 * math.pi * radius**2 * length_m,
        material="link_light" if number % 2 else "link_dark",
        **attributes,
    )


def route_cable(builder: MjcfBuilder, backbone: Backbone, cable: Cable) -> None:
    """Route a cable through its guides, and add a winch that can only pull."""
    tendon = add(builder.tendon, "spatial", name=cable.name)
    for number in range(cable.first, cable.last + 1):
        segment = backbone.chain.segments[number - 1]
        offset, quarter = cable_offset_m(segment), segment.length_m / 4.0
        side = (offset * math.cos(cable.angle_rad), offset * math.sin(cable.angle_rad))
        before = backbone.joint_at_m[number - 1] - quarter
        for link, height, letter in ((number - 1, before, "a"), (number, quarter, "b")):
            name = f"{cable.name}_{number:02d}{letter}"
            add(backbone.links[link], "site", name=name, pos=(*side, height))
            add(tendon, "site", site=name)
    add_winch(builder, cable.name, cable.tension_n)


def add_winch(builder: MjcfBuilder, tendon: str, tension_n: float) -> None:
    """Add a winch to a tendon, controlled by the cable tension [N], and sensors of the tendon's length and force."""
    label = tendon.removeprefix("tendon_")
    ranges: dict[str, tuple[float, float]] = {"ctrlrange": (0.0, tension_n), "forcerange": (-tension_n, 0.0)}
    add(builder.actuator, "general", class_="winch", name=f"pull_{label}", tendon=tendon, **ranges)
    add(builder.sensor, "tendonpos", name=f"length_{label}", tendon=tendon)
    add(builder.sensor, "actuatorfrc", name=f"force_{label}", actuator=f"pull_{label}")


def cable_offset_m(segment: Segment) -> float:
    """Return the distance of a cable from the backbone [m]: just outside the body."""
    return segment.radius_m + GUIDE_CLEARANCE_M
