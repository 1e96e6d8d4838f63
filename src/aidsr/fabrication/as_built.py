"""MJCF of the robot as it will be built, with the masses, stiffnesses, joint ranges and shapes of its parts."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from aidsr.fabrication.build import PrintedPart, RobotBuild
from aidsr.fabrication.schema import Change
from aidsr.mjcf.compile import parse_mjcf
from aidsr.sandbox.isolated import isolated
from aidsr.sim.strip_scenery import write_out_inertias
from aidsr.sim.structure import name_of

_NOTICED = 0.01
"""Relative difference above which a value is listed as changed. Our choice: the repeatability of a printer."""


@dataclass(frozen=True)
class Wall:
    """A massless capsule to add to a body."""

    body: int
    """Number of the body."""
    ends_m: list[list[float]]
    """End points in the robot's frame (2, 3)."""
    radius_m: float


def changes_of(build: RobotBuild) -> tuple[Change, ...]:
    """Return the differences between the robot as built and as simulated, in words."""
    found = [*_mass_changes(build), *_joint_changes(build)]
    gaps = [gap.length_mm for gap in build.skeleton.gaps]
    if gaps:
        least, most = f"{min(gaps):.1f}", f"{max(gaps):.1f}"
        width = least if least == most else f"{least} to {most}"
        found.append(
            Change(
                what="skin at the joints",
                simulated="closed from part to part",
                built=f"open for {width} mm between parts, so that they can bend",
            )
        )
    if build.shaping.ducts:
        found.append(
            Change(
                what="guides",
                simulated="points beside the body",
                built=f"ducts in walls along every part, holes of {2 * max(b.radius_mm for b in build.bores):.1f} mm: "
                f"a cable may lie {max(b.radius_mm for b in build.bores) - 0.2:.1f} mm off its line",
            )
        )
    if any(not cable.actuator and not cable.wraps for cable in build.anatomy.cables):
        found.append(
            Change(
                what="cables that nothing drives",
                simulated="with what springs, dampers and stops the file gives them",
                built="not strung: without these forces",
            )
        )
    if build.winches:
        found.append(
            Change(
                what="winches",
                simulated="without mass, at the first guide",
                built="on a board beside the robot, through sheaths that cost about 15 % of the pull; not simulated",
            )
        )
    if build.shaping.flange_mm:
        found.append(Change(what="foot", simulated="held by the world", built="a flange with four screws M4"))
    return tuple(found)


@dataclass(frozen=True)
class Masses:
    """Masses of the printed pieces with the rods in them [kg].

    Attributes:
        simulated_kg: As simulated.
        built_kg: As built.
        moving_simulated_kg: As simulated, without the pieces that are fixed to the world.
        moving_built_kg: As built, without the pieces that are fixed to the world.
    """

    simulated_kg: float
    built_kg: float
    moving_simulated_kg: float
    moving_built_kg: float


def masses_of(build: RobotBuild) -> Masses:
    """Return the masses of a robot's printed pieces, as simulated and as built."""

    def summed(pieces: Sequence[PrintedPart]) -> tuple[float, float]:
        simulated = sum(piece.weight.simulated_kg * len(piece.used_for) for piece in pieces)
        return simulated, sum(piece.weight.mass_kg * len(piece.used_for) for piece in pieces)

    return Masses(*summed(build.robot_parts), *summed(build.moving_parts))


def _mass_changes(build: RobotBuild) -> list[Change]:
    masses = masses_of(build)
    if abs(masses.built_kg - masses.simulated_kg) <= _NOTICED * masses.simulated_kg:
        return []

    def grams(all_kg: float, moving_kg: float) -> str:
        whole_g, moving_g = round(1000 * all_kg, 1), round(1000 * moving_kg, 1)
        parts = f": {moving_g:.1f} g move, {whole_g - moving_g:.1f} g are fixed"
        return f"{whole_g:.1f} g" + parts * (masses.simulated_kg > masses.moving_simulated_kg)

    simulated = grams(masses.simulated_kg, masses.moving_simulated_kg)
    built = f"{grams(masses.built_kg, masses.moving_built_kg)}; as near as the infill of each piece allows"
    return [Change(what="mass of all pieces", simulated=simulated, built=built)]


def _joint_changes(build: RobotBuild) -> list[Change]:
    found, joints = [], build.anatomy.joints
    softer = [
        hinge
        for hinge in build.hinges.hinges.values()
        if abs(hinge.stiffness_n_m_rad / min(joints[hinge.joint].stiffness_n_m_rad) - 1) > _NOTICED
    ]
    if softer:
        worst = max(softer, key=lambda h: abs(h.stiffness_n_m_rad / min(joints[h.joint].stiffness_n_m_rad) - 1))
        asked = min(joints[worst.joint].stiffness_n_m_rad)
        name = joints[worst.joint].names[0]
        built = f"{worst.stiffness_n_m_rad:.3f} N m/rad, as thicknesses are rounded to 0.05 mm"
        found.append(Change(what=f"stiffness, most at {name}", simulated=f"{asked:.3f} N m/rad", built=built))
    found += _range_changes(build)
    bent = [h for h in build.hinges.hinges.values() if build.skeleton.gaps[h.joint].bend_rad > h.linear_rad]
    if bent:
        angle = min(hinge.linear_rad for hinge in bent)
        found.append(
            Change(
                what="springs",
                simulated="of constant stiffness",
                built=f"NiTi, softer beyond {math.degrees(angle):.0f} deg a joint; not simulated",
            )
        )
    return found


