"""MJCF of the robot as it will be built, with the masses, stiffnesses, joint ranges and shapes of its parts."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from aidsr.fabrication.build import RobotBuild
from aidsr.mjcf.compile import parse_mjcf
from aidsr.sandbox.isolated import isolated
from aidsr.sim.strip_scenery import write_out_inertias
from aidsr.sim.structure import name_of


@dataclass(frozen=True)
class Wall:
    """A massless capsule to add to a body."""

    body: int
    """Number of the body."""
    ends_m: list[list[float]]
    """End points in the robot's frame (2, 3)."""
    radius_m: float


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
    _write_out_springs(spec, model)
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


def _write_out_springs(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Replace the time constant and damping ratio of joints by the stiffness and damping made of them.

    With both of `springdamper`, the compiler ignores a stiffness that is set, and makes another one as masses change.

    Source: MuJoCo XML reference, body/joint, springdamper.
    """
    for joint in spec.joints:
        if min(joint.springdamper) > 0:
            number = int(joint.id)
            dof = int(model.jnt_dofadr[number])
            joint.stiffness = _of_first_order(joint.stiffness, np.ravel(model.jnt_stiffness[number])[0])
            joint.damping = _of_first_order(joint.damping, np.ravel(model.dof_damping[dof])[0])
            joint.springdamper = [0.0, 0.0]


def _of_first_order(before: Any, value: float) -> Any:
    """Return a stiffness or damping of a value that does not depend on the position, in the form of the one before.

    Some versions of MuJoCo have one number, others the coefficients of a polynomial.
    """
    return [float(value), *([0.0] * (len(before) - 1))] if np.ndim(before) else float(value)


def _bend(joint: Any, new: dict[str, float], *, degree: bool) -> None:
    """Set the stiffness [N m/rad] of a joint, at rest in the initial pose, and its range [rad], symmetric about it."""
    joint.stiffness = _of_first_order(joint.stiffness, new["stiffness"])
    joint.springref = joint.ref
    most = math.degrees(new["range"]) if degree else new["range"]
    joint.range = [0.0, most] if joint.type == mujoco.mjtJoint.mjJNT_BALL else [joint.ref - most, joint.ref + most]
    joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE


def _slacken(spec: mujoco.MjSpec) -> None:
    """Remove the forces of tendons that no cable has. Sensors on them remain.

    A cable has no spring, damper or stop. Friction and armature of a driven tendon stay: they stand for its ducts and
    for the rotor of its winch (docs/physics.md). No cable is cut for a tendon without an actuator.
    """
    driven = {actuator.target for actuator in spec.actuators if actuator.trntype == mujoco.mjtTrn.mjTRN_TENDON}
    for tendon in spec.tendons:
        tendon.stiffness, tendon.damping = 0.0 * tendon.stiffness, 0.0 * tendon.damping
        tendon.limited = mujoco.mjtLimited.mjLIMITED_FALSE
        if tendon.name not in driven:
            tendon.frictionloss = tendon.armature = 0.0


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
