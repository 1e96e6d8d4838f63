"""Constants out of the ordinary: units, gravity, keyframes, and what makes a motion slow, as symptom / limit."""

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
    """Length / 10 m, or 5 mm / length."""
    return max(bench.length_m / 10, 0.005 / bench.length_m)


def heaviness(bench: Bench) -> float:
    """Density of the median moving body / 23,000 kg/m3."""
    densities = body_densities(bench)
    return float(np.median(densities)) / 23_000 if densities else 0.0


def gravity(bench: Bench) -> float:
    """Gravity / 3 g, or 0.1 g / gravity; none at all is a choice."""
    share = float(np.linalg.norm(bench.model.opt.gravity)) / GRAVITY_M_S2
    return max(share / 3, 0.1 / share) if share else 0.0


def keyframe(bench: Bench) -> float:
    """Farthest that a keyframe puts a joint beyond its range / the range / 0.05."""
    model, worst = bench.model, 0.0
    for joint in np.flatnonzero(model.jnt_limited & np.isin(model.jnt_type, _LINEAR)):
        low, high = model.jnt_range[joint]
        values = model.key_qpos[:, model.jnt_qposadr[joint]]
        worst = max(worst, float(np.maximum(low - values, values - high).max(initial=0.0)) / float(high - low) / 0.05)
    return worst


def grip(bench: Bench) -> float:
    """0.1 / the largest friction between a free robot and what is around it, after it has settled."""
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
    """How slow the robot is, and how much quicker without most of its damping; see `_slow`."""

    def lighter(model: mujoco.MjModel) -> None:
        model.dof_damping[:] *= 0.02
        model.tendon_damping[:] *= 0.02

    return _slow(bench, "less damped", lighter)


def inert(bench: Bench) -> float:
    """The same without rotor inertia."""

    def lighter(model: mujoco.MjModel) -> None:
        model.dof_armature[:] = 0
        mujoco.mj_setConst(model, mujoco.MjData(model))

    return _slow(bench, "without armature", lighter) if bench.model.dof_armature.any() else 0.0


def filtered(bench: Bench) -> float:
    """The same with a fiftieth of the actuators' time constants."""

    def quicker(model: mujoco.MjModel) -> None:
        model.actuator_dynprm[:, :2] *= 0.02

    return _slow(bench, "quick actuators", quicker) if bench.model.na else 0.0


def _slow(bench: Bench, name: str, change: Callable[[mujoco.MjModel], None]) -> float:
    """The gain by a change / 3, of an actuator whose way grows by a fifth at the end of a test; else that / 0.2.

    The growth saturates: a steady motion grows by a quarter.
    """
    worst = 0.0
    for actuator in range(bench.model.nu):
        late = _late_growth(bench, actuator) / 0.2
        if late > 0.5:
            gain = effect(bench, actuator, name, change) / max(effect(bench, actuator), 1e-9) / 3
            worst = max(worst, gain if late >= 1 else min(late, gain))
    return worst


def _late_growth(bench: Bench, actuator: int) -> float:
    """Way in the last quarter of an actuator's test / way in the whole."""
    trace, reference = bench.alone(actuator, bench.ends(actuator)[0]), bench.reference()
    steps = min(len(trace.com_m), len(reference.com_m))
    if trace.failed or reference.failed or not steps:
        return 0.0
    moved = np.linalg.norm(trace.com_m[:steps] - reference.com_m[:steps], axis=2)[:, bench.moving].max(axis=1)
    return float((moved[-1] - moved[3 * steps // 4]) / moved[-1]) if moved[-1] > 1e-6 * bench.length_m else math.inf
