"""Measures of unusual constants: units, gravity, keyframes, friction, and causes of slow motion, as symptom / limit."""

from __future__ import annotations

import math
from collections.abc import Callable

import mujoco
import numpy as np
from benchmarks.validator.oracle.building import body_densities
from benchmarks.validator.oracle.driven import effect
from benchmarks.validator.oracle.loop import GRAVITY_M_S2, Bench

_LINEAR = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))


def length(bench: Bench) -> float:
    """Return the robot's length / 10 m, or 5 mm / length, whichever is larger."""
    return max(bench.length_m / 10, 0.005 / bench.length_m)


def heaviness(bench: Bench) -> float:
    """Return the median density of the moving bodies / 23,000 kg/m3."""
    densities = body_densities(bench)
    return float(np.median(densities)) / 23_000 if densities else 0.0


def gravity(bench: Bench) -> float:
    """Return gravity / 3 g, or 0.1 g / gravity, whichever is larger; 0 without gravity, which is a choice."""
    share = float(np.linalg.norm(bench.model.opt.gravity)) / GRAVITY_M_S2
    return max(share / 3, 0.1 / share) if share else 0.0


def keyframe(bench: Bench) -> float:
    """Return the largest distance of a keyframe's joint beyond its range / the range / 0.05."""
    model, worst = bench.model, 0.0
    for joint in np.flatnonzero(model.jnt_limited & np.isin(model.jnt_type, _LINEAR)):
        low, high = model.jnt_range[joint]
        values = model.key_qpos[:, model.jnt_qposadr[joint]]
        worst = max(worst, float(np.maximum(low - values, values - high).max(initial=0.0)) / float(high - low) / 0.05)
    return worst


def grip(bench: Bench) -> float:
    """Return 0.1 / the largest friction between a free robot and its surroundings, after it has settled."""
    if not bench.free:
        return 0.0
    end, model = bench.settle().end, bench.model
    data = mujoco.MjData(model)
    data.qpos[:] = end.qpos
    mujoco.mj_fwdPosition(model, data)
    outside = [contact for contact in data.contact if not model.geom_bodyid[list(contact.geom)].all()]
    if not outside:
        return 0.0
    return 0.1 / max(max(0.0 if contact.dim == 1 else float(contact.friction[0]) for contact in outside), 1e-3)


def damped(bench: Bench) -> float:
    """Return how much damping slows the robot, by a comparison with 2 % of its damping; see `_slow`."""

    def lighter(model: mujoco.MjModel) -> None:
        model.dof_damping[:] *= 0.02
        model.tendon_damping[:] *= 0.02

    return _slow(bench, "less damped", lighter)


def inert(bench: Bench) -> float:
    """Return how much rotor inertia slows the robot, by a comparison without it; see `_slow`."""

    def lighter(model: mujoco.MjModel) -> None:
        model.dof_armature[:] = 0
        mujoco.mj_setConst(model, mujoco.MjData(model))

    return _slow(bench, "without armature", lighter) if bench.model.dof_armature.any() else 0.0


def filtered(bench: Bench) -> float:
    """Return how much filters slow the robot, by a comparison with 2 % of their time constants; see `_slow`."""

    def quicker(model: mujoco.MjModel) -> None:
        model.actuator_dynprm[:, :2] *= 0.02

    return _slow(bench, "quick actuators", quicker) if bench.model.na else 0.0


def _slow(bench: Bench, name: str, change: Callable[[mujoco.MjModel], None]) -> float:
    """Return the gain in effect by a change / 3, for an actuator whose displacement still grows at the end of its test.

    The growth in the last quarter must be at least a fifth. With a growth of a tenth to a fifth, the result is the
    smaller of the gain / 3 and the growth / 0.2; with less it is 0. The growth of a steady motion is a quarter.
    """
    worst = 0.0
    for actuator in range(bench.model.nu):
        late = _late_growth(bench, actuator) / 0.2
        if late > 0.5:
            gain = effect(bench, actuator, name, change) / max(effect(bench, actuator), 1e-9) / 3
            worst = max(worst, gain if late >= 1 else min(late, gain))
    return worst


def _late_growth(bench: Bench, actuator: int) -> float:
    """Return the displacement in the last quarter of an actuator's test / the displacement in the whole test."""
    trace, reference = bench.alone(actuator, bench.ends(actuator)[0]), bench.reference()
    steps = min(len(trace.com_m), len(reference.com_m))
    if trace.failed or reference.failed or not steps:
        return 0.0
    moved = np.linalg.norm(trace.com_m[:steps] - reference.com_m[:steps], axis=2)[:, bench.moving].max(axis=1)
    return float((moved[-1] - moved[3 * steps // 4]) / moved[-1]) if moved[-1] > 1e-6 * bench.length_m else math.inf
