"""Faults that keep a robot from moving: obstacles, weakness and stiffness."""

# ruff: noqa: ARG001 - every change takes a generator and a size, whether it needs them or not
from __future__ import annotations

import mujoco
import numpy as np
from benchmarks.validator.corpus.faults.anatomy import (
    Anatomy,
    Array,
    first_of,
    inner_joints,
    pull_actuators,
    read_anatomy,
)
from benchmarks.validator.corpus.faults.injection import Injection, UnsuitableError, of_spec, present


def collars(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Add ribs along every second segment that nearly meet each other; their gap is 0.04 / `size` segment lengths."""
    anatomy = read_anatomy(spec)
    for limb in anatomy.limbs:
        if len(limb.bodies) < 5:
            raise UnsuitableError("a short limb")
        wide = max(anatomy.half_width_m(body) for body in limb.bodies)
        half = limb.spacing_m * (1 - 0.02 / size)
        for index in range(-1, len(limb.bodies), 2):
            body = limb.bodies[index] if index >= 0 else int(anatomy.model.body_parentid[limb.bodies[0]])
            along = limb.direction(max(index, 0))
            middle = limb.anchors_m[max(index, 0)] + (0.5 if index >= 0 else -0.5) * limb.spacing_m * along
            _add_ribs(spec, anatomy, body, middle, half * along, wide)
    return f"ribs on every second segment, {0.04 / size:.2g} segment lengths apart"


def _add_ribs(spec: mujoco.MjSpec, anatomy: Anatomy, body: int, middle: Array, half: Array, wide: float) -> None:
    """Add four boxes to a body, around a line that reaches from `half` before to `half` behind `middle`."""
    found = spec.body(anatomy.model.body(body).name)
    if found is None or not found.name:
        raise UnsuitableError("bodies without names")
    first = np.cross(half, [1.0, 0.3, 0.2])
    second = np.cross(half, first)
    for side in (first, second, -first, -second):
        point = middle + 1.8 * wide * side / np.linalg.norm(side)
        found.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            fromto=np.concatenate([anatomy.to_local(body, point - half), anatomy.to_local(body, point + half)]),
            size=[0.5 * wide, 0, 0],
            mass=1e-5,
            solref=[0.004, 1],
        )


def short_servos(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Use position servos that only pull and pay out at most `1 + 0.02 (1 / size - 1)` of the tendon's rest length.

    The servos are weak: antagonists that are strong for the stiffness of the joints make the limb buckle instead.
    """
    anatomy = read_anatomy(spec)
    upper = 1 + 0.02 * (1 / size - 1)
    for actuator in pull_actuators(spec):
        index = anatomy.model.tendon(actuator.target).id
        if index not in anatomy.routes:
            raise UnsuitableError("a tendon that is not spatial")
        length = float(anatomy.data.ten_length[index])
        lever = anatomy.half_width_m(first_of(anatomy.limbs).bodies[0])
        force = 0.3 * float(inner_joints(spec)[0].stiffness[0]) / lever
        kp = 80 * force / length
        actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        actuator.dyntype = mujoco.mjtDyn.mjDYN_NONE
        actuator.gainprm = [kp, *[0] * 9]
        actuator.biasprm = [0, -kp, -0.02 * kp, *[0] * 7]
        actuator.gear = [1, 0, 0, 0, 0, 0]
        actuator.ctrlrange, actuator.ctrllimited = [0.85 * length, upper * length], 1
        actuator.forcerange, actuator.forcelimited = [-force, 0], 1
    return f"servos that let tendons out to {upper:.4g} of their rest length"


def taut_limits(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Limit every driven tendon, so that it can shorten by at most 0.02 / `size` of its length."""
    anatomy = read_anatomy(spec)
    for actuator in pull_actuators(spec):
        index = anatomy.model.tendon(actuator.target).id
        if index not in anatomy.routes:
            raise UnsuitableError("a tendon that is not spatial")
        length = float(anatomy.data.ten_length[index])
        found = spec.tendon(actuator.target)
        found.range, found.limited = [length * (1 - 0.02 / size), 2 * length], 1
        found.solref_limit, found.solimp_limit = [0.004, 1], [0.99, 0.9999, 0.0001, 0.5, 2]
    return f"tendons may shorten by {2 / size:.2g} % only"


def weaker(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Divide the forces of all actuators by `size`."""
    for actuator in spec.actuators:
        actuator.gainprm, actuator.biasprm = np.array(actuator.gainprm) / size, np.array(actuator.biasprm) / size
        actuator.forcerange = np.array(actuator.forcerange) / size
    return f"forces divided by {size:.3g}"


def stiffer(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Multiply the stiffness and damping of joints by `size`."""
    for joint in inner_joints(spec):
        joint.stiffness, joint.damping = np.array(joint.stiffness) * size, np.array(joint.damping) * size
    return f"joints {size:.3g} times stiffer"


def heavy_tip(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Add `size` x 100 times its own mass to the last segment of every limb."""
    anatomy = read_anatomy(spec)
    tips = {limb.bodies[-1] for limb in anatomy.limbs}
    names = {anatomy.model.body(tip).name for tip in tips}
    if "" in names or not names:
        raise UnsuitableError("bodies without names")
    for name in names:
        mass = float(anatomy.model.body(name).mass[0])
        found = spec.body(name)
        place = np.array(anatomy.model.body(name).ipos)
        wide = anatomy.half_width_m(anatomy.model.body(name).id)
        found.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[0.5 * wide, 0, 0],
            pos=place,
            mass=100 * size * mass,
            contype=0,
            conaffinity=0,
        )
    return f"{100 * size:.3g} times the mass at the tip"


def sluggish(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Set the rotor inertia of every joint to `size` s2 times its stiffness: 1 / omega of a swing is sqrt(`size`)."""
    for joint in inner_joints(spec):
        joint.armature = size * float(joint.stiffness[0])
    return f"armature {size:.3g} s2 times the stiffness"


def tied_tip(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Weld every second segment of every limb to the world."""
    anatomy = read_anatomy(spec)
    if anatomy.model.nq != anatomy.model.nv or any(int(kind) == 0 for kind in anatomy.model.jnt_type):
        raise UnsuitableError("a free robot or ball joints")
    for limb in anatomy.limbs:
        for index in range(0, len(limb.bodies), 2):
            name = anatomy.model.body(limb.bodies[index]).name
            # by default MuJoCo keeps the relative pose of the document
            spec.add_equality(
                type=mujoco.mjtEq.mjEQ_WELD,
                objtype=mujoco.mjtObj.mjOBJ_BODY,
                name1=name,
                name2="world",
                solref=[0.004, 1],
            )
    return "every second segment welded to the world"


def still_sensors(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Replace all sensors by sensors of the base, which does not move."""
    if any(int(joint.type) == 0 for joint in spec.joints):
        raise UnsuitableError("everything moves")
    for sensor in list(spec.sensors):
        spec.delete(sensor)
    bodies = [body for body in spec.worldbody.bodies if body.name and not list(body.joints)]
    if not bodies:
        raise UnsuitableError("no base that stands still")
    kinds = [mujoco.mjtSensor.mjSENS_FRAMEPOS, mujoco.mjtSensor.mjSENS_FRAMEQUAT, mujoco.mjtSensor.mjSENS_FRAMEZAXIS]
    for index in range(int(rng.integers(1, 4))):
        spec.add_sensor(
            name=f"still_{index}", type=kinds[index], objtype=mujoco.mjtObj.mjOBJ_BODY, objname=bodies[0].name
        )
    return "sensors moved to the base"


HOLDING: tuple[Injection, ...] = (
    Injection("self_collision_lock", of_spec(collars), {"bad": (1.0, 4), "near miss": (0.03, 0.06)}),
    Injection("antagonist_lock", of_spec(short_servos), {"bad": (2, 6), "near miss": (0.05, 0.1), "band": (0.2, 0.6)}),
    Injection(
        "tendon_against_limit", of_spec(taut_limits), {"bad": (40, 500), "near miss": (0.02, 0.1), "band": (6, 40)}
    ),
    Injection("actuator_too_weak", of_spec(weaker), {"bad": (60, 3000), "near miss": (1.1, 2), "band": (10, 60)}),
    Injection("too_stiff", of_spec(stiffer), {"bad": (60, 5000), "near miss": (1.1, 2), "band": (8, 40)}),
    Injection("mass_ratio", of_spec(heavy_tip), {"bad": (100, 3000), "near miss": (0.01, 0.1)}),
    Injection("armature_large", of_spec(sluggish), {"bad": (100, 5000), "near miss": (1e-5, 1e-3)}),
    Injection("no_effect", of_spec(tied_tip), present()),
    Injection("sensor_constant", of_spec(still_sensors), present()),
)
"""Faults of robots that do not move when driven."""
