"""Static bending of a robot's joints by single cables, against all that resists: springs, dampers, stops, couplings.

In MuJoCo, joints and tendons both have springs, dampers, rotors, friction and stops, and equality constraints couple
them. Each of these can make a joint rigid, whatever the stiffness of its own spring.

Source: MuJoCo XML reference, joint/stiffness: force = x (k + p0 |x| + p1 x^2), the same for joint/damping with the
velocity, and the same for tendons.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.actuator_force import gear_of
from aidsr.sim.couplings import read_couplings
from aidsr.sim.structure import Structure
from aidsr.sim.tendon_effects import length_gradient

Vector = NDArray[np.float64]

SLOWEST_S = 10.0
"""Time within which a joint has to bend; a joint that damping and armature hold longer counts as rigid. Our choice:
about the length of an episode."""
_STOP_GIVES_RAD = 1e-4
"""Angle by which the largest torque moves a joint beyond its stop. Our choice: a two-hundredth of the bend that counts
in a limb of five joints."""
_FREE_RAD = 1e6
"""Angle by which the largest torque turns a joint without a spring, unless a stop is nearer. Our choice: above any
range, so that the equations have one solution."""
_STEPS, _HALVINGS = 60, 30
_CLOSE = 1e-6
"""Largest unbalanced torque / largest torque at which the bends are found."""
_PATH = np.linspace(0.0, 1.0, 21)
"""Positions of a leading joint, as shares of its bend, at which its follower is calculated."""
_SCALAR = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


@dataclass(frozen=True)
class _Elements:
    """What resists along m coordinates: each degree of freedom first, then the tendons that resist.

    Attributes:
        rows: Derivatives of the coordinates with respect to the degrees of freedom, (m, nv).
        at: Coordinates in the reference pose, (m,).
        rest: Ends of the interval in which the spring exerts no force, (m, 2).
        spring, damper: k, p0, p1 of each, (m, 3).
        rotor: Armature, (m,).
        low, high: Displacements to the stops, (m,).
    """

    rows: Vector
    at: Vector
    rest: Vector
    spring: Vector
    damper: Vector
    rotor: Vector
    low: Vector
    high: Vector

    @property
    def linear(self) -> Vector:
        """Stiffness of each coordinate without polynomial terms and stops, (m,)."""
        return np.asarray(self.spring[:, 0] + self.damper[:, 0] / SLOWEST_S + 2.0 * self.rotor / SLOWEST_S**2)

    def forces(self, moved: Vector, stop: Vector) -> tuple[Vector, Vector]:
        """Return the force against displacements along the coordinates, and its derivative, (m,) each.

        Args:
            moved: Displacements from the reference pose, (m,).
            stop: Stiffness of the stops, (m,).
        """
        low, high = self.rest.T
        start, now = (at - np.clip(at, low, high) for at in (self.at, self.at + moved))
        force, stiffness = _polynomial(self.spring, now)
        force -= _polynomial(self.spring, start)[0]
        stiffness[(now == 0.0) & (low < high)] = 0.0
        drag, viscosity = _polynomial(self.damper, moved / SLOWEST_S)
        inertia = 2.0 * self.rotor / SLOWEST_S**2
        beyond = moved - np.clip(moved, self.low, self.high)
        return (
            force + drag + inertia * moved + stop * beyond,
            stiffness + viscosity / SLOWEST_S + inertia + stop * (beyond != 0.0),
        )


def _polynomial(factors: Vector, x: Vector) -> tuple[Vector, Vector]:
    """Return x (k + p0 |x| + p1 x^2) and its derivative, (m,) each."""
    k, p0, p1 = factors.T
    return x * (k + p0 * np.abs(x) + p1 * x**2), k + 2.0 * p0 * np.abs(x) + 3.0 * p1 * x**2


def bends_by_cables(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    bent: mujoco.MjData,
    structure: Structure,
    pulls: Iterable[Vector],
    room: Vector,
) -> tuple[Vector, Vector]:
    """Return the largest torque of a single cable on each degree of freedom, and the largest bend by one, (nv,) each.

    A joint's limit of the force of its actuators applies to the torques, and friction is subtracted. Bends are [rad; m
    for a slide] from the reference pose; infinite for a joint that nothing resists.

    Args:
        model: Compiled model.
        data: Data of the model in the reference pose.
        bent: Data in a slightly bent pose, in which moment arms are read.
        structure: The robot in the model.
        pulls: Generalized force of each cable at its strongest, (nv,) [N m; N for a slide].
        room: How far each degree of freedom may move, (nv,) [rad; m for a slide].
    """
    elements = _read_elements(model, data, bent, structure)
    free = _free_motions(model, data)
    plain = free is None and len(elements.rows) == model.nv and not _is_curved(elements)
    torque, bend = np.zeros(model.nv), np.zeros(model.nv)
    for pull in pulls:
        left = _without_friction(model, bent, structure, pull)
        torque = np.maximum(torque, np.abs(left))
        if not plain and left.any():
            bend = np.maximum(bend, np.abs(_equilibrium(elements, left, free)))
    if plain:
        with np.errstate(divide="ignore", invalid="ignore"):
            bend = np.where(torque > 0, torque / elements.linear, 0.0)
    return torque, _within_followers(model, np.minimum(bend, room))


def stiffness_alone(
    model: mujoco.MjModel, data: mujoco.MjData, bent: mujoco.MjData, structure: Structure, angle: Vector
) -> Vector:
    """Return the torque that turns each degree of freedom alone by an angle / that angle, (nv,) [N m/rad].

    The easier direction counts; stops of joints are left out.

    Args:
        model: Compiled model.
        data: Data of the model in the reference pose.
        bent: Data in a slightly bent pose.
        structure: The robot in the model.
        angle: The angles, (nv,) [rad; m for a slide].
    """
    elements = _read_elements(model, data, bent, structure)
    dofs, stop = model.nv, np.zeros(len(elements.rows))
    stop[dofs:] = 1.0 / np.finfo(float).eps
    found = np.full((2, dofs), np.inf)
    for way, sign in enumerate((1.0, -1.0)):
        for dof in range(dofs):
            row = elements.rows[:, dof]
            found[way, dof] = abs(float(row @ elements.forces(sign * angle[dof] * row, stop)[0]))
    return np.asarray(found.min(axis=0) / angle)


def _read_elements(model: mujoco.MjModel, data: mujoco.MjData, bent: mujoco.MjData, structure: Structure) -> _Elements:
    joints = np.asarray(model.dof_jntid)
    scalar = np.isin(np.asarray(model.jnt_type)[joints], _SCALAR)
    place = np.asarray(model.jnt_qposadr)[joints]
    start = np.where(scalar, np.asarray(model.qpos0)[place], 0.0)
    rest = np.where(scalar, np.asarray(model.qpos_spring)[place], 0.0)
    limited = np.asarray(model.jnt_limited, dtype=bool)[joints]
    margin = np.asarray(model.jnt_margin)[joints]
    ends = np.asarray(model.jnt_range)[joints]
    brakes = _brakes(model, structure)
    tendons = [tendon.id for tendon in structure.tendons if _resists(model, tendon.id) or brakes[tendon.id].any()]
    drag = np.array([brakes[tendon] for tendon in tendons]).reshape(-1, 4)
    lengths = np.asarray(data.ten_length)[tendons]
    tied = np.asarray(model.tendon_limited, dtype=bool)[tendons]
    slack = np.asarray(model.tendon_margin)[tendons]
    spans = np.asarray(model.tendon_range)[tendons].reshape(-1, 2)
    gradients = np.array([length_gradient(model, bent, tendon) for tendon in tendons]).reshape(len(tendons), model.nv)
    return _Elements(
        rows=np.concatenate([np.eye(model.nv), gradients]),
        at=np.concatenate([start, lengths]),
        rest=np.concatenate([np.stack([rest, rest], axis=1), model.tendon_lengthspring[tendons].reshape(-1, 2)]),
        spring=_factors(
            np.concatenate([np.asarray(model.jnt_stiffness)[joints], np.asarray(model.tendon_stiffness)[tendons]]),
            np.concatenate([model.jnt_stiffnesspoly[joints], model.tendon_stiffnesspoly[tendons]]),
        ),
        damper=_factors(
            np.concatenate([model.dof_damping, np.abs(model.tendon_damping[tendons]) + drag[:, 0]]),
            np.concatenate([model.dof_dampingpoly, np.abs(model.tendon_dampingpoly[tendons]) + drag[:, 1:3]]),
        ),
        rotor=np.concatenate([model.dof_armature, np.asarray(model.tendon_armature)[tendons] + drag[:, 3]]),
        low=np.concatenate(
            [
                np.where(limited, np.minimum(ends[:, 0] + margin - start, 0.0), -np.inf),
                np.where(tied, np.minimum(spans[:, 0] + slack - lengths, 0.0), -np.inf),
            ]
        ),
        high=np.concatenate(
            [
                np.where(limited, np.maximum(ends[:, 1] - margin - start, 0.0), np.inf),
                np.where(tied, np.maximum(spans[:, 1] - slack - lengths, 0.0), np.inf),
            ]
        ),
    )


def _factors(linear: Vector, poly: Vector) -> Vector:
    """Return the magnitudes of the factors of springs or dampers, (m, 3)."""
    return np.asarray(np.abs(np.concatenate([linear[:, None], poly.reshape(-1, 2)], axis=1)))


def _brakes(model: mujoco.MjModel, structure: Structure) -> dict[int, Vector]:
    """Return damping d, p0, p1 and armature of the actuators on each tendon of the robot, as its own, (4,)."""
    brakes = {tendon.id: np.zeros(4) for tendon in structure.tendons}
    for actuator in structure.tendon_actuators:
        gear = abs(float(gear_of(model, actuator)[0]))
        own = np.abs([model.actuator_damping[actuator], *model.actuator_dampingpoly[actuator]])
        inertia = float(model.actuator_armature[actuator])
        tendon = int(model.actuator_trnid[actuator, 0])
        if tendon in brakes:
            brakes[tendon] += [*(own * gear ** np.array([2, 3, 4])), inertia * gear**2]
    return brakes


def _resists(model: mujoco.MjModel, tendon: int) -> bool:
    values = (
        model.tendon_stiffness[tendon],
        model.tendon_damping[tendon],
        model.tendon_armature[tendon],
        model.tendon_limited[tendon],
        *model.tendon_stiffnesspoly[tendon],
        *model.tendon_dampingpoly[tendon],
    )
    return any(value != 0 for value in values)


def _is_curved(elements: _Elements) -> bool:
    return bool(elements.spring[:, 1:].any() or elements.damper[:, 1:].any())


def _without_friction(model: mujoco.MjModel, bent: mujoco.MjData, structure: Structure, pull: Vector) -> Vector:
    """Return what joints' limits of actuator forces, their friction and that of tendons leave of a cable's pull."""
    joints = np.asarray(model.dof_jntid)
    capped = np.asarray(model.jnt_actfrclimited, dtype=bool)[joints]
    low, high = np.asarray(model.jnt_actfrcrange)[joints].T
    left = np.where(capped, np.clip(pull, low, high), pull)
    friction = np.array(model.dof_frictionloss)
    for tendon in structure.tendons:
        if model.tendon_frictionloss[tendon.id]:
            friction += model.tendon_frictionloss[tendon.id] * np.abs(length_gradient(model, bent, tendon.id))
    return np.asarray(np.sign(left) * np.maximum(np.abs(left) - friction, 0.0))


def _free_motions(model: mujoco.MjModel, data: mujoco.MjData) -> Vector | None:
    """Return the motions that joint and tendon equalities leave in the reference pose, (nv, k); None without any."""
    kinds = (int(mujoco.mjtEq.mjEQ_JOINT), int(mujoco.mjtEq.mjEQ_TENDON))
    rows = [
        row
        for row in np.flatnonzero(np.asarray(data.efc_type) == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)).tolist()
        if int(model.eq_type[data.efc_id[row]]) in kinds
    ]
    if not rows:
        return None
    _, sizes, ways = np.linalg.svd(constraint_jacobian(model, data)[rows])
    rank = int((sizes > 1e-6 * sizes.max(initial=0.0)).sum())
    return np.asarray(ways[rank:].T)


def constraint_jacobian(model: mujoco.MjModel, data: mujoco.MjData) -> Vector:
    """Return the Jacobian of all constraints, (nefc, nv).

    Args:
        model: Compiled model.
        data: Data of the model after `mj_forward`.
    """
    jacobian = np.zeros((data.nefc, model.nv))
    if mujoco.mj_isSparse(model):
        mujoco.mju_sparse2dense(jacobian, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
        return jacobian
    return np.asarray(data.efc_J).reshape(data.nefc, model.nv)


def _equilibrium(elements: _Elements, torque: Vector, free: Vector | None) -> Vector:
    """Return the displacements at which the elements balance a torque, (nv,), by Newton's method.

    Every element resists more, the farther it is moved, so the equilibrium is the only minimum of the energy.

    Args:
        elements: What resists.
        torque: The torque, (nv,).
        free: Motions that couplings leave, (nv, k); None for all.
    """
    largest, dofs = float(np.abs(torque).max()), len(torque)
    ways = np.eye(dofs) if free is None else free
    arms = np.abs(elements.rows).max(axis=1)
    stop = largest / _STOP_GIVES_RAD / np.maximum(arms, np.finfo(float).tiny ** 0.25) ** 2
    softest = largest / _FREE_RAD

    def unbalanced(moved: Vector) -> tuple[Vector, Vector]:
        force, stiffness = elements.forces(elements.rows @ moved, stop)
        return ways.T @ (torque - elements.rows.T @ force - softest * moved), stiffness

    moved = np.zeros(dofs)
    for _ in range(_STEPS):
        rest, stiffness = unbalanced(moved)
        if np.abs(rest).max(initial=0.0) <= _CLOSE * largest:
            break
        tangent = (elements.rows.T * stiffness) @ elements.rows + softest * np.eye(dofs)
        step = np.linalg.lstsq(ways.T @ tangent @ ways, rest, rcond=None)[0]
        downhill, share, short, far = float(step @ rest), 1.0, 0.0, 1.0
        for _ in range(_HALVINGS):
            slope = float(step @ unbalanced(moved + share * (ways @ step))[0])
            if abs(slope) <= 0.5 * downhill:
                break
            short, far = (share, far) if slope > 0.0 else (short, share)
            share = (short + far) / 2.0
        moved = moved + share * (ways @ step)
    return moved


def _within_followers(model: mujoco.MjModel, bend: Vector) -> Vector:
    """Return the bends, (nv,), of which no follower's is beyond what its leader's bend makes of it.

    Of the two directions, that with the smaller bend of the follower counts.
    """
    bend = np.array(bend)
    for each in read_couplings(model):
        if each.leader >= 0:
            led, dof = int(model.jnt_dofadr[each.leader]), int(model.jnt_dofadr[each.joint])
            path = _PATH * min(bend[led], np.pi)
            bend[dof] = min(bend[dof], *(float(np.abs(each.polynomial(way * path)).max()) for way in (-1.0, 1.0)))
    return bend
