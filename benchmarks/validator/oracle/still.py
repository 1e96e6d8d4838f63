"""Measures that need no motion: parts, ranges, overlaps, levers.

Each function returns the symptom / its limit: 2 is twice the limit, 0.5 is half of it. A fault that is either present
or not gives infinity or 0.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np
from benchmarks.validator.oracle.loop import Bench

_TENDON, _SLIDE = int(mujoco.mjtTrn.mjTRN_TENDON), int(mujoco.mjtJoint.mjJNT_SLIDE)
_TURNING = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL))
_SITE, _WRAP_JOINT = int(mujoco.mjtWrap.mjWRAP_SITE), int(mujoco.mjtWrap.mjWRAP_JOINT)
_PENETRATION = {"share": 0.2, "noticed": 0.002, "length": 0.01}


def missing_parts(bench: Bench, kind: str) -> float:
    """Return infinity if the model has no parts of a kind: "tendon", "u" (actuators) or "sensor"."""
    return math.inf if getattr(bench.model, f"n{kind}") == 0 else 0.0


def driven_joints_only(bench: Bench) -> float:
    """Return infinity if there are tendons and actuators, but no actuator pulls a tendon."""
    return math.inf if bench.model.ntendon and bench.model.nu and not bench.pulling else 0.0


def series(bench: Bench) -> float:
    """Return 1.5 / the largest number of turning points in series; infinity if there are fewer than three.

    A universal joint of two hinges is one point.
    """
    model, best = bench.model, 0
    for body in range(1, model.nbody):
        points: list[np.ndarray] = []
        at = body
        while at:
            for joint in range(model.body_jntadr[at], model.body_jntadr[at] + model.body_jntnum[at]):
                anchor = bench.start.xanchor[joint]
                apart = not points or np.linalg.norm(points[-1] - anchor) > 1e-3 * bench.length_m
                if int(model.jnt_type[joint]) in _TURNING and apart:
                    points.append(anchor)
            at = int(model.body_parentid[at])
        best = max(best, len(points))
    return math.inf if best < 3 else 3 / best / 2


def separate_parts(bench: Bench) -> float:
    """Return infinity if several bodies hang from the world without any constraint and not at a common height."""
    model = bench.model
    roots = [body for body in range(1, model.nbody) if model.body_parentid[body] == 0]
    if len(roots) < 2:
        return 0.0
    heights = [model.body_pos[root][2] for root in roots]
    level = np.ptp(heights) <= 0.01 * bench.length_m and not bench.free
    return 0.0 if level or model.neq else math.inf


def widest_gap(bench: Bench) -> float:
    """Return the largest gap between a body and its parent / median distance between joints / 0.5."""
    model, worst = bench.model, 0.0
    pairs = [(int(model.body_parentid[b]), b) for b in bench.moving if int(model.body_parentid[b]) in bench.moving]
    spacing = [float(np.linalg.norm(_anchor(bench, b) - _anchor(bench, a))) for a, b in pairs]
    for (parent, body), _ in zip(pairs, spacing, strict=True):
        ours, theirs = _geoms(model, body), _geoms(model, parent)
        if ours and theirs:
            reach = 10 * float(np.median(spacing))
            gaps = [mujoco.mj_geomDistance(model, bench.start, a, b, reach, None) for a in ours for b in theirs]
            worst = max(worst, min(gaps) / float(np.median(spacing)) / 0.5)
    return worst


def rank_of_actuation(bench: Bench) -> float:
    """Return infinity if there are as many independent actuators as inner degrees of freedom, else half their ratio.

    Each actuator is pulled alone, and the forces on all joints are compared.
    """
    model, data = bench.model, mujoco.MjData(bench.model)
    inner = [d for d in range(model.nv) if int(model.jnt_type[model.dof_jntid[d]]) != 0]
    rows = []
    for actuator in range(model.nu):
        data.ctrl[:] = 0
        mujoco.mj_forward(model, data)
        before = data.qfrc_actuator.copy()
        data.ctrl[actuator] = 1
        data.act[:] = data.ctrl[: model.na] if model.na == model.nu else 1.0
        mujoco.mj_forward(model, data)
        rows.append((data.qfrc_actuator - before)[inner])
        data.act[:] = 0
    rank = int(np.linalg.matrix_rank(np.array(rows))) if rows else 0
    return math.inf if rank >= len(inner) else rank / len(inner) / 2


def missing_ranges(bench: Bench) -> float:
    """Return infinity if MuJoCo does not limit an actuator's control."""
    return 0.0 if bench.model.actuator_ctrllimited.all() else math.inf


def inverted_ranges(bench: Bench) -> float:
    """Return infinity if a joint range is written from high to low and limits nothing."""
    low, high = bench.model.jnt_range.T
    return math.inf if (~bench.model.jnt_limited.astype(bool) & (low > high)).any() else 0.0


def narrow_ranges(bench: Bench) -> float:
    """Return 30 degrees / the bend that all limits of the narrowest limb together allow."""
    model, narrowest = bench.model, math.inf
    for body in range(1, model.nbody):
        if any(model.body_parentid[other] == body for other in range(1, model.nbody)):
            continue
        total, count, at = 0.0, 0, body
        while at:
            for joint in range(model.body_jntadr[at], model.body_jntadr[at] + model.body_jntnum[at]):
                if int(model.jnt_type[joint]) in _TURNING:
                    count += 1
                    total += float(np.abs(model.jnt_range[joint]).max()) if model.jnt_limited[joint] else math.pi
            at = int(model.body_parentid[at])
        if count >= 3:
            narrowest = min(narrowest, total)
    return 30 / math.degrees(narrowest) if narrowest < math.inf else 0.0