def _range_changes(build: RobotBuild) -> Iterator[Change]:
    """Yield the joints whose faces touch before the simulated limit, and those without a stop at that limit."""
    gaps = [(gap.touch_rad, build.anatomy.joints[gap.joint].limits_rad) for gap in build.skeleton.gaps]
    stopped = [(touch, limits) for touch, limits in gaps if touch < np.abs(limits).max()]
    free = [(touch, limits) for touch, limits in gaps if touch > np.abs(limits).min()]
    if stopped:
        angle, limits = min(stopped)
        where = f"at the tightest of {_joints(len(stopped))}, where walls touch"
        yield Change(what="range of joints", simulated=_format_limits(limits), built=f"{_both(angle)} {where}")
    if free:
        angle, limits = max(free)
        where = f"at the widest of {_joints(len(free))}: no stop is built before walls touch"
        yield Change(what="stops of joints", simulated=_format_limits(limits), built=f"{_both(angle)} {where}")


def _joints(count: int) -> str:
    return "1 joint" if count == 1 else f"{count} joints"


def _both(angle_rad: float) -> str:
    return f"{-math.degrees(angle_rad):.0f} to {math.degrees(angle_rad):.0f} deg"


def _format_limits(limits: tuple[tuple[float, float], ...]) -> str:
    low, high = min(limits, key=lambda both: float(np.abs(both).min()))
    return f"{math.degrees(low):.0f} to {math.degrees(high):.0f} deg" if math.isfinite(high - low) else "without limit"


def as_built(build: RobotBuild, mjcf: str) -> str:
    """Return the MJCF of a robot as it is built.

    Raises:
        MjcfError: The changed robot cannot be compiled.
        IsolationError: Compiling exceeded a limit.
    """
    return rewrite(mjcf, _mass_factors(build), _joint_values(build), _skins(build), _walls(build) + _bending(build))


def _mass_factors(build: RobotBuild) -> dict[int, float]:
    """Return built / simulated mass of each body, by the body's number."""
    shares = Counter(part for piece in build.shaping.pieces for part in piece.parts)
    of_piece = {name: part.weight for part in build.robot_parts for name in part.used_for}
    factors: dict[int, float] = dict.fromkeys(shares, 0.0)
    for piece in build.shaping.pieces:
        weight = of_piece[piece.name]
        for part in piece.parts:
            factors[part] += (weight.mass_kg / weight.simulated_kg if weight.simulated_kg else 1.0) / shares[part]
    return {body: factors[part] for part in factors for body in build.anatomy.parts[part].body_ids}


def _joint_values(build: RobotBuild) -> dict[str, dict[str, float]]:
    values: dict[str, dict[str, float]] = {}
    for index, hinge in build.hinges.hinges.items():
        touch_rad = build.skeleton.gaps[index].touch_rad
        for name in build.anatomy.joints[index].names:
            values[name] = {"stiffness": hinge.stiffness_n_m_rad, "range": touch_rad}
    return values


def _skins(build: RobotBuild) -> dict[str, list[list[float]]]:
    """Return the new end points of the capsules and cylinders that end at gaps, by the geom's name [m]."""
    found: dict[str, list[list[float]]] = {}
    for gap in build.skeleton.gaps:
        joint = build.anatomy.joints[gap.joint]
        for part, face in (
            (joint.parent, gap.anchor - gap.before_mm * gap.before),
            (joint.child, gap.anchor + gap.after_mm * gap.after),
        ):
            for shape in build.anatomy.parts[part].shapes:
                axis = np.array(shape.rotation).reshape(3, 3)[:, 2]
                middle, half = np.array(shape.position_mm), shape.size_mm[1]
                ends = found.get(shape.name, [list((middle - half * axis) / 1000), list((middle + half * axis) / 1000)])
                nearest = [float(np.linalg.norm(np.array(end) * 1000 - gap.anchor)) for end in ends]
                if shape.kind in ("capsule", "cylinder") and min(nearest) < 1.0:
                    ends[int(np.argmin(nearest))] = list(face / 1000)
                    found[shape.name] = ends
    return found


def _walls(build: RobotBuild) -> list[Wall]:
    """Return the walls around ducts, as capsules."""
    return [
        Wall(
            duct.body,
            [list(duct.begin / 1000), list(duct.end / 1000)],
            build.bores[duct.cable].wall_radius(duct) / 1000,
        )
        for duct in build.shaping.ducts
        if len(duct.path) > 1
    ]


