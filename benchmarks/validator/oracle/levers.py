"""Measures of how cables bend a robot, from the lengths of cables while joints are turned, as symptom / limit."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import mujoco
import numpy as np
from benchmarks.validator.oracle.loop import Bench
from benchmarks.validator.oracle.trace import Array

_HINGE, _BALL = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL)
_STEP_RAD = 1e-4
_BENT_RAD = 0.03


def same_levers(bench: Bench) -> float:
    """Return 0.05 / the relative difference between the levers of the two most similar cables."""
    rows = _levers(bench)
    closest = math.inf
    for one, other in combinations(rows, 2):
        largest = max(float(np.linalg.norm(one)), float(np.linalg.norm(other)))
        if largest > 1e-4 * bench.length_m:
            closest = min(closest, float(np.linalg.norm(one - other)) / largest)
    return 0.05 / max(closest, 1e-3)


def parallel_hinges(bench: Bench) -> float:
    """Return 11 degrees / the smallest angle between two hinges at one point."""
    model, start, worst = bench.model, bench.start, 0.0
    for body in range(1, model.nbody):
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        for one, other in combinations(range(first, first + count), 2):
            apart = np.linalg.norm(start.xanchor[one] - start.xanchor[other])
            if {int(model.jnt_type[one]), int(model.jnt_type[other])} == {_HINGE} and apart < 1e-4 * bench.length_m:
                cosine = min(1.0, abs(float(start.xaxis[one] @ start.xaxis[other])))
                worst = max(worst, 11 / max(math.degrees(math.acos(cosine)), 0.1))
    return worst


def short_reach(bench: Bench) -> float:
    """Return 0.5 / the share of a limb up to the last joint that any cable bends, for the worst limb of four joints."""
    rows = np.abs(_levers(bench))
    if not len(rows):
        return 0.0
    together, worst = rows.max(axis=0), 0.0
    for limb in _limbs(bench):
        at = np.array([together[dofs].max() for dofs in limb])
        if len(at) >= 4 and at.max() > 1e-3 * bench.length_m:
            reached = np.flatnonzero(at > 0.05 * at.max()).max() + 1
            worst = max(worst, 0.5 * len(at) / float(reached))
    return worst


def cancelled(bench: Bench) -> float:
    """Return 0.25 / the share that is left of a cable's levers along a limb, in one plane, when they are added up.

    Only cables that change sides at least twice count.
    """
    worst = 0.0
    for along in _along_limbs(bench):
        if len(along) >= 4 and np.abs(along).max() > 1e-3 * bench.length_m:
            kept = abs(float(along.sum())) / float(np.abs(along).sum())
            turns = int(np.count_nonzero(np.diff(np.sign(along[np.abs(along) > 0.05 * np.abs(along).max()]))))
            worst = max(worst, 0.25 / max(kept, 0.05) if turns >= 2 else 0.0)
    return worst


def dip(bench: Bench) -> float:
    """Return the share of its lever that a cable loses in the middle of a limb and regains further out / 0.25."""
    worst = 0.0
    for along in _along_limbs(bench):
        along = along * np.sign(along.sum())
        scale = float(np.median(along[along > 0])) if (along > 0).any() else 0.0
        if len(along) < 4 or scale < 1e-3 * bench.length_m:
            continue
        for k in range(1, len(along) - 1):
            lost = min(along[:k].max(), along[k + 1 :].max()) - along[k]
            worst = max(worst, float(lost) / scale / 0.25)
    return worst


def _along_limbs(bench: Bench) -> Iterator[Array]:
    """Yield the levers of each cable along each limb about the axes of one direction, in order from the root."""
    for levers in _levers(bench):
        for limb in _limbs(bench):
            dofs = [dof for group in limb for dof in group]
            axes = np.array([_axis(bench, dof) for dof in dofs])
            left = list(range(len(dofs)))
            while left:
                alike = [k for k in left if abs(float(axes[k] @ axes[left[0]])) > 0.99]
                signs = np.array([np.sign(axes[k] @ axes[left[0]]) for k in alike])
                yield levers[[dofs[k] for k in alike]] * signs
                left = [k for k in left if k not in alike]


def _pulled(bench: Bench) -> list[int]:
    """Return the spatial tendons that actuators pull, each once."""
    model = bench.model
    pulled = dict.fromkeys(int(model.actuator_trnid[actuator, 0]) for actuator in bench.pulling)
    joints = int(mujoco.mjtWrap.mjWRAP_JOINT)
    return [tendon for tendon in pulled if int(model.wrap_type[model.tendon_adr[tendon]]) != joints]


def _levers(bench: Bench) -> Array:
    """Return the change of each pulled cable's length per radian of each dof, in a slightly bent pose, (n, nv)."""
    model, data, pulled = bench.model, mujoco.MjData(bench.model), _pulled(bench)
    turning = [dof for dof in range(model.nv) if _turns(bench, dof)]
    levers, bent = np.zeros((len(pulled), model.nv)), np.zeros(model.nv)
    bent[turning] = _BENT_RAD
    for dof in turning:
        for side in (1, -1):
            turn = bent.copy()
            turn[dof] += side * _STEP_RAD
            data.qpos[:] = model.qpos0
            mujoco.mj_integratePos(model, data.qpos, turn, 1.0)
            mujoco.mj_fwdPosition(model, data)
            levers[:, dof] += side * data.ten_length[pulled] / (2 * _STEP_RAD)
    return levers


def _turns(bench: Bench, dof: int) -> bool:
    return int(bench.model.jnt_type[bench.model.dof_jntid[dof]]) in (_HINGE, _BALL)


def _axis(bench: Bench, dof: int) -> Array:
    """Return the direction of the axis of a degree of freedom in the drawn pose."""
    model, joint = bench.model, int(bench.model.dof_jntid[dof])
    if int(model.jnt_type[joint]) == _HINGE:
        return np.array(bench.start.xaxis[joint])
    frame = bench.start.xmat[int(model.jnt_bodyid[joint])].reshape(3, 3)
    return np.array(frame[:, dof - int(model.jnt_dofadr[joint])])


def _limbs(bench: Bench) -> list[list[list[int]]]:
    """Return the limbs: series of turning bodies without a branch, each body as its turning degrees of freedom."""
    model = bench.model
    turning = {
        body: [dof for dof in range(model.nv) if int(model.dof_bodyid[dof]) == body and _turns(bench, dof)]
        for body in bench.moving
    }
    chain = [body for body in bench.moving if turning[body]]
    below = {body: [other for other in chain if int(model.body_parentid[other]) == body] for body in chain}
    starts = [b for b in chain if len(below.get(int(model.body_parentid[b]), [])) != 1]
    limbs = []
    for start in starts:
        line = [start]
        while len(below[line[-1]]) == 1:
            line.append(below[line[-1]][0])
        limbs.append([turning[body] for body in line])
    return limbs
