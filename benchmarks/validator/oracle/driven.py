"""Measures of a driven robot's behaviour, as symptom / limit."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import mujoco
import numpy as np
from benchmarks.validator.oracle.loop import GRAVITY_M_S2, Bench
from benchmarks.validator.oracle.trace import Trace

_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
_TURN_RAD_S, _BODY_M_S = 200.0, 50.0
_TOUCH = (int(mujoco.mjtSensor.mjSENS_TOUCH), int(mujoco.mjtSensor.mjSENS_RANGEFINDER))


def instability(bench: Bench) -> float:
    """Return 2 if the robot fails even at half the time step, 1 if only at twice the time step, otherwise 0.5."""
    if _fails(bench, 2.0):
        return 2.0
    return 1.0 if _fails(Bench(bench.mjcf, 2.0), 0.5) else 0.5


def _fails(bench: Bench, speed_share: float) -> bool:
    """Return whether any test ends in bad numbers or in speeds above `speed_share` x the largest plausible speeds."""
    if bench.settle().failed:
        return True
    tests: list[Callable[[], Trace]] = [bench.settle, bench.together, bench.sweep]
    tests += [partial(bench.alone, i, bench.ends(i)[0]) for i in range(bench.model.nu)]
    return any(_failed(bench, test(), speed_share) for test in tests)


def plainly_diverges(bench: Bench) -> bool:
    """Return whether MuJoCo warns of bad numbers in any test."""
    if bench.settle().failed:
        return True
    tests: list[Callable[[], Trace]] = [bench.together, bench.sweep]
    for i in range(bench.model.nu):
        tests += [partial(bench.alone, i, bench.ends(i)[0]), partial(_released, bench, i)]
    return any(test().failed for test in tests)


def _failed(bench: Bench, trace: Trace, speed_share: float) -> bool:
    if trace.failed or not len(trace.qvel):
        return True
    slides = np.array([int(bench.model.jnt_type[j]) in (0, _SLIDE) for j in bench.model.dof_jntid])
    turning = np.abs(trace.qvel[:, ~slides]).max(initial=0.0) / _TURN_RAD_S
    moving = np.linalg.norm(np.diff(trace.world_m, axis=0), axis=2).max(initial=0.0) / trace.timestep_s / _BODY_M_S
    return bool(max(turning, moving) > speed_share)


def chatter(bench: Bench) -> float:
    """Return the root mean square acceleration of the worst body in the last quarter of a test / g / 4."""
    traces = [bench.settle(), bench.together()]
    traces += [bench.alone(i, bench.ends(i)[0]) for i in range(bench.model.nu)]
    worst = 0.0
    for trace in traces:
        if trace.failed:
            return math.inf
        acceleration = trace.shaking_m_s2[:, bench.moving]
        worst = max(worst, float(np.sqrt((acceleration**2).mean(axis=0)).max()))
    return worst / GRAVITY_M_S2 / 4


def overrun(bench: Bench) -> float:
    """Return how far a hinge is beyond its range for a tenth of a test under load / 30 degrees."""
    model, worst = bench.model, 0.0
    traces = [bench.together(), bench.sweep(), *(bench.alone(i, bench.ends(i)[0]) for i in range(model.nu))]
    for joint in np.flatnonzero(model.jnt_limited & (model.jnt_type == _HINGE)):
        low, high = model.jnt_range[joint]
        for trace in traces:
            if trace.failed:
                return 1.0
            angle = trace.qpos[:, model.jnt_qposadr[joint]]
            worst = max(worst, float(np.quantile(np.maximum(low - angle, angle - high), 0.9)))
    return math.degrees(worst) / 30


def constant_sensors(bench: Bench) -> float:
    """Return infinity if no sensor changes in any test; 0 if one does. Touch and distance sensors do not count."""
    model = bench.model
    traces = [bench.together(), bench.sweep(), *(bench.alone(i, bench.ends(i)[0]) for i in range(model.nu))]
    values = np.concatenate([trace.sensors for trace in traces])
    looked_at = [i for i in range(model.nsensor) if int(model.sensor_type[i]) not in _TOUCH]
    columns = [model.sensor_adr[i] + k for i in looked_at for k in range(model.sensor_dim[i])]
    return 0.0 if not columns or np.ptp(values[:, columns], axis=0).max() > 1e-6 else math.inf


# --- effects ---------------------------------------------------------------------------------------------------------


def effect(
    bench: Bench, actuator: int, name: str = "", change: Callable[[mujoco.MjModel], None] | None = None
) -> float:
    """Return the largest displacement of a centre of mass by one actuator alone / L, for the more effective end.

    Args:
        bench: The robot.
        actuator: Number of the actuator.
        name: Name of the change, under which its tests are kept.
        change: Changes the model for these tests.
    """
    reference = bench.reference(f"{name} reference", change)
    ends = [end for end in bench.range_of(actuator) if abs(end - bench.neutral(bench.settle().end)[actuator]) > 1e-12]
    return max(
        (_displacement(bench, bench.alone(actuator, end, name, change), reference) for end in ends), default=1e-9
    )


def _displacement(bench: Bench, trace: Trace, reference: Trace) -> float:
    steps = min(len(trace.com_m), len(reference.com_m))
    if not steps or trace.failed or reference.failed:
        return 1e-9
    moved = np.linalg.norm(trace.com_m[:steps] - reference.com_m[:steps], axis=2)[:, bench.moving]
    return max(float(moved.max()) / bench.length_m, 1e-9)


def no_effect(bench: Bench) -> float:
    """Return 0.05 / the largest effect of any actuator."""
    return 0.05 / max((effect(bench, i) for i in range(bench.model.nu)), default=1e-9)


def idle_actuator(bench: Bench) -> float:
    """Return 0.05 / the smallest effect of any actuator: in a good robot, every actuator has an effect."""
    return 0.05 / min((effect(bench, i) for i in range(bench.model.nu)), default=1e-9)


def held_by_limits(bench: Bench) -> float:
    """Return the smaller of 0.05 / effect and the gain in effect without limits / 3."""

    def unlimited(model: mujoco.MjModel) -> None:
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)

    return _if_idle(bench, lambda: _gain(bench, "unlimited", unlimited) / 3)


def held_by_mass(bench: Bench) -> float:
    """Return the smaller of 0.05 / effect and the mass of the heaviest body / median / 100."""
    masses = bench.model.body_mass[bench.moving]
    return _if_idle(bench, lambda: float(masses.max() / np.median(masses)) / 100)


def too_weak(bench: Bench) -> float:
    """Return the smaller of 0.05 / effect and half the weight / the largest force."""
    return _if_idle(bench, lambda: 0.5 * bench.weight_n / max(_greatest_force_n(bench), 1e-12))


def too_stiff(bench: Bench) -> float:
    """Return the smallest of 0.05 / effect, largest force / half the weight, and gain with 2 % of the stiffness / 3."""

    def softer(model: mujoco.MjModel) -> None:
        for values in (model.jnt_stiffness, model.tendon_stiffness, model.dof_damping, model.tendon_damping):
            values[:] *= 0.02

    strong = _greatest_force_n(bench) / (0.5 * bench.weight_n)
    return _if_idle(bench, lambda: min(strong, _gain(bench, "softer", softer) / 3))


def _if_idle(bench: Bench, cause: Callable[[], float]) -> float:
    """Return the smaller of 0.05 / effect and the cause's measure; without the cause if the effect is large enough."""
    idle = no_effect(bench)
    return idle if idle <= 0.5 else min(idle, cause())