def _bending(build: RobotBuild) -> list[Wall]:
    """Return the hinge in each gap as two capsules, one on each of the two parts."""
    found = []
    for index, hinge in build.hinges.hinges.items():
        gap, joint = build.skeleton.gaps[index], build.anatomy.joints[index]
        for body, face in zip(
            joint.bodies,
            (gap.anchor - gap.before_mm * gap.before, gap.anchor + gap.after_mm * gap.after),
            strict=True,
        ):
            ends = [list(gap.anchor / 1000), list(face / 1000)]
            found.append(Wall(body, ends, hinge.thickness_mm / 2000))
    return found


@isolated
def rewrite(
    mjcf: str,
    masses: dict[int, float],
    joints: dict[str, dict[str, float]],
    skins: dict[str, list[list[float]]],
    walls: list[Wall],
) -> str:
    """Return the MJCF of a robot with masses, joints and shapes as built; runs in an isolated process.

    Args:
        mjcf: The robot as designed.
        masses: Built / simulated mass, by the body's number.
        joints: "stiffness" [N m/rad] and "range" [rad], by the joint's name.
        skins: New end points (2, 3) [m] of capsules and cylinders, by the geom's name.
        walls: Capsules to add.
    """
    spec = parse_mjcf(mjcf)
    write_out_inertias(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bodies = {int(body.id): body for body in spec.bodies}
    for number, factor in masses.items():
        _weigh(bodies[number], model, number, factor)
    for joint in spec.joints:
        new = joints.get(name_of(model, mujoco.mjtObj.mjOBJ_JOINT, int(joint.id)))
        if new is not None:
            _bend(joint, new, degree=spec.compiler.degree)
    for geom in spec.geoms:
        ends = skins.get(name_of(model, mujoco.mjtObj.mjOBJ_GEOM, int(geom.id)))
        if ends is not None:
            _shorten(geom, ends, model, data, int(geom.id))
    _slacken(spec)
    for wall in walls:
        _add_wall(bodies[wall.body], wall, data)
    spec.compile()
    return str(spec.to_xml())


def _bend(joint: Any, new: dict[str, float], *, degree: bool) -> None:
    """Set the stiffness [N m/rad] of a joint and its range [rad], which is symmetric about the initial pose."""
    if np.ndim(joint.stiffness):
        joint.stiffness = [new["stiffness"], *([0.0] * (len(joint.stiffness) - 1))]
    else:
        joint.stiffness = new["stiffness"]
    most = math.degrees(new["range"]) if degree else new["range"]
    joint.range = [0.0, most] if joint.type == mujoco.mjtJoint.mjJNT_BALL else [joint.ref - most, joint.ref + most]
    joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE


def _slacken(spec: mujoco.MjSpec) -> None:
    """Remove the forces of tendons without an actuator: no cable is cut for them. Sensors on them remain."""
    driven = {actuator.target for actuator in spec.actuators if actuator.trntype == mujoco.mjtTrn.mjTRN_TENDON}
    for tendon in spec.tendons:
        if tendon.name not in driven:
            tendon.stiffness, tendon.damping = 0.0 * tendon.stiffness, 0.0 * tendon.damping
            tendon.frictionloss = tendon.armature = 0.0
            tendon.limited = mujoco.mjtLimited.mjLIMITED_FALSE


def _weigh(body: Any, model: mujoco.MjModel, number: int, factor: float) -> None:
    if model.body_mass[number] <= 0:
        return
    body.explicitinertial = True
    body.mass = factor * float(model.body_mass[number])
    body.inertia = factor * model.body_inertia[number]
    body.ipos, body.iquat = model.body_ipos[number], model.body_iquat[number]
    body.fullinertia = np.full(6, np.nan)


def _local(data: mujoco.MjData, body: int, points: Any) -> Any:
    return (np.array(points) - data.xpos[body]) @ data.xmat[body].reshape(3, 3)


def _shorten(geom: Any, ends: Any, model: mujoco.MjModel, data: mujoco.MjData, number: int) -> None:
    """Turn a capsule or cylinder into a cylinder between two end points, because built parts have flat ends."""
    begin, end = _local(data, int(model.geom_bodyid[number]), ends)
    geom.type = mujoco.mjtGeom.mjGEOM_CYLINDER
    geom.fromto, geom.pos = [*begin, *end], np.zeros(3)  # MuJoCo accepts only one of the two
    geom.size = [float(model.geom_size[number, 0]), 0.0, 0.0]


def _add_wall(body: Any, wall: Wall, data: mujoco.MjData) -> None:
    begin, end = _local(data, wall.body, wall.ends_m)
    like = next((geom for geom in body.geoms), None)
    new = body.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[*begin, *end], size=[wall.radius_m, 0.0, 0.0])
    new.mass = 0.0
    if like is not None:
        for name in ("contype", "conaffinity", "condim", "friction", "solref", "solimp", "group", "rgba", "material"):
            setattr(new, name, getattr(like, name))
