"""Coupled joints: an equality constraint makes a joint (the follower) follow another joint (the leader).

A leader and its followers have one degree of freedom together.

Source: MuJoCo XML reference, equality/joint: y - y0 = a0 + a1 (x - x0) + ... + a4 (x - x0)^4, where y is the first
joint, x the second, y0 and x0 their reference positions; without a second joint, y is held at y0 + a0.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from aidsr.sim.tendon_effects import length_gradient_entries

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Coupling:
    """A hinge or slide that follows another joint.

    Attributes:
        joint: Id of the follower.
        leader: Id of the leader; -1 if the follower is held in place.
        polynomial: Displacement of the follower from its reference position as a polynomial of the leader's
            displacement [rad or m].
    """

    joint: int
    leader: int
    polynomial: Polynomial


def read_couplings(model: mujoco.MjModel) -> tuple[Coupling, ...]:
    """Return the active joint equalities, each leader before its followers.

    Couplings in a cycle, and those that depend on one, are left out.
    """
    kind = int(mujoco.mjtEq.mjEQ_JOINT)
    waiting: dict[int, Coupling] = {}
    for equality in np.flatnonzero(np.asarray(model.eq_active0)).tolist():
        if int(model.eq_type[equality]) == kind:
            joint, leader = int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])
            coefficients = np.array(model.eq_data[equality, :5])
            polynomial = Polynomial(coefficients if leader >= 0 else coefficients[:1])
            waiting.setdefault(joint, Coupling(joint, leader, polynomial))
    ordered: list[Coupling] = []
    while ready := [each for each in waiting.values() if each.leader not in waiting]:
        ordered += ready
        for each in ready:
            del waiting[each.joint]
    return tuple(ordered)


def coupled_dofs(model: mujoco.MjModel, data: mujoco.MjData) -> NDArray[np.bool_]:
    """Return which degrees of freedom each active joint or tendon equality makes depend on each other, (n, nv).

    The size of a ratio does not matter, as it may differ from pose to pose.

    Args:
        model: Compiled model.
        data: Data of the model after `mj_forward`.
    """
    rows = [np.zeros(model.nv, dtype=bool)]
    for equality in np.flatnonzero(np.asarray(model.eq_active0)).tolist():
        kind, row = int(model.eq_type[equality]), np.zeros(model.nv, dtype=bool)
        ends = [int(end) for end in (model.eq_obj1id[equality], model.eq_obj2id[equality]) if end >= 0]
        if kind == int(mujoco.mjtEq.mjEQ_JOINT) and model.eq_data[equality, 1:5].any():
            row[model.jnt_dofadr[ends]] = True
        elif kind == int(mujoco.mjtEq.mjEQ_TENDON):
            for end in ends:
                row[length_gradient_entries(model, data, end)[0]] = True
        rows.append(row)
    return np.array(rows)


def follow(model: mujoco.MjModel, couplings: tuple[Coupling, ...], qpos: Array) -> None:
    """Set the position of every follower from the position of its leader, in place.

    Args:
        model: Compiled model.
        couplings: Couplings of that model, leaders first.
        qpos: Joint positions, (nq,); changed.
    """
    for each in couplings:
        at, reference = int(model.jnt_qposadr[each.joint]), model.qpos0
        led = int(model.jnt_qposadr[each.leader]) if each.leader >= 0 else at
        qpos[at] = reference[at] + each.polynomial(qpos[led] - reference[led])


def onto_leaders(model: mujoco.MjModel, couplings: tuple[Coupling, ...], qpos: Array, arms: Array) -> Array:
    """Return moment arms with those of the followers added to their leaders; the arms of followers become 0.

    Args:
        model: Compiled model.
        couplings: Couplings of that model, leaders first.
        qpos: Pose that satisfies the couplings, (nq,).
        arms: Moment arms about every degree of freedom, (..., nv) [m/rad; 1 for a slide].
    """
    moved = np.array(arms)
    for each in reversed(couplings):
        dof = int(model.jnt_dofadr[each.joint])
        if each.leader >= 0:
            at = int(model.jnt_qposadr[each.leader])
            slope = float(each.polynomial.deriv()(qpos[at] - model.qpos0[at]))
            moved[..., int(model.jnt_dofadr[each.leader])] += slope * moved[..., dof]
        moved[..., dof] = 0.0
    return moved
