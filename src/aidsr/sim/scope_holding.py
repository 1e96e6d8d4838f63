"""Scope checks of other causes of motion and support: axles, springs, outside forces, outside constraints."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.ownership import equality_bodies, joins_bodies
from aidsr.sim.scope_reader import ScopeFinding, ScopeReader
from aidsr.sim.soft_body import unlocked_dofs
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2
from aidsr.sim.tendon_effects import length_gradient

Vector = NDArray[np.float64]

FREE_TURN_RAD = 1.5 * np.pi
"""Range of a joint without a spring above which it counts as an axle. Our choice: joints of a limb have at most half of
that."""
SPRING_SHARE = 0.02
"""Torque of a joint's spring at a quarter turn / (weight x L), below which the joint counts as one without a spring.
Our choice."""
SAME_LINE = 0.05
"""Distance / L between parallel hinges below which they turn about the same line, a wheel's axle. Our choice: half a
segment of a ten-segment limb; a limb that curls by three quarters of a turn within that length runs into itself."""
_PARALLEL_COSINE = 0.98
"""Smallest cosine between the axes of parallel hinges."""
LOADED_SHARE = 1.0
"""Largest allowed energy of all springs in the initial pose / (weight x L). Our choice: springs with more energy throw
the robot up by its length; a blade that springs press on a wall has half of that."""
_OUTSIDE_RANGE_RAD = 0.02
"""Angle outside its range, or inside its margin, at which a joint may start; for a slide, distance / L. Our choice:
rounding of degrees."""
_PRELOAD_RAD = 0.1
"""Rotation of a joint that relaxes its spring, up to which the spring never counts as loaded."""
_PRELOAD_SLIDE = 0.02
"""The same for a slide, as distance / L. Our choice: what 0.1 rad move a point at a fifth of L."""
_PRELOAD_SHARE = 2.0
"""Torque of a spring in the initial pose / torque of the weight that the joint carries, above which the spring counts
as loaded if no cable bends the joint. Our choice: a spring that only carries this weight has at most 1."""
_JNT = mujoco.mjtJoint
_HINGE, _BALL = int(_JNT.mjJNT_HINGE), int(_JNT.mjJNT_BALL)
_SLIDE = int(_JNT.mjJNT_SLIDE)


def find_axles(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find hinges and balls that can turn by more than three quarters of a turn and that no spring returns.

    Hinges about one line, one carried by the other, turn as one.
    """
    model = reader.model
    axles = set[int]()
    for joint in reader.inner_joints():
        if int(model.jnt_type[joint]) == _SLIDE:
            continue
        line = _hinges_on_line(reader, joint)
        room = sum(_room_rad(model, each) for each in line)
        stiffness = np.abs(np.asarray(model.jnt_stiffness)[line])
        torque = np.pi / 2 / float((1 / stiffness).sum()) if stiffness.all() else 0.0
        if room > FREE_TURN_RAD and torque < SPRING_SHARE * reader.weight_n * reader.length_m:
            axles.update(line)
    if axles:
        names = tuple(reader.joint(joint) for joint in sorted(axles))
        yield ScopeFinding("wheel", "turns like a wheel on its axle, and no spring returns it", names, len(names), 0)


def _room_rad(model: mujoco.MjModel, joint: int) -> float:
    """Return the angle by which a hinge or ball can turn from one end of its range to the other."""
    if not model.jnt_limited[joint]:
        return np.inf
    low, high = model.jnt_range[joint]
    return float(2 * high if int(model.jnt_type[joint]) == _BALL else high - low)


def _hinges_on_line(reader: ScopeReader, joint: int) -> list[int]:
    """Return a joint and, if it is a hinge, the hinges nearer to the root that turn about the same line."""
    model, data = reader.model, reader.data
    found, body = [joint], int(model.jnt_bodyid[joint])
    axis, away_m = data.xaxis[joint], SAME_LINE * reader.length_m
    carriers = set[int]()
    while body:
        carriers.add(body)
        body = int(model.body_parentid[body])
    for other in reader.inner_joints() if int(model.jnt_type[joint]) == _HINGE else ():
        if other >= joint or int(model.jnt_type[other]) != _HINGE or int(model.jnt_bodyid[other]) not in carriers:
            continue
        gap_m = np.linalg.norm(np.cross(axis, data.xanchor[other] - data.xanchor[joint]))
        if abs(float(axis @ data.xaxis[other])) > _PARALLEL_COSINE and gap_m < away_m:
            found.append(other)
    return found


