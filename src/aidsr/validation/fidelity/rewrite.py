"""A limb rewritten as a separate MJCF model, with the same number of segments or a multiple of it."""

from __future__ import annotations

import mujoco
import numpy as np
from lxml import etree
from numpy.typing import NDArray

from aidsr.sim.elastica import Rod
from aidsr.sim.structure import Chain
from aidsr.validation.fidelity.cables import Cable, Guide
from aidsr.validation.fidelity.limb import Limb, LimbError, unloaded_pose

Vector = NDArray[np.float64]

_BALL = int(mujoco.mjtJoint.mjJNT_BALL)
_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)
_IN_PLACE = 1e-3
"""Largest distance / limb length between a joint and the expected joint position of its segment."""


def rewrite(
    model: mujoco.MjModel,
    chain: Chain,
    limb: Limb,
    rod: Rod,
    cables: dict[Cable, tuple[Guide, ...]],
    *,
    factor: int = 1,
) -> str:
    """Return the MJCF of one limb that stands along +z, with each segment split into `factor` equal parts.

    The parts together keep the elasticity of the segment (stiffness and damping of each joint times the factor) and its
    mass (distributed as in the rod). Each part gets all guides of the segment, at the same relative positions, as the
    recipe of two guides per segment requires. The tendons are named "t0", "t1", … in the order of `cables`.

    Raises:
        LimbError: The limb has joints that twist it, or a joint that is not where its segment's joint should be.
    """
    joints = _joints_of_segments(model, chain, limb)
    root = etree.Element("mujoco")
    etree.SubElement(root, "compiler", angle="radian")
    base = etree.SubElement(etree.SubElement(root, "worldbody"), "body", name="base")
    lengths = np.repeat(limb.segment_m / factor, factor)
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    at = starts[:-1] + (lengths / 2.0 if limb.joints_at == "middles" else 0.0)
    links, ends = [base], np.append(at[1:], starts[-1])
    for number, (begin, end) in enumerate(zip(at, ends, strict=True)):
        body = etree.SubElement(links[-1], "body", name=f"s{number}")
        body.set("pos", _written(0.0, 0.0, begin - (at[number - 1] if number else 0.0)))
        segment, part = divmod(number, factor)
        halved = 0.5 if limb.clamp_doubled and segment == 0 and part > 0 else 1.0
        for joint in joints[segment]:
            _add_joint(body, model, limb, joint, factor * halved)
        _add_material(body, limb, rod, float(begin), float(end))
        links.append(body)
    tendons = etree.SubElement(root, "tendon")
    for index, guides in enumerate(cables.values()):
        spatial = etree.SubElement(tendons, "spatial", name=f"t{index}")
        for number, (link, point) in enumerate(_places(guides, limb, starts, at, factor)):
            name = f"t{index}_{number}"
            etree.SubElement(links[link], "site", name=name, pos=_written(*point))
            etree.SubElement(spatial, "site", site=name)
    return etree.tostring(root, encoding="unicode")


def _joints_of_segments(model: mujoco.MjModel, chain: Chain, limb: Limb) -> list[list[int]]:
    data, joints = unloaded_pose(model), [list[int]() for _ in limb.segment_m]
    for joint in chain.joints:
        along = float((data.xanchor[joint] - limb.clamp_m) @ limb.along)
        segment = int(np.argmin(np.abs(limb.joint_m - along)))
        if int(model.jnt_type[joint]) == _HINGE and int(model.jnt_dofadr[joint]) not in limb.bending_dofs:
            raise LimbError("it has joints that twist it")
        if abs(limb.joint_m[segment] - along) > _IN_PLACE * limb.length_m:
            raise LimbError("its joints turn about their axes at different places")
        joints[segment].append(joint)
    return joints


def _add_joint(body: etree._Element, model: mujoco.MjModel, limb: Limb, joint: int, times: float) -> None:
    data, dof = unloaded_pose(model), int(model.jnt_dofadr[joint])
    element = etree.SubElement(body, "joint")
    if int(model.jnt_type[joint]) == _BALL:
        element.set("type", "ball")
    else:
        element.set("axis", _written(*(_frame(limb) @ data.xaxis[joint])))
    element.set("stiffness", _written(times * float(np.atleast_1d(model.jnt_stiffness[joint])[0])))
    element.set("damping", _written(times * float(np.atleast_1d(model.dof_damping[dof])[0])))
    element.set("armature", _written(times * float(model.dof_armature[dof])))


def _add_material(body: etree._Element, limb: Limb, rod: Rod, begin: float, end: float) -> None:
    """Add to a link the rod's mass between two positions along it [m], and a visual geom."""
    mass = first = second = 0.0
    edges = np.concatenate([[0.0], np.cumsum(rod.lengths_m)])
    for low, high, density in zip(edges[:-1], edges[1:], rod.mass_per_length_kg_m, strict=True):
        a, b = max(float(low), begin) - begin, min(float(high), end) - begin
        if b > a:
            mass, first, second = (
                mass + density * (b - a),
                first + density * (b**2 - a**2) / 2.0,
                second + density * (b**3 - a**3) / 3.0,
            )
    if end >= edges[-1] - 1e-9:
        place = end - begin + rod.tip_offset_m
        mass, first = mass + rod.tip_mass_kg, first + rod.tip_mass_kg * place
        second += rod.tip_mass_kg * place**2 + rod.tip_inertia_kg_m2
    middle = first / mass
    across = second - first * middle + mass * limb.radius_m**2 / 4.0
    inertial = etree.SubElement(body, "inertial", pos=_written(0.0, 0.0, middle), mass=_written(mass))
    inertial.set("diaginertia", _written(across, across, mass * limb.radius_m**2 / 2.0))
    shape = etree.SubElement(body, "geom", type="cylinder", mass="0", contype="0", conaffinity="0")
    shape.set("size", _written(limb.radius_m))
    shape.set("fromto", _written(0.0, 0.0, 0.0, 0.0, 0.0, end - begin))


def _places(
    guides: tuple[Guide, ...], limb: Limb, starts: Vector, at: Vector, factor: int
) -> list[tuple[int, tuple[float, float, float]]]:
    """Return the link (0 for the base) and the position in its frame [m] of every guide, in the order of the cable."""
    before = [(0, (*guide.across_m, guide.place)) for guide in guides if guide.segment < 0]
    places = []
    for segment in range(len(limb.segment_m)):
        inside = [guide for guide in guides if guide.segment == segment]
        for number in range(segment * factor, (segment + 1) * factor):
            for guide in inside:
                along = float(starts[number] + guide.place * (starts[number + 1] - starts[number]))
                link = number + 1 if guide.outer else number
                origin = float(at[link - 1]) if link else 0.0
                places.append((link, (*guide.across_m, along - origin)))
    return [*before, *places]


def _frame(limb: Limb) -> Vector:
    """Return the rotation matrix from the world to the frame of a rewritten limb, (3, 3)."""
    return np.array([limb.transverse, limb.axis, limb.along])


def _written(*numbers: float) -> str:
    return " ".join(f"{number:.12g}" for number in numbers)
