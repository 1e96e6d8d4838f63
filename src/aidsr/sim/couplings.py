"""Joints that follow another one: coupled by an equality, they are one degree of freedom together.

Source: MuJoCo XML reference, equality/joint: y - y0 = a0 + a1 (x - x0) + ... + a4 (x - x0)^4, y the first joint, x the
second, y0 and x0 their reference positions; without a second joint y is held.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Coupling:
    """A hinge or slide that follows another.

    Attributes:
        joint: What follows.
        leader: What it follows; -1 where it is held.
        way: Its way from its reference position, of the way of the leader [rad or m].
    """

    joint: int
    leader: int
    way: Polynomial


def read_couplings(model: mujoco.MjModel) -> tuple[Coupling, ...]:
    """Return the active joint equalities, what leads before what follows it; one of a circle is left out."""
    kind = int(mujoco.mjtEq.mjEQ_JOINT)
    waiting: dict[int, Coupling] = {}
    for equality in np.flatnonzero(np.asarray(model.eq_active0)).tolist():
        if int(model.eq_type[equality]) == kind:
            joint, leader = int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])
            coefficients = np.array(model.eq_data[equality, :5])
            way = Polynomial(coefficients if leader >= 0 else coefficients[:1])
            waiting.setdefault(joint, Coupling(joint, leader, way))
    ordered: list[Coupling] = []
    while ready := [each for each in waiting.values() if each.leader not in waiting]:
        ordered += ready
        for each in ready:
            del waiting[each.joint]
    return tuple(ordered)


def follow(model: mujoco.MjModel, couplings: tuple[Coupling, ...], qpos: Array) -> None:
    """Put every joint that follows where its leader wants it, in place."""
    for each in couplings:
        at, reference = int(model.jnt_qposadr[each.joint]), model.qpos0
        led = int(model.jnt_qposadr[each.leader]) if each.leader >= 0 else at
        qpos[at] = reference[at] + each.way(qpos[led] - reference[led])


def onto_leaders(model: mujoco.MjModel, couplings: tuple[Coupling, ...], qpos: Array, arms: Array) -> Array:
    """Return moment arms about leaders and free joints, with what they do through the joints that follow.

    Args:
        model: Compiled model.
        couplings: Of that model.
        qpos: The pose, in which followers are where they belong, (nq,).
        arms: Moment arms about every degree of freedom, (..., nv) [m/rad; 1 for a slide].
    """
    moved = np.array(arms)
    for each in reversed(couplings):
        dof = int(model.jnt_dofadr[each.joint])
        if each.leader >= 0:
            at = int(model.jnt_qposadr[each.leader])
            slope = float(each.way.deriv()(qpos[at] - model.qpos0[at]))
            moved[..., int(model.jnt_dofadr[each.leader])] += slope * moved[..., dof]
        moved[..., dof] = 0.0
    return moved