def find_springs(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find springs that are loaded in the initial pose.

    Reported is the first of three faults that is found: too much energy in all springs, a spring that is loaded beyond
    the weight that it carries, or joints that start outside their range.
    """
    model = reader.model
    energy: dict[str, float] = {}
    away: dict[str, float] = {}
    for joint in reader.inner_joints():
        name, at = reader.joint(joint), int(model.jnt_qposadr[joint])
        stretch = _joint_stretch(model, joint)
        if int(model.jnt_type[joint]) != _BALL:
            low, high = model.jnt_range[joint]
            outside = max(low - model.qpos0[at], model.qpos0[at] - high) if model.jnt_limited[joint] else 0.0
            outside += float(model.jnt_margin[joint]) * bool(model.jnt_limited[joint])  # the limit acts before its end
            if outside > (
                _OUTSIDE_RANGE_RAD if int(model.jnt_type[joint]) == _HINGE else _OUTSIDE_RANGE_RAD * reader.length_m
            ):
                away[name] = float(outside)
        energy[name] = _spring_energy_j(float(model.jnt_stiffness[joint]), model.jnt_stiffnesspoly[joint], stretch)
        if _pushes_away(model.jnt_stiffness[joint], model.jnt_stiffnesspoly[joint], _reach(reader, joint)):
            energy[name] = np.inf
    for tendon in reader.structure.tendons:
        name, stretch = reader.name("TENDON", tendon.id), _tendon_stretch(reader, tendon.id)
        stiffness = float(model.tendon_stiffness[tendon.id])
        energy[name] = _spring_energy_j(stiffness, model.tendon_stiffnesspoly[tendon.id], stretch)
        if _pushes_away(stiffness, model.tendon_stiffnesspoly[tendon.id], reader.length_m):
            energy[name] = np.inf
    allowed_j = LOADED_SHARE * reader.weight_n * reader.length_m
    whole = sum(energy.values())
    if whole > allowed_j:
        names = tuple(name for name, joules in energy.items() if joules > 0.05 * whole or np.isinf(joules))
        message = "springs are loaded in the initial pose"
        if np.isfinite(whole) and reader.weight_n > 0:
            unit_j = reader.weight_n * reader.length_m
            yield ScopeFinding(
                "loaded_spring", message, names, whole / unit_j, LOADED_SHARE, whole=unit_j, whole_unit="J"
            )
        else:
            message = message if np.isfinite(whole) else "a spring with negative stiffness pushes from its rest"
            yield ScopeFinding("loaded_spring", message, names, None, LOADED_SHARE)
    elif thrown := [joint for joint in reader.inner_joints() if _throws(reader, joint)]:
        message = "no cable bends the joint, and its spring is loaded beyond what hangs on it"
        yield ScopeFinding("loaded_spring", message, tuple(map(reader.joint, thrown)), len(thrown), 0, "loaded springs")
    elif away:
        message = "starts outside the range of the joint, whose limit throws it back"
        yield ScopeFinding(
            "loaded_spring", message, tuple(away), max(away.values()), _OUTSIDE_RANGE_RAD, "rad outside its range"
        )


def _throws(reader: ScopeReader, joint: int) -> bool:
    """Return whether springs on a joint that no cable bends are loaded far beyond the weight that it carries.

    These are the joint's own spring and those of tendons that act on it.
    """
    model, data, dof = reader.model, reader.data, int(reader.model.jnt_dofadr[joint])
    body, kind = int(model.jnt_bodyid[joint]), int(model.jnt_type[joint])
    if body in reader.soft.bent:
        return False
    slides = kind == _SLIDE
    lever = 1.0 if slides else float(np.linalg.norm(data.subtree_com[body] - data.xanchor[joint]))
    carried = float(model.body_subtreemass[body]) * STANDARD_GRAVITY_M_S2 * lever
    pulls, relaxed = [0.0], [0.0]
    stretch = _joint_stretch(model, joint)
    pulls.append(_spring_force(float(model.jnt_stiffness[joint]), model.jnt_stiffnesspoly[joint], stretch))
    relaxed.append(abs(stretch) if pulls[-1] else 0.0)
    for tendon in reader.structure.tendons:
        arm, stretch = float(length_gradient(model, data, tendon.id)[dof]), _tendon_stretch(reader, tendon.id)
        force = _spring_force(float(model.tendon_stiffness[tendon.id]), model.tendon_stiffnesspoly[tendon.id], stretch)
        if kind != _BALL and abs(arm) > np.finfo(float).eps and force:
            pulls.append(arm * force)
            relaxed.append(abs(stretch / arm))
    torque, room = abs(sum(pulls)), _PRELOAD_SLIDE * reader.length_m if slides else _PRELOAD_RAD
    return max(relaxed) > room and torque > _PRELOAD_SHARE * carried


def _joint_stretch(model: mujoco.MjModel, joint: int) -> float:
    """Return the deflection of a joint's spring in the reference pose [rad; m for a slide]."""
    at = int(model.jnt_qposadr[joint])
    if int(model.jnt_type[joint]) == _BALL:
        return _turn_between(model.qpos0[at : at + 4], model.qpos_spring[at : at + 4])
    return float(model.qpos0[at] - model.qpos_spring[at])


def _tendon_stretch(reader: ScopeReader, tendon: int) -> float:
    """Return the deflection of a tendon's spring in the reference pose [m]; negative if it is pressed together."""
    length, (low, high) = float(reader.data.ten_length[tendon]), reader.model.tendon_lengthspring[tendon]
    return float(max(0.0, length - high) - max(0.0, low - length))


def _reach(reader: ScopeReader, joint: int) -> float:
    """Return how far a joint's spring can be deflected within the joint's range [rad; m for a slide]."""
    model, at = reader.model, int(reader.model.jnt_qposadr[joint])
    kind = int(model.jnt_type[joint])
    if not model.jnt_limited[joint]:
        return reader.length_m if kind == _SLIDE else 2 * np.pi
    low, high = model.jnt_range[joint]
    if kind == _BALL:
        return float(high) + _joint_stretch(model, joint)
    return float(max(abs(low - model.qpos_spring[at]), abs(high - model.qpos_spring[at])))


def find_outside_forces(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find gravity compensation and wind."""
    model = reader.model
    lifted = [body for body in reader.structure.bodies if model.body_gravcomp[body] != 0]
    if lifted:
        force_n = STANDARD_GRAVITY_M_S2 * sum(
            abs(float(model.body_gravcomp[body])) * float(model.body_mass[body]) for body in lifted
        )
        names = tuple(reader.name("BODY", body) for body in lifted)
        yield ScopeFinding("outside_force", "gravity compensation carries it", names, force_n, 0)
    elif np.any(model.opt.wind) and not reader.structure.is_scene:
        speed = float(np.linalg.norm(model.opt.wind))
        yield ScopeFinding("outside_force", "the robot's own <option> makes wind", (), speed, 0, "m/s of wind")


def find_outside_holds(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find equality constraints, mocap bodies, cables and slides between the robot and its surroundings."""
    model, structure = reader.model, reader.structure
    ours = set(structure.bodies)
    held: list[str] = []
    for equality in np.flatnonzero(np.asarray(model.eq_active0)).tolist():
        ends = equality_bodies(model, equality) if joins_bodies(model, equality) else ()
        apart = len({int(model.body_weldid[end]) for end in ends}) > 1
        if apart and len([end for end in ends if end in ours]) == 1:
            held.append(reader.name("EQUALITY", equality))
    held += [reader.name("BODY", body) for body in structure.bodies if model.body_mocapid[body] >= 0]
    for tendon in structure.tendons:
        outside = any(body not in ours for body in tendon.bodies)
        if outside and (structure.is_scene or structure.free_roots):
            held.append(reader.name("TENDON", tendon.id))
    for root in structure.roots:
        first, count = int(model.body_jntadr[root]), int(model.body_jntnum[root])
        held += [reader.joint(j) for j in range(first, first + count) if int(model.jnt_type[j]) == _SLIDE]
    if held:
        yield ScopeFinding("held_from_outside", "holds or guides the robot from outside", tuple(held), len(held), 0)


def find_locked_joints(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find joints that equality constraints lock."""
    model = reader.model
    free = unlocked_dofs(model, reader.data)
    locked = [joint for joint in reader.inner_joints() if not free[int(model.jnt_dofadr[joint])]]
    if locked:
        names = tuple(reader.joint(joint) for joint in locked)
        yield ScopeFinding("joint_locked", "an equality constraint leaves the joint no motion", names, len(locked), 0)


def _turn_between(one: Vector, other: Vector) -> float:
    """Return the angle between two orientations, given as quaternions [rad]."""
    velocity = np.zeros(3)
    mujoco.mju_subQuat(velocity, np.asarray(one), np.asarray(other))
    return float(np.linalg.norm(velocity))


def _spring_force(stiffness: float, poly: Vector, stretch: float) -> float:
    """Return the force with which a spring returns to its rest [N; N m for a rotation]; see `_spring_energy_j`."""
    x = abs(stretch)
    return -float(np.sign(stretch)) * x * (abs(stiffness) + float(poly[0]) * x + float(poly[1]) * x**2)


def _pushes_away(stiffness: float, poly: Vector, reach: float) -> bool:
    """Return whether a spring pushes away from its rest at a deflection up to `reach`; see `_spring_energy_j`."""
    x = np.linspace(0.0, reach, 101)
    return bool((stiffness + poly[0] * x + poly[1] * x**2 < 0).any())


def _spring_energy_j(stiffness: float, poly: Vector, stretch: float) -> float:
    """Return the energy of a spring [J].

    Source: MuJoCo XML reference, joint/stiffness: force = x (k + p0 |x| + p1 x^2).
    """
    x = abs(stretch)
    return 0.5 * stiffness * x**2 + float(poly[0]) * x**3 / 3 + float(poly[1]) * x**4 / 4
