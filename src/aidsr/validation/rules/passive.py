"""What the robot does when nobody drives it: stand, sag, fall, ring."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from aidsr.artifacts import Fault
from aidsr.validation.case import Case
from aidsr.validation.protocol import STANDARD_GRAVITY_M_S2, seen_from_root, start_seen_from_root

__all__ = ["drop", "energy_growth", "gravity_collapse", "passive_collapse", "underdamped"]

_WITH_GRAVITY, _WEIGHTLESS = 0, 1
_CURE_SAG = "Raise the joint stiffness, make the limb lighter or shorter, or taper it towards the tip."


def gravity_collapse(case: Case) -> Iterator[Fault]:
    """The robot keeps about its shape under its own weight, and its weight is what bends it."""
    limits = case.limits
    sag, names = _deformation(case, _WITH_GRAVITY)
    without, _ = _deformation(case, _WEIGHTLESS)
    if sag <= limits.collapse_warning or without > limits.weightless_share * sag:
        return
    severe = sag > limits.collapse_error
    yield Fault(
        code="gravity_collapse",
        layer="simulate",
        severity="error" if severe else "warning",
        names=names,
        measured=sag,
        limit=limits.collapse_error if severe else limits.collapse_warning,
        unit="of the robot's length",
        message="sag under its own weight with slack tendons",
        likely_cause="the backbone is too soft for its weight",
        cure=_CURE_SAG,
    )


def passive_collapse(case: Case) -> Iterator[Fault]:
    """Without gravity the robot stays as it was drawn."""
    without, names = _deformation(case, _WEIGHTLESS)
    if without > case.limits.passive_collapse:
        yield Fault(
            code="passive_collapse",
            layer="simulate",
            severity="error",
            names=names,
            measured=without,
            limit=case.limits.passive_collapse,
            unit="of the robot's length",
            message="deforms by itself, without gravity and with slack tendons",
            likely_cause="springs are not at rest in the drawn pose (springref, springlength, equality constraints)",
            cure="Leave springref and springlength out, or draw the robot in the pose where its springs rest.",
        )


def _deformation(case: Case, simulation: int) -> tuple[float, tuple[str, ...]]:
    """Largest displacement from the drawn pose after settling / L, and the body where it is."""
    evidence, structure = case.driven, case.structure
    drawn = start_seen_from_root(evidence, structure, case.model)
    points = seen_from_root(evidence.settle, structure, case.model)[simulation, -1]
    moved = np.linalg.norm(points - drawn, axis=-1)[: len(structure.bodies)]
    if not moved.size:
        return 0.0, ()
    worst = int(np.argmax(moved))
    return float(moved[worst]) / case.length_m, (case.body(structure.bodies[worst]),)


def drop(case: Case) -> Iterator[Fault]:
    """The root of the robot stays where it was put: it neither falls for ever nor lands from above.

    Environment joints that carry the robot are forgiven: only roots with joints of their own can drop.
    """
    model, evidence = case.model, case.driven
    down = np.array(model.opt.gravity)
    if not down.any():
        return
    down /= np.linalg.norm(down)
    for root in case.structure.roots:
        if root not in case.structure.moving:
            continue
        path = (evidence.settle.fields["xpos"][_WITH_GRAVITY, :, root] - evidence.start.xpos[root]) @ down
        share = float(path[-1]) / case.length_m
        if share > case.limits.drop:
            speed = float(evidence.settle.speed_m_s[_WITH_GRAVITY, -1, root])
            landed = speed < case.limits.landed * math.sqrt(STANDARD_GRAVITY_M_S2 * case.length_m)
            first = int(np.argmax(path > case.limits.drop * case.length_m))
            yield _drop_fault(case, root, share, landed, (first + 1) * evidence.settle.frame_s)


def _drop_fault(case: Case, root: int, share: float, landed: bool, first_time_s: float) -> Fault:
    return Fault(
        code="base_not_attached" if landed else "free_fall",
        layer="simulate",
        severity="error",
        names=(case.body(root),),
        measured=share,
        limit=case.limits.drop,
        unit="of the robot's length",
        message="the root drops and lands" if landed else "the root falls and does not land",
        likely_cause="the root has a free or slide joint and starts above the ground"
        if landed
        else "the root has a free or slide joint and nothing below it that it can touch",
        cure="Remove the root's joint to fix it, or start it on the ground with contacts enabled.",
        first_time_s=first_time_s,
    )


def energy_growth(case: Case) -> Iterator[Fault]:
    """Passive, the robot gains no mechanical energy.

    Measured only where every actuator is a slack tendon actuator: any other may do work while it holds.
    """
    model, evidence = case.model, case.driven
    if len(case.structure.tendon_actuators) < model.nactuator:
        return
    energy = evidence.settle.fields["energy"][_WITH_GRAVITY].sum(axis=-1)
    scale = case.structure.mass_kg * STANDARD_GRAVITY_M_S2 * case.length_m
    if scale <= 0:
        return
    growth = float(energy.max() - energy[0]) / scale
    if growth > case.limits.energy_growth:
        damping = float(min(model.dof_damping.min(initial=0.0), model.tendon_damping.min(initial=0.0)))
        yield Fault(
            code="energy_growth",
            layer="simulate",
            severity="error",
            measured=growth,
            limit=case.limits.energy_growth,
            unit="m g L",
            message="mechanical energy rises while nothing drives the robot",
            likely_cause=f"negative damping ({damping:.3g})" if damping < 0 else "",
            cure="Make damping positive, or reduce the time step.",
            first_time_s=float(np.argmax(energy - energy[0] > case.limits.energy_growth * scale) + 1)
            * evidence.settle.frame_s,
        )


def underdamped(case: Case) -> Iterator[Fault]:
    """The robot comes to rest.

    Damping ratio from the decay between the third and the last quarter of settling and the zero crossings there.

    Source: logarithmic decrement; amplitude falls by exp(-2 pi zeta) per oscillation for small zeta.
    """
    evidence, limits = case.driven, case.limits
    points = seen_from_root(evidence.settle, case.structure, case.model)[_WITH_GRAVITY]
    quarter = points.shape[0] // 4
    earlier, later = (_swing(points[-2 * quarter : -quarter]), _swing(points[-quarter:]))
    amplitude_m = np.linalg.norm(later, axis=-1).max(axis=0)
    if not amplitude_m.size or amplitude_m.max() <= limits.ringing * case.length_m:
        return
    point = int(np.argmax(amplitude_m))
    axis = int(np.argmax(np.abs(later[:, point]).max(axis=0)))
    before, after = earlier[:, point, axis], later[:, point, axis]
    cycles = max(0.5, np.count_nonzero(np.diff(np.sign(after))) / 2)
    ratio = math.log(max(np.ptp(before), 1e-12) / max(np.ptp(after), 1e-12)) / (2 * math.pi * cycles)
    if ratio < limits.damping_ratio:
        yield Fault(
            code="underdamped",
            layer="simulate",
            severity="error",
            names=_owner_of_point(case, point),
            measured=max(ratio, 0.0),
            limit=limits.damping_ratio,
            unit="damping ratio",
            message=f"still swings by {100 * float(amplitude_m[point]) / case.length_m:.2g} % of the robot's length "
            "after settling",
            likely_cause="joints have little or no damping",
            cure="Give each joint damping of about 0.02 to 0.1 s times its stiffness.",
        )


def _swing(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Deviation from the straight line in time, so that slow creep does not count as ringing."""
    frames = np.arange(len(points)) - (len(points) - 1) / 2
    flat = points.reshape(len(points), -1)
    centred = flat - flat.mean(axis=0)
    slope = frames @ centred / max(float(frames @ frames), 1e-12)
    return np.asarray((centred - np.outer(frames, slope)).reshape(points.shape))


def _owner_of_point(case: Case, point: int) -> tuple[str, ...]:
    bodies = case.structure.bodies
    body = (
        bodies[point] if point < len(bodies) else int(case.model.site_bodyid[case.structure.sites[point - len(bodies)]])
    )
    return (case.body(body),)
