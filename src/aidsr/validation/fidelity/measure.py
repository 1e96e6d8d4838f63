"""Measurement of the fidelity of each limb of a robot; runs in the isolated process."""

from __future__ import annotations

import mujoco
import numpy as np

from aidsr.mjcf.compile import load_mjcf
from aidsr.sim.structure import Chain, Structure, name_of, read_structure
from aidsr.validation.fidelity.cables import Cable, cables_along
from aidsr.validation.fidelity.compare import compare
from aidsr.validation.fidelity.limb import Limb, LimbError, read_limb
from aidsr.validation.fidelity.material import rod_of
from aidsr.validation.fidelity.refine import half_step_percent, twice_the_segments_percent
from aidsr.validation.fidelity.report import Comparison, FidelityReport, LimbFidelity
from aidsr.validation.mount import mount_model

_CUT_CABLES = 2
"""Most cables for the comparison with twice the segments; those with the largest tip errors are used."""


def examine(text: str) -> FidelityReport:
    """Return the fidelity report on MJCF text; does the work of `aidsr.validation.fidelity.check_fidelity`.

    Raises:
        MjcfError: The text is not a valid model.
    """
    mounted = mount_model(load_mjcf(text), "fixed", None)
    model, notes = mounted.model, mounted.notes
    structure = read_structure(model)
    builds: list[tuple[Limb, list[str], Chain]] = []
    left_out = []
    for chain in structure.chains:
        try:
            limb = read_limb(model, chain)
        except LimbError as error:
            if len(chain.bodies) > 1:
                left_out.append(f"{_name(model, chain)}: not compared, {error}")
            continue
        twin = next((alike for other, alike, _ in builds if _is_alike(limb, other)), None)
        if twin is None:
            builds.append((limb, [], chain))
        else:
            twin.append(limb.name)
    limbs = [_examine_limb(model, structure, limb, tuple(alike), chain) for limb, alike, chain in builds]
    found = [limb for limb, _, _ in builds]
    half_step = half_step_percent(model, structure, found) if found and structure.tendon_actuators else None
    return FidelityReport(
        limbs=tuple(limbs),
        left_out=tuple(left_out),
        timestep_s=float(model.opt.timestep),
        half_step_percent=half_step,
        half_step_note="" if half_step is not None else _why_no_step(structure, found),
        notes=notes,
    )


def _why_no_step(structure: Structure, limbs: list[Limb]) -> str:
    if not limbs:
        return "there is no limb to look at"
    return "a simulation diverged" if structure.tendon_actuators else "no tendon is driven"


def _examine_limb(
    model: mujoco.MjModel, structure: Structure, limb: Limb, alike: tuple[str, ...], chain: Chain
) -> LimbFidelity:
    rod = rod_of(model, structure, limb)
    others = {body for other in structure.chains if other is not chain for body in other.bodies}
    cables = cables_along(model, structure, limb, others)
    comparisons = tuple(compare(model, limb, rod, cables))
    twice, not_cut = None, ""
    try:
        twice = twice_the_segments_percent(model, chain, limb, rod, _worst(cables, comparisons))
    except LimbError as error:
        not_cut = str(error)
    return LimbFidelity(
        name=limb.name,
        alike=alike,
        segments=len(limb.segment_m),
        length_m=limb.length_m,
        joints_at=limb.joints_at,
        clamp_doubled=limb.clamp_doubled,
        comparisons=comparisons,
        twice_the_segments_percent=twice,
        not_cut=not_cut,
    )


def _worst(cables: tuple[Cable, ...], comparisons: tuple[Comparison, ...]) -> tuple[Cable, ...]:
    errors = {each.cable: each.tip_error_percent for each in comparisons}
    return tuple(sorted(cables, key=lambda cable: -(errors[cable.name] or 0.0))[:_CUT_CABLES])


def _is_alike(limb: Limb, other: Limb) -> bool:
    """Return whether two limbs have equal dimensions and stiffness."""
    return len(limb.bodies) == len(other.bodies) and all(
        np.allclose(one, two, rtol=1e-3)
        for one, two in (
            (limb.segment_m, other.segment_m),
            (limb.stiffness_n_m_rad, other.stiffness_n_m_rad),
            (limb.radius_m, other.radius_m),
        )
    )


def _name(model: mujoco.MjModel, chain: Chain) -> str:
    ends = [name_of(model, mujoco.mjtObj.mjOBJ_BODY, body) for body in (chain.bodies[0], chain.bodies[-1])]
    return " to ".join(ends)
