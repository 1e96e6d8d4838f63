"""What is wrong before anything moves: overlaps, tendon limits, parts that cannot touch."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco

from aidsr.artifacts import Fault
from aidsr.validation.case import Case

__all__ = ["contact_disabled", "initial_penetration", "tendon_limit_violated"]

_SPHERE_LIKE = (
    int(mujoco.mjtGeom.mjGEOM_SPHERE),
    int(mujoco.mjtGeom.mjGEOM_CAPSULE),
    int(mujoco.mjtGeom.mjGEOM_CYLINDER),
)
_FLAT = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))


def initial_penetration(case: Case) -> Iterator[Fault]:
    """Nothing of the robot overlaps anything in the drawn pose, beyond rounding.

    Parents and children do not collide in MuJoCo, except with a parent that is fixed to the world.
    """
    limits, data = case.limits, case.driven.start
    worst: dict[tuple[str, str], tuple[float, float]] = {}
    for contact in data.contact:
        geoms = int(contact.geom1), int(contact.geom2)
        if not any(geom in case.structure.geoms for geom in geoms) or contact.dist >= 0:
            continue
        overlap_m = -float(contact.dist)
        share = overlap_m / min(_thickness_m(case, geom) for geom in geoms)
        relative = overlap_m / case.length_m
        if (share > limits.overlap_share and relative > limits.overlap_noticed) or relative > limits.overlap_length:
            pair = case.geom(geoms[0]), case.geom(geoms[1])
            worst[pair] = max(worst.get(pair, (0.0, 0.0)), (share, overlap_m))
    if worst:
        (one, other), (share, overlap_m) = max(worst.items(), key=lambda item: item[1])
        yield Fault(
            code="initial_penetration",
            layer="simulate",
            severity="error",
            names=tuple(dict.fromkeys(name for pair in worst for name in pair)),
            measured=share,
            limit=limits.overlap_share,
            unit="of the thinner part",
            message=f"{one} overlaps {other} by {1000 * overlap_m:.3g} mm in the drawn pose"
            + (f", and {len(worst) - 1} more pairs overlap" if len(worst) > 1 else ""),
            cure="Move or shorten the parts, or add <contact><exclude body1=... body2=.../></contact> for neighbours "
            "that are meant to meet.",
            first_time_s=0.0,
        )


def _thickness_m(case: Case, geom: int) -> float:
    """Smallest width of a geom [m]; a plane has none that matters."""
    kind, size = int(case.model.geom_type[geom]), case.model.geom_size[geom]
    if kind in _FLAT:
        return float("inf")
    if kind in _SPHERE_LIKE:
        return 2 * float(min(size[:2]) if kind == _SPHERE_LIKE[2] else size[0])
    return 2 * float(min(case.model.geom_aabb[geom][3:]))


def tendon_limit_violated(case: Case) -> Iterator[Fault]:
    """A limited tendon is within its range in the drawn pose."""
    model = case.model
    for tendon in case.structure.tendons:
        if not model.tendon_limited[tendon.id]:
            continue
        length_m = float(case.driven.start.ten_length[tendon.id])
        low, high = model.tendon_range[tendon.id]
        outside = max(float(low) - length_m, length_m - float(high)) / max(abs(length_m), 1e-9)
        if outside > case.limits.tendon_limit:
            yield Fault(
                code="tendon_limit_violated",
                layer="simulate",
                severity="error",
                names=(case.tendon(tendon.id),),
                measured=outside,
                limit=case.limits.tendon_limit,
                unit="of its length",
                message=f"length {length_m:.4g} m in the drawn pose, range {low:.4g} to {high:.4g} m",
                cure="Let the range of the tendon include its length in the drawn pose, or leave the range out.",
                first_time_s=0.0,
            )


def contact_disabled(case: Case) -> Iterator[Fault]:
    """Something of a robot that stands on the ground, or must touch for its task, can touch.

    Source: MuJoCo documentation, Computation, "Collision detection": contype of one geom and conaffinity of another.
    """
    model, structure = case.model, case.structure
    if not (structure.free_roots or case.needs_contact):
        return
    disabled = bool(model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CONTACT))
    others = [geom for geom in range(model.ngeom) if geom not in structure.geoms]
    moving = [geom for geom in structure.geoms if int(model.geom_bodyid[geom]) in structure.moving]
    if disabled or not any(_can_touch(model, geom, others) for geom in moving):
        yield Fault(
            code="contact_disabled",
            layer="simulate",
            severity="error",
            names=tuple(case.body(root) for root in structure.roots),
            measured=0,
            limit=1,
            unit="moving geoms that can touch",
            message="no moving geom of the robot can touch anything around it",
            likely_cause="contacts are switched off in <option>" if disabled else "contype and conaffinity are 0",
            cure="Leave contype and conaffinity at 1 for the outer geoms, and keep robot parts apart with <exclude>.",
        )


def _can_touch(model: mujoco.MjModel, geom: int, others: list[int]) -> bool:
    if not others:  # alone in the world: what matters is whether a geom with default settings would be touched
        return bool(model.geom_contype[geom] & 1 or model.geom_conaffinity[geom] & 1)
    return any(
        model.geom_contype[geom] & model.geom_conaffinity[other]
        or model.geom_contype[other] & model.geom_conaffinity[geom]
        for other in others
    )
