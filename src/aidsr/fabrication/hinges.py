"""Design of the elastic hinge of each joint: a bought rod, a pair of rods, or a printed neck.

A rod of bending stiffness E I with a free length g between two clamps acts as a hinge of stiffness k = E I / g about
its middle, so a rod's free length follows from the joint's stiffness. A printed neck spans the gap, so its length is g
and its thickness follows.

Two rods at a distance y on either side of the limb's axis bend with 2 E I / g about an axis in their plane. About any
other axis they are the flanges of a sandwich beam, which adds up to 2 E A y^2 / g and blocks the joint.

Source: Euler-Bernoulli beam under a pure moment; a strip has I = w t^3 / 12, a round rod I = pi d^4 / 64. Sandwich:
parallel axis theorem, I + A y^2 for each rod.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.fabrication.anatomy import Anatomy, Joint
from aidsr.fabrication.elastic import elastic_faults, unsupported_reason
from aidsr.fabrication.materials import Material, Rod, rods
from aidsr.fabrication.skeleton import STRAIGHT, Gap, Skeleton
from aidsr.sim.beam import rod_diameter, rod_stiffness

_LEAST_CLAMP_MM = 3.0
"""Smallest length over which a part must hold a rod. Our choice: a glued joint of two to three rod diameters."""

_LEAST_FREE_MM = 2.0
_STEP_MM = 0.05
"""Step to which printed thicknesses are rounded. Our choice: the accuracy of a printer."""

_WIDEST_SHARE = 1.6
"""Width of a flat neck / radius of the limb. Our choice: fits inside the limb, with room for cables beside it."""


@dataclass(frozen=True)
class Hinge:
    """The elastic element that replaces one joint.

    Attributes:
        joint: Index of the joint in the anatomy.
        kind: "rod", "pair" for two rods side by side, "round" or "flat" for a printed neck.
        thickness_mm: Diameter of a rod or round neck, thickness of a flat neck.
        width_mm: Width of a flat neck, distance between the rods of a pair, 0 otherwise.
        free_mm: Length over which it bends.
        stiffness_n_m_rad: Stiffness as built.
        strain: Largest strain, at the largest angle of the joint.
        allowed_strain: Largest allowed strain of its material.
        linear_rad: Angle beyond which it is softer than a linear spring.
    """

    joint: int
    kind: str
    thickness_mm: float
    width_mm: float
    free_mm: float
    stiffness_n_m_rad: float
    strain: float
    allowed_strain: float
    linear_rad: float


@dataclass(frozen=True)
class Backbone:
    """One rod, or two parallel rods, through consecutive joints of a limb.

    Attributes:
        joints: Indices of the joints, from the root outwards.
        rod: Rod stock to buy.
        diameter_mm: Diameter of each rod.
        count: Number of rods, 1 or 2.
    """

    joints: tuple[int, ...]
    rod: Rod
    diameter_mm: float
    count: int


@dataclass(frozen=True)
class Hinges:
    """All hinges of a robot by the joint's index, the backbones that contain them, and the faults found."""

    hinges: dict[int, Hinge]
    backbones: tuple[Backbone, ...]
    faults: tuple[Fault, ...]


def design_hinges(anatomy: Anatomy, skeleton: Skeleton, material: Material) -> Hinges:
    """Return the hinges of a robot that is printed from a material: necks for an elastomer, else rods."""
    hinges: dict[int, Hinge] = {}
    backbones: list[Backbone] = []
    faults = list(elastic_faults(anatomy, skeleton))
    joints_and_gaps = zip(anatomy.joints, skeleton.gaps, strict=True)
    makeable = {index for index, (joint, gap) in enumerate(joints_and_gaps) if not unsupported_reason(joint, gap)}
    for limb in skeleton.limbs:
        joints = tuple(index for index in limb if index in makeable)
        if material.elastomer:
            found = [_neck(anatomy.joints[index], skeleton.gaps[index], material) for index in joints]
            hinges |= {hinge.joint: hinge for hinge in found}
            continue
        for stretch in _stretches(joints, skeleton):
            build = _best_backbone(anatomy, skeleton, stretch)
            if build is None:
                faults.append(_no_rod(anatomy, skeleton, stretch))
                continue
            backbones.append(build[0])
            hinges |= {hinge.joint: hinge for hinge in build[1]}
    faults += [*_strained(anatomy, hinges), *_too_thick(anatomy, skeleton, hinges)]
    return Hinges(hinges, tuple(backbones), tuple(faults))


