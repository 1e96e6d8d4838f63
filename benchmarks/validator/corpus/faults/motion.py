"""Robots that fall, sag, ring, chatter or diverge."""

# ruff: noqa: ARG001 - every change takes a generator and a size, whether it needs them or not
from __future__ import annotations

import mujoco
import numpy as np
from benchmarks.validator.corpus.faults.anatomy import Anatomy, first_of, inner_joints, pull_actuators, read_anatomy
from benchmarks.validator.corpus.faults.injection import Injection, UnsuitableError, of_spec, present

_FREE, _BALL = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)
_PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)


def _scale(joints: list[mujoco.MjsJoint], stiffness: float, damping: float) -> None:
    for joint in joints:
        joint.stiffness = np.array(joint.stiffness) * stiffness
        joint.damping = np.array(joint.damping) * damping


# --- standing --------------------------------------------------------------------------------------------------------


def contact_disabled(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Switch off all contacts of a free robot, by the bits of its geoms or by an option."""
    if not any(int(joint.type) == _FREE for joint in spec.joints):
        raise UnsuitableError("a fixed robot")
    return _untouchable(spec, rng)


def nothing_to_touch_with(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Switch off all contacts of a fixed robot whose task needs contact."""
    if any(int(joint.type) == _FREE for joint in spec.joints):
        raise UnsuitableError("a free robot")
    return _untouchable(spec, rng)


def _untouchable(spec: mujoco.MjSpec, rng: np.random.Generator) -> str:
    if rng.random() < 0.25:
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        return "contacts switched off in <option>"
    for geom in spec.geoms:
        if geom.parent.name != "world":
            geom.contype, geom.conaffinity = 0, 0
    return "contype and conaffinity of all geoms set to 0"


def free_fall(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Let the base of a fixed robot slide down without end."""
    if any(int(joint.type) == _FREE for joint in spec.joints):
        raise UnsuitableError("a free robot")
    root = spec.worldbody.bodies[0] if len(spec.worldbody.bodies) == 1 else None
    if root is None or not root.geoms or list(root.joints):
        raise UnsuitableError("no single root with a mass")
    gravity = np.array(spec.option.gravity)
    if not gravity.any():
        raise UnsuitableError("weightless")
    root.add_joint(name="lift", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, 0, 1], limited=0)
    return "a slide joint at the base, with nothing below it"


def floor_below(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Let a free robot start `size` x 0.3 of its length above its floor."""
    if not any(int(joint.type) == _FREE for joint in spec.joints):
        raise UnsuitableError("a fixed robot")
    anatomy = read_anatomy(spec)
    limb = max((np.ptp(limb.anchors_m, axis=0).max() for limb in anatomy.limbs), default=0.1)
    for geom in [geom for geom in spec.worldbody.geoms if int(geom.type) == _PLANE]:
        spec.delete(geom)
    model = spec.copy().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    lowest = min(data.geom_xpos[g][2] - model.geom_rbound[g] for g in range(model.ngeom) if model.geom_bodyid[g])
    spec.worldbody.add_geom(
        name="low_floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], pos=[0, 0, lowest - 0.3 * size * limb]
    )
    return f"the floor is {0.3 * size * limb:.3g} m below the robot"


# --- shape -----------------------------------------------------------------------------------------------------------


def softer(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Divide the stiffness and damping of joints by `size`."""
    _scale(inner_joints(spec), 1 / size, 1 / size)
    return f"joints {size:.3g} times softer"


def sprung(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Let the springs of hinges rest in a pose in which the longest limb is bent by `size` rad."""
    joints = [joint for joint in inner_joints(spec) if int(joint.type) != _BALL]
    limbs = read_anatomy(spec).limbs
    if not joints or not limbs or int(inner_joints(spec)[0].type) == _BALL:
        raise UnsuitableError("no hinges")
    axis = np.abs(np.array(joints[0].axis))
    same = [joint for joint in joints if np.allclose(np.abs(np.array(joint.axis)), axis)]
    unit = np.degrees(1) if spec.compiler.degree else 1.0
    for joint in same:
        joint.springref = unit * size / len(limbs[0].bodies)
        low, high = joint.range
        if low < high:
            joint.range = [min(low, -1.2 * abs(joint.springref)), max(high, 1.2 * abs(joint.springref))]
    return f"springs rest {size:.3g} rad away from the drawn pose"


def taut(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Make one tendon a spring that pulls at rest with the force that bends its limb by about `size` rad."""
    anatomy = read_anatomy(spec)
    tendon = pull_actuators(spec)[0].target
    index = anatomy.model.tendon(tendon).id
    length = float(anatomy.data.ten_length[index])
    if not length > 0:
        raise UnsuitableError("a fixed tendon, which has no length at rest")
    joint = inner_joints(spec)[0]
    offset = float(
        np.abs(anatomy.data.ten_J[anatomy.model.ten_J_rowadr[index] :][: anatomy.model.ten_J_rownnz[index]]).max()
    )
    pull = size * float(joint.stiffness[0]) / max(offset, 1e-4) / len(anatomy.limbs[0].bodies)
    found = spec.tendon(tendon)
    rest = 0.3 * length
    found.stiffness = [pull / (length - rest), 0, 0]
    found.damping = [0.02 * pull / (length - rest), 0, 0]
    found.springlength = [rest, rest]
    return f"tendon {tendon} is a spring much longer than its rest length"


# --- losses ----------------------------------------------------------------------------------------------------------


def negative_damping(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Change the sign of the damping of some joints, and multiply it by `size`."""
    joints = inner_joints(spec)
    chosen = joints if rng.random() < 0.5 else joints[:: int(rng.integers(2, 4))]
    for joint in chosen:
        joint.damping = -size * np.abs(np.array(joint.damping))
    return f"negative damping in {len(chosen)} joints"


def undamped(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Divide the damping of joints and tendons by `size`, and remove the friction of tendons."""
    _scale(inner_joints(spec), 1, 1 / size)
    for tendon in spec.tendons:
        tendon.damping = np.array(tendon.damping) / size
        tendon.frictionloss = 0
    return f"damping divided by {size:.3g}"


# --- integration -----------------------------------------------------------------------------------------------------


def stiff_and_undamped(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Multiply joint stiffness by `size` squared and remove damping: dt x omega grows by the factor `size`."""
    for joint in inner_joints(spec):
        joint.stiffness, joint.damping = np.array(joint.stiffness) * size**2, np.zeros(3)
    return f"joints {size**2:.3g} times stiffer and without damping"


def explicit_damping(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Integrate with Runge-Kutta, which treats damping explicitly, and multiply joint damping by `size`."""
    spec.option.integrator = int(mujoco.mjtIntegrator.mjINT_RK4)
    _scale(inner_joints(spec), 1, size)
    return f"RK4 with {size:.3g} times the damping"


def wild_force(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Multiply actuator forces by `size`, and divide joint damping by the square root of `size`."""
    for actuator in pull_actuators(spec):
        actuator.gainprm, actuator.biasprm = np.array(actuator.gainprm) * size, np.array(actuator.biasprm) * size
        actuator.forcerange = np.array(actuator.forcerange) * size
    _scale(inner_joints(spec), 1, 1 / np.sqrt(size))
    return f"forces times {size:.3g}"


def hammering(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Use servos with force limits and `size` times the velocity gain that the explicit integrator can follow.

    Source: v' = -c w v is stable under explicit steps dt below 2 / (c w); w = J (M + dt D)^-1 J' is the inverse inertia
    that a tendon with moment arms J feels, D the joint damping, which MuJoCo's Euler integrator treats implicitly.
    """
    anatomy = read_anatomy(spec)
    spec.option.integrator = int(mujoco.mjtIntegrator.mjINT_EULER)
    share = float(np.exp(rng.uniform(np.log(0.03), 0)))
    stiffness = share * 4 * float(inner_joints(spec)[0].stiffness[0])
    force = stiffness / anatomy.half_width_m(first_of(anatomy.limbs).bodies[0])
    for actuator in pull_actuators(spec):
        index = anatomy.model.tendon(actuator.target).id
        length = float(anatomy.data.ten_length[index])
        kp = 3 * force / length
        kv = size * 2 / (spec.option.timestep * _inverse_inertia(anatomy, index))
        actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        actuator.dyntype = mujoco.mjtDyn.mjDYN_NONE
        actuator.gainprm[:] = [kp, *[0] * 9]
        actuator.biasprm[:] = [0, -kp, -kv, *[0] * 7]
        actuator.gear[:] = [1, 0, 0, 0, 0, 0]
        actuator.ctrlrange, actuator.ctrllimited = [0.9 * length, 1.1 * length], 1
        actuator.forcerange, actuator.forcelimited = [-force, force], 1
    return f"{size:.3g} times the velocity gain that the Euler integrator can follow, forces of {force:.3g} N"


def _inverse_inertia(anatomy: Anatomy, tendon: int) -> float:
    """Return J (M + dt D)^-1 J' of a tendon in the drawn pose [1/kg]."""
    model, data = anatomy.model, anatomy.data
    levers, inertia = np.zeros(model.nv), np.zeros((model.nv, model.nv))
    first, count = int(model.ten_J_rowadr[tendon]), int(model.ten_J_rownnz[tendon])
    levers[model.ten_J_colind[first : first + count]] = data.ten_J.reshape(-1)[first : first + count]
    mujoco.mj_fullM(model, data, inertia)
    inertia += model.opt.timestep * np.diag(model.dof_damping)
    return float(levers @ np.linalg.solve(inertia, levers))


def soft_limits(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Limit joints to 5 degrees by soft limits, and multiply actuator forces by `size`."""
    hinges = [joint for joint in inner_joints(spec) if int(joint.type) != _BALL]
    if not hinges:
        raise UnsuitableError("no hinges")
    reach = 5.0 if spec.compiler.degree else np.radians(5)
    for joint in hinges:
        joint.range, joint.limited = [-reach, reach], 1
        joint.solref_limit, joint.solimp_limit = [0.5, 1], [0.01, 0.1, 0.5, 0.5, 2]
    for actuator in pull_actuators(spec):
        actuator.gainprm, actuator.biasprm = np.array(actuator.gainprm) * size, np.array(actuator.biasprm) * size
        actuator.forcerange = np.array(actuator.forcerange) * size
    return f"soft limits at 5 degrees, pulled {size:.3g} times as hard"


MOTION: tuple[Injection, ...] = (
    Injection("contact_disabled", of_spec(contact_disabled), present()),
    Injection("contact_disabled", of_spec(nothing_to_touch_with), present(), {"needs_contact": True}),
    Injection("free_fall", of_spec(free_fall), present()),
    Injection("free_fall", of_spec(floor_below), {"bad": (600, 3000)}),
    Injection("base_not_attached", of_spec(floor_below), {"bad": (3, 15), "near miss": (0.02, 0.3), "band": (0.6, 2)}),
    Injection("gravity_collapse", of_spec(softer), {"bad": (20, 400), "near miss": (1.1, 3), "band": (4, 16)}),
    Injection("passive_collapse", of_spec(sprung), {"bad": (3, 7), "near miss": (0.1, 0.35), "band": (0.6, 2)}),
    Injection("passive_collapse", of_spec(taut), {"bad": (4, 12), "near miss": (0.05, 0.3), "band": (0.6, 2)}),
    Injection("energy_growth", of_spec(negative_damping), {"bad": (0.05, 1.0)}),
    Injection("underdamped", of_spec(undamped), {"bad": (200, 5e4), "near miss": (1.5, 4), "band": (10, 100)}),
    Injection("numerical_instability", of_spec(stiff_and_undamped), {"bad": (10, 100), "band": (1, 5)}),
    Injection("numerical_instability", of_spec(explicit_damping), {"bad": (8, 200), "near miss": (0.001, 0.02)}),
    Injection("numerical_instability", of_spec(wild_force), {"bad": (100, 5000), "near miss": (1.1, 2)}),
    Injection("chatter", of_spec(hammering), {"bad": (4, 40), "near miss": (0.01, 0.2), "band": (0.5, 3)}),
    Injection("limit_overrun", of_spec(soft_limits), {"bad": (5, 80), "near miss": (0.5, 1.5), "band": (1.5, 6)}),
)
"""Faults of motion: some show while the robot is passive, others when it is driven."""