def _gain(bench: Bench, name: str, change: Callable[[mujoco.MjModel], None]) -> float:
    gains = [effect(bench, i, name, change) / max(effect(bench, i), 1e-9) for i in range(bench.model.nu)]
    return max(gains, default=0.0)


def _greatest_force_n(bench: Bench) -> float:
    return max((abs(bench.force_n(i, end)) for i in range(bench.model.nu) for end in bench.range_of(i)), default=0.0)


def held_by_contact(bench: Bench) -> float:
    """Return 0.35 / the share of the effect that self-contact leaves, for the most affected actuator."""

    def through(model: mujoco.MjModel) -> None:
        ours = model.geom_bodyid > 0
        model.geom_contype[ours], model.geom_conaffinity[ours] = 2, 4
        model.geom_contype[~ours], model.geom_conaffinity[~ours] = 4, 2

    worst = 0.0
    for i in range(bench.model.nu):
        if not _touches_itself(bench, i):
            continue
        freed = effect(bench, i, "through", through)
        if freed >= 0.1:
            worst = max(worst, 0.35 * freed / max(effect(bench, i), 1e-9))
    return worst


def _touches_itself(bench: Bench, actuator: int) -> bool:
    """Return whether parts of the robot touch each other at the end of an actuator's test."""
    data = bench.alone(actuator, bench.ends(actuator)[0]).end
    return any(bench.model.geom_bodyid[list(contact.geom)].all() for contact in data.contact)


def held_by_antagonists(bench: Bench) -> float:
    """Return 0.35 / the share of the effect that is left if the others are only commanded to let go, for the worst."""
    worst = 0.0
    reference = bench.reference()
    for i in bench.pulling:
        alone = effect(bench, i)
        if alone >= 0.1:
            held = _displacement(bench, _released(bench, i), reference)
            worst = max(worst, 0.35 * alone / max(held, 1e-9))
    return worst


def _released(bench: Bench, actuator: int) -> Trace:
    """Drive one actuator to the end at which it pulls hardest, and command the others to let go."""
    target = {other: bench.ends(other)[1] for other in bench.pulling} | {actuator: bench.ends(actuator)[0]}
    return bench.drive(f"released {actuator}", target)