def _stretches(joints: tuple[int, ...], skeleton: Skeleton) -> Iterator[tuple[int, ...]]:
    """Yield the sequences of joints that a straight rod can pass; they are split at joints that are bent at rest."""
    run: list[int] = []
    for index in joints:
        run.append(index)
        if not skeleton.gaps[index].straight:
            yield tuple(run[:-1]) if len(run) > 1 else (index,)
            if len(run) > 1:
                yield (index,)
            run = []
    if run:
        yield tuple(run)


def _best_backbone(
    anatomy: Anatomy, skeleton: Skeleton, joints: tuple[int, ...]
) -> tuple[Backbone, tuple[Hinge, ...]] | None:
    """Return the backbone with the smallest ratio of strain to allowed strain, and its hinges.

    None where a joint is bent at rest, where the joints turn about different axes, or where no rod gives the
    stiffnesses.
    """
    count = 2 if len(anatomy.joints[joints[0]].axes) == 1 else 1
    if any(not skeleton.gaps[index].straight for index in joints) or not _turn_alike(anatomy, joints):
        return None
    best: tuple[float, Backbone, tuple[Hinge, ...]] | None = None
    for rod in rods():
        for diameter in rod.diameters_mm:
            backbone = Backbone(joints, rod, diameter, count)
            hinges = tuple(_rod_hinge(anatomy.joints[index], skeleton.gaps[index], backbone) for index in joints)
            if not _holds(hinges, skeleton, joints):
                continue
            strained = max(hinge.strain / hinge.allowed_strain for hinge in hinges)
            if best is None or strained < best[0]:
                best = (strained, backbone, hinges)
    return None if best is None else (best[1], best[2])


def _turn_alike(anatomy: Anatomy, joints: tuple[int, ...]) -> bool:
    """Whether all joints bend to all sides, as one rod does, or all about parallel axes, as two rods do."""
    axes = [anatomy.joints[index].axes for index in joints]
    if any(len(own) > 1 for own in axes):
        return all(len(own) > 1 for own in axes)
    return all(abs(np.dot(own[0], axes[0][0])) > STRAIGHT for own in axes)


def _rod_hinge(joint: Joint, gap: Gap, backbone: Backbone) -> Hinge:
    rod, diameter_m = backbone.rod, backbone.diameter_mm / 1000.0
    stiffness = min(joint.stiffness_n_m_rad)
    free_m = backbone.count * rod_stiffness(rod.young_modulus_pa, diameter_m) / stiffness
    per_rad = diameter_m / 2.0 / free_m
    return Hinge(
        joint=gap.joint,
        kind="pair" if backbone.count == 2 else "rod",
        thickness_mm=backbone.diameter_mm,
        width_mm=gap.radius_mm if backbone.count == 2 else 0.0,
        free_mm=1000.0 * free_m,
        stiffness_n_m_rad=stiffness,
        strain=per_rad * gap.bend_rad,
        allowed_strain=rod.largest_strain,
        linear_rad=rod.linear_strain / per_rad,
    )


def _holds(hinges: tuple[Hinge, ...], skeleton: Skeleton, joints: tuple[int, ...]) -> bool:
    """Whether the free lengths are neither too short to bend nor too long for the parts that hold the rod."""
    if min(hinge.free_mm for hinge in hinges) < max(_LEAST_FREE_MM, hinges[0].thickness_mm):
        return False
    anchors = skeleton.anchors
    for (one, hinge), (other, following) in zip(
        list(zip(joints, hinges, strict=True))[:-1], list(zip(joints, hinges, strict=True))[1:], strict=True
    ):
        apart = math.dist(anchors[one], anchors[other])
        if apart - (hinge.free_mm + following.free_mm) / 2 < _LEAST_CLAMP_MM:
            return False
    ends = (skeleton.gaps[joints[0]].before_mm, skeleton.gaps[joints[-1]].after_mm)
    return all(hinge.free_mm / 2 <= 2 * end for hinge, end in zip((hinges[0], hinges[-1]), ends, strict=True))