def overlap(bench: Bench) -> float:
    """Return the deepest overlap / its limit; from 0.5 on, an overlap that pushes nothing counts as 1."""
    model, worst = bench.model, 0.0
    for contact in bench.start.contact:
        depth = -float(contact.dist)
        thin = min(_thickness_m(model, int(geom)) for geom in contact.geom)
        share, relative = depth / thin / _PENETRATION["share"], depth / bench.length_m
        both = min(share, relative / _PENETRATION["noticed"])
        worst = max(worst, both, relative / _PENETRATION["length"])
    return worst if worst < 0.5 or _pushes(bench) else 1.0


def _pushes(bench: Bench) -> bool:
    """Return whether contacts at the start change the accelerations by more than gravity."""
    model = bench.model.__copy__()
    with_contact = np.array(bench.start.qacc)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    turn = np.linalg.norm(with_contact - data.qacc) * bench.length_m
    return bool(turn > 9.81)


def tendon_beyond_range(bench: Bench) -> float:
    """Return the largest distance of a tendon's length outside its range / its length / 0.02."""
    model, worst = bench.model, 0.0
    for tendon in np.flatnonzero(model.tendon_limited):
        length, (low, high) = float(bench.start.ten_length[tendon]), model.tendon_range[tendon]
        worst = max(worst, max(low - length, length - high) / abs(length) / 0.02)
    return worst


def dead_commands(bench: Bench) -> float:
    """Return infinity if an actuator has no force at both ends of its range, in the rest pose."""
    forces = [max(abs(bench.force_n(i, end)) for end in bench.range_of(i)) for i in range(bench.model.nu)]
    return math.inf if min(forces, default=1.0) == 0 else 0.0


def tendon_without_length(bench: Bench) -> float:
    """Return infinity if a driven spatial tendon has the same length in twenty random poses."""
    lengths = np.array([_bent(bench, seed).ten_length for seed in range(20)])
    still = [t for t in _driven_tendons(bench) if np.ptp(lengths[:, t]) < 1e-12]
    return math.inf if still else 0.0


def levers(bench: Bench) -> float:
    """Return 0.05 / (largest lever of a driven tendon / half the width of the parts it passes), for the worst tendon.

    A lever is the change of the tendon's length per radian of a joint [m].
    """
    model, worst = bench.model, 0.0
    bent = _bent(bench, 0, 0.02)
    for tendon in _driven_tendons(bench):
        arms = [abs(_lever_m(bench, bent, tendon, dof)) for dof in range(model.nv) if _turns(model, dof)]
        bodies = _tendon_bodies(model, tendon)
        widths = [float(np.sort(model.geom_aabb[g][3:])[1]) for b in bodies for g in _geoms(model, b)]
        share = max(arms, default=0.0) / float(np.median(widths)) if widths else 1.0
        worst = max(worst, 0.05 / max(share, 1e-9))
    return worst


def _lever_m(bench: Bench, pose: mujoco.MjData, tendon: int, dof: int) -> float:
    lengths, turn = [], np.zeros(bench.model.nv)
    for sign in (1, -1):
        turn[dof] = sign * 1e-5
        data = mujoco.MjData(bench.model)
        data.qpos[:] = pose.qpos
        mujoco.mj_integratePos(bench.model, data.qpos, turn, 1.0)
        mujoco.mj_forward(bench.model, data)
        lengths.append(float(data.ten_length[tendon]))
    return (lengths[0] - lengths[1]) / 2e-5


def _bent(bench: Bench, seed: int, bend_rad: float = 0.2) -> mujoco.MjData:
    rng, data = np.random.default_rng(seed), mujoco.MjData(bench.model)
    turn = rng.uniform(-bend_rad, bend_rad, bench.model.nv)
    turn[[dof for dof in range(bench.model.nv) if not _turns(bench.model, dof)]] = 0
    mujoco.mj_integratePos(bench.model, data.qpos, turn, 1.0)
    mujoco.mj_forward(bench.model, data)
    return data


def _turns(model: mujoco.MjModel, dof: int) -> bool:
    return int(model.jnt_type[model.dof_jntid[dof]]) in _TURNING


def _driven_tendons(bench: Bench) -> list[int]:
    driven = {int(bench.model.actuator_trnid[i, 0]) for i in bench.pulling}
    return [t for t in sorted(driven) if bench.model.wrap_type[bench.model.tendon_adr[t]] != _WRAP_JOINT]


def _tendon_bodies(model: mujoco.MjModel, tendon: int) -> list[int]:
    first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    sites = [int(model.wrap_objid[k]) for k in range(first, first + count) if int(model.wrap_type[k]) == _SITE]
    return sorted({int(model.site_bodyid[site]) for site in sites})


def _geoms(model: mujoco.MjModel, body: int) -> list[int]:
    return [geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) == body]


def _anchor(bench: Bench, body: int) -> np.ndarray:
    first = int(bench.model.body_jntadr[body])
    return np.array(bench.start.xanchor[first] if first >= 0 else bench.start.xpos[body])


def _thickness_m(model: mujoco.MjModel, geom: int) -> float:
    kind = int(model.geom_type[geom])
    if kind in (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD)):
        return math.inf
    return 2 * float(model.geom_aabb[geom][3:].min())
