"""Measures of a passive robot's behaviour, as symptom / limit."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from benchmarks.validator.oracle.loop import Bench
from benchmarks.validator.oracle.trace import Trace


def collapse_by_gravity(bench: Bench) -> float:
    """Return 2 if half of gravity makes the robot sag by more than 0.9 L, 0.5 if twice gravity does not, otherwise 1.

    A robot that deforms by 0.45 L or more without gravity does not get 2.
    """
    if _deformation(bench, bench.settle(gravity=2.0)) < 0.9:
        return 0.5
    caused_by_gravity = _deformation(bench, bench.settle("weightless", gravity=0.0)) < 0.45
    return 2.0 if caused_by_gravity and _deformation(bench, bench.settle(gravity=0.5)) > 0.9 else 1.0


def collapse_by_springs(bench: Bench) -> float:
    """Return the deformation without gravity / 0.6 if it is at most 1.

    Otherwise return 2 if springs half as far from rest also give more than 1, and 1 if they do not.
    """
    share = _deformation(bench, bench.settle("weightless", gravity=0.0)) / 0.6
    if share <= 1:
        return share
    half = _deformation(bench, bench.settle("half sprung", _springs_half_as_far, gravity=0.0)) / 0.6
    return 2.0 if half > 1 else 1.0


def _springs_half_as_far(model: mujoco.MjModel) -> None:
    model.qpos_spring[:] = model.qpos0 + 0.5 * (model.qpos_spring - model.qpos0)
    rest = model.tendon_length0[:, None]
    model.tendon_lengthspring[:] = rest + 0.5 * (model.tendon_lengthspring - rest)


def _deformation(bench: Bench, trace: Trace) -> float:
    """Return the largest distance of a body from its drawn position, relative to the root / L."""
    if trace.failed:
        return math.inf
    root = bench.root
    drawn = (bench.start.xipos - bench.start.xpos[root]) @ bench.start.xmat[root].reshape(3, 3)
    return float(np.linalg.norm(trace.com_m[-1] - drawn, axis=1)[bench.moving].max()) / bench.length_m


def drop(bench: Bench) -> float:
    """Return the distance by which the root falls / L / 0.3."""
    trace = bench.settle()
    if trace.failed:
        return 1.0
    fallen = float(bench.start.xipos[bench.root][2] - trace.world_m[-1, bench.root, 2])
    return fallen / bench.length_m / 0.3


def energy_rise(bench: Bench) -> float:
    """Return the rise of energy / (m g L) / 0.05; 0 if an actuator is not on a tendon, since only tendons are slack."""
    if len(bench.pulling) < bench.model.nu:
        return 0.0
    trace = bench.settle()
    if trace.failed:
        return math.inf
    scale = bench.weight_n * bench.length_m
    return float(trace.energy_j.max() - trace.energy_j[0]) / scale / 0.05


def ringing(bench: Bench) -> float:
    """Return the smaller of 0.02 / damping ratio and amplitude / L / 0.02.

    The damping ratio comes from the logarithmic decrement of the signal's swings in the last three eighths.
    """
    trace = bench.settle()
    if trace.failed:
        return 1.0
    late = trace.com_m[5 * len(trace.com_m) // 8 :, bench.moving].reshape(-1, 3 * len(bench.moving))
    signal = late[:, int(np.argmax(np.ptp(late, axis=0)))]
    amplitude = float(np.ptp(signal)) / 2 / bench.length_m / 0.02
    turns = np.flatnonzero(np.diff(np.sign(np.diff(signal))) != 0) + 1
    if len(turns) < 4:
        return 0.0
    # from one reversal to the next the swing shrinks by exp(-pi zeta)
    swings = np.abs(np.diff(signal[turns]))
    swings = swings[swings > 0.02 * swings.max()]
    ratio = math.log(max(swings[0] / swings[-1], 1.0)) / (math.pi * max(len(swings) - 1, 1))
    return min(0.02 / max(ratio, 1e-6), amplitude)


def touches_nothing(bench: Bench) -> float:
    """Return infinity if no moving part touches any of the balls that are put around all of them; otherwise 0."""
    spec = mujoco.MjSpec.from_string(bench.mjcf)
    for body in bench.moving:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.2 * bench.length_m, 0, 0], pos=bench.start.xipos[body]
        )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    probes = {geom for geom in range(model.ngeom) if model.geom_bodyid[geom] == 0}
    return 0.0 if any(probes & set(map(int, contact.geom)) for contact in data.contact) else math.inf


def lands(mjcf: str) -> bool:
    """Return whether the root of a robot is nearly at rest at the end of settling."""
    bench = Bench(mjcf)
    trace = bench.settle()
    path = trace.world_m[-10:, bench.root]
    speed = float(np.linalg.norm(np.diff(path, axis=0), axis=1).max()) / trace.timestep_s
    return speed < 0.3 * math.sqrt(9.81 * bench.length_m)