def _neck(joint: Joint, gap: Gap, material: Material) -> Hinge:
    """Return the printed neck that spans a gap."""
    stiffness, free_m, modulus = min(joint.stiffness_n_m_rad), gap.length_mm / 1000.0, material.young_modulus_pa
    if len(joint.axes) == 1:
        width_mm = _WIDEST_SHARE * gap.radius_mm
        exact_m = (12.0 * stiffness * free_m / (modulus * width_mm / 1000.0)) ** (1.0 / 3.0)
        thickness_mm = _rounded(1000.0 * exact_m)
        inertia_m4 = width_mm * thickness_mm**3 / 12.0 * 1e-12
        kind = "flat"
    else:
        width_mm, kind = 0.0, "round"
        thickness_mm = _rounded(1000.0 * rod_diameter(stiffness * free_m, modulus))
        inertia_m4 = math.pi * thickness_mm**4 / 64.0 * 1e-12
    per_rad = thickness_mm / 2.0 / gap.length_mm
    return Hinge(
        joint=gap.joint,
        kind=kind,
        thickness_mm=thickness_mm,
        width_mm=width_mm,
        free_mm=gap.length_mm,
        stiffness_n_m_rad=modulus * inertia_m4 / free_m,
        strain=per_rad * gap.bend_rad,
        allowed_strain=material.largest_strain,
        linear_rad=math.inf,
    )


def _rounded(length_mm: float) -> float:
    return max(_STEP_MM, round(length_mm / _STEP_MM) * _STEP_MM)


def _no_rod(anatomy: Anatomy, skeleton: Skeleton, joints: tuple[int, ...]) -> Fault:
    cure = "Print the limb of an elastomer (tpu95a), or lengthen the segments."
    if any(not skeleton.gaps[index].straight for index in joints):
        message = "is bent at rest, and rods are straight"
    elif not _turn_alike(anatomy, joints):
        message = "turn about different axes, and rods through all of them bend about the same ones"
        cure = "Print the limb of an elastomer (tpu95a), or give all its joints parallel axes or two crossed ones."
    else:
        message = "no rod that is sold gives this stiffness here"
    return Fault(
        code="hinge_stiffness",
        layer="realizability",
        severity="error",
        names=tuple(name for index in joints for name in anatomy.joints[index].names),
        measured=max(anatomy.joints[index].stiffness_n_m_rad[0] for index in joints),
        unit="N m/rad",
        message=message,
        cure=cure,
    )


def _strained(anatomy: Anatomy, hinges: dict[int, Hinge]) -> Iterator[Fault]:
    over = [hinge for hinge in hinges.values() if hinge.strain > hinge.allowed_strain]
    if over:
        worst = max(over, key=lambda hinge: hinge.strain / hinge.allowed_strain)
        yield Fault(
            code="hinge_strain",
            layer="realizability",
            severity="error",
            names=tuple(name for hinge in over for name in anatomy.joints[hinge.joint].names),
            measured=100.0 * worst.strain,
            limit=100.0 * worst.allowed_strain,
            unit="%",
            message="bends so far that its hinge would not last",
            cure="Lengthen the segments, narrow the joints' range, or lower the tension.",
        )


def _too_thick(anatomy: Anatomy, skeleton: Skeleton, hinges: dict[int, Hinge]) -> Iterator[Fault]:
    """Yield faults for necks that collide with a cable, and for necks too short for the beam formula."""
    necks = [hinge for hinge in hinges.values() if hinge.kind in ("flat", "round")]
    between = {neck.joint: _room_mm(anatomy.joints[neck.joint], skeleton, neck) for neck in necks}
    long = {neck.joint: neck.free_mm for neck in necks}
    for room, in_the_way, message in (
        (between, True, "needs a neck that is thicker than the cables beside it leave room for"),
        (long, False, "needs a neck that is thicker than long, and such a one bends otherwise than a beam"),
    ):
        over = [neck for neck in necks if neck.thickness_mm > room[neck.joint]]
        if over:
            worst = max(over, key=lambda neck: neck.thickness_mm / max(room[neck.joint], 1e-6))
            yield Fault(
                code="hinge_stiffness",
                layer="realizability",
                severity="error" if in_the_way else "warning",
                names=tuple(name for neck in over for name in anatomy.joints[neck.joint].names),
                measured=worst.thickness_mm,
                limit=room[worst.joint],
                unit="mm",
                message=message,
                cure="Soften the joint, or lengthen the segments; a gap ends at the guides beside it.",
            )


def _room_mm(joint: Joint, skeleton: Skeleton, neck: Hinge) -> float:
    """Return the largest thickness of a neck between the cables that cross its joint; infinite where none does [mm]."""
    gap, axis = skeleton.gaps[neck.joint], np.array(joint.axes[0])
    room = math.inf
    for one, other in skeleton.crossings(neck.joint):
        away = (np.array(one.position_mm) + np.array(other.position_mm)) / 2 - gap.anchor
        away -= (away @ gap.before) * gap.before
        beside = float(away @ axis) if neck.kind == "flat" else 0.0
        if abs(beside) <= neck.width_mm / 2:
            room = min(room, 2 * math.sqrt(max(0.0, float(away @ away) - beside**2)))
    return room
