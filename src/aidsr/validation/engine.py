"""The validator inside the worker: text in, report out. Never called in the user's process."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np

from aidsr import __version__
from aidsr.core.artifacts import Fault, ValidationReport
from aidsr.core.errors import MjcfError
from aidsr.mjcf.compile import compile_mjcf, load_mjcf
from aidsr.sim.assembly import FUNCTIONAL_SITE
from aidsr.sim.structure import read_structure
from aidsr.validation.case import Case, Rule
from aidsr.validation.causes import without_consequences
from aidsr.validation.overlap import REFUTED, overlap_explains_divergence, with_verdict
from aidsr.validation.protocol import Protocol, gather_evidence
from aidsr.validation.rules import BUILDING_RULES, DRAWING_RULES, SIMULATE_RULES, STRUCTURE_RULES
from aidsr.validation.rules.effort import motor_measurements
from aidsr.validation.test_stand import Standing, stand
from aidsr.validation.validating import Mount

__all__ = ["Examination", "examine", "examine_text"]

_LAYERS = ("load", "structure", "simulate", "realizability")


@dataclass(frozen=True, eq=False)
class Examination:
    """A report and what it was read off, for those who show more than the report says.

    Attributes:
        report: What `validate` returns.
        standing: What was driven; None for a document that cannot be loaded.
        case: What the rules looked at; without evidence where nothing was driven.
    """

    report: ValidationReport
    standing: Standing | None = None
    case: Case | None = None


def examine(argument: dict[str, Any]) -> dict[str, Any]:
    """Answer a request of `aidsr.validation.validate`."""
    return examine_text(**argument).report.model_dump(mode="json")


def examine_text(
    text: str,
    mount: Mount = "auto",
    needs_contact: bool = False,
    environment: str = "",
    realizable: bool = False,
    drive: bool = True,
) -> Examination:
    """Return the report on an MJCF text with what it was read off; see `aidsr.validation.validate` for the arguments.

    Without `drive` it ends with what can be read off the compiled model, which takes milliseconds.
    """
    notes: tuple[str, ...] = ()
    try:
        loaded = load_mjcf(text)
        notes = loaded.notes
        standing = stand(loaded, mount, _open_environment(environment) if environment else None)
    except MjcfError as error:
        return Examination(make_report(error.faults, {}, notes, realizable))
    model = standing.model
    case = Case(model=model, structure=read_structure(model), needs_contact=needs_contact)
    case.found.extend(without_numbers(case))
    if case.found:
        return Examination(make_report(tuple(case.found), {}, notes + standing.notes, realizable), standing, case)
    apply(STRUCTURE_RULES, case)
    measurements = describe(case)
    case.found.extend(too_long(case))
    if drive and case.structure.moving and not any(fault.code == "load_error" for fault in case.found):
        case = replace(case, evidence=gather_evidence(model, case.structure))
        apply(SIMULATE_RULES, case)
        measurements |= measure(case)
        works = all(fault.severity != "error" for fault in case.found)
        apply(DRAWING_RULES, case)
        # forces and speeds of a robot that does not work say nothing about its motors
        if works:
            apply(BUILDING_RULES, case)
            measurements["motors"] = motor_measurements(case)
    report = make_report(_explained(case, measurements), measurements, notes + standing.notes, realizable)
    return Examination(report, standing, case)


def _explained(case: Case, measurements: dict[str, Any]) -> tuple[Fault, ...]:
    """The faults that are causes. Whether an overlap is why a robot diverges is tried, and told in `measurements`."""
    explains = overlap_explains_divergence(case)
    if explains is None:
        return without_consequences(case.found)
    measurements["overlap_explains_divergence"] = explains
    return without_consequences(with_verdict(case.found, explains), () if explains else REFUTED)


def _open_environment(text: str) -> mujoco.MjModel:
    """The environment, compiled; its faults say that they are not the robot's."""
    try:
        return compile_mjcf(text)
    except MjcfError as error:
        theirs = [f.model_copy(update={"message": f"in the environment: {f.message}"}) for f in error.faults]
        raise MjcfError(theirs) from error


def without_numbers(case: Case) -> Iterator[Fault]:
    """The drawn robot has a size, every tendon a length and levers, and time goes on."""
    drawn, timestep_s = case.drawn, float(case.model.opt.timestep)
    broken = [case.tendon(tendon) for tendon in np.flatnonzero(~np.isfinite(drawn.ten_length)).tolist()]
    if not (np.isfinite(drawn.ten_J).all() and np.isfinite(drawn.actuator_moment).all()):
        broken = broken or [case.tendon(tendon.id) for tendon in case.structure.tendons]
    length_m = case.structure.characteristic_length_m
    if broken or not (0 < timestep_s < math.inf and math.isfinite(length_m)):
        yield Fault(
            code="load_error",
            layer="load",
            severity="error",
            names=tuple(broken),
            message=f"numbers overflow: a robot of {length_m:g} m with a time step of {timestep_s:g} s",
            cure="Use metres and kilograms, and a time step of 0.001 to 0.002 s.",
        )


def too_long(case: Case) -> Iterator[Fault]:
    """The time step lets the tests end; the bound is on steps, so that it is the same on every machine."""
    protocol, timestep_s = Protocol(), float(case.model.opt.timestep)
    steps = protocol.steps(case.model, case.structure)
    if steps > protocol.most_steps:
        yield Fault(
            code="load_error",
            layer="load",
            severity="error",
            measured=steps,
            limit=protocol.most_steps,
            unit="time steps",
            message=f"with a time step of {timestep_s:g} s the tests take too many steps",
            cure="Use a time step of 0.001 to 0.002 s.",
        )


def apply(rules: tuple[Rule, ...], case: Case) -> None:
    """Collect what the rules find, in their order."""
    for rule in rules:
        case.found.extend(rule(case))


def make_report(
    faults: tuple[Fault, ...], measurements: dict[str, Any], notes: tuple[str, ...], realizable: bool
) -> ValidationReport:
    """Return the report, errors first; what cannot be built is an error only where that is enforced."""
    ranked = [
        fault if realizable or fault.layer != "realizability" else fault.model_copy(update={"severity": "warning"})
        for fault in faults
    ]
    ranked.sort(key=lambda fault: (fault.severity != "error", _LAYERS.index(fault.layer)))
    return ValidationReport(
        stable=all(fault.severity != "error" for fault in ranked),
        faults=tuple(ranked),
        measurements=measurements,
        versions={"aidsr": __version__, "mujoco": mujoco.__version__},
        notes=notes,
    )


def describe(case: Case) -> dict[str, Any]:
    """Return what the model is made of, as numbers; of a scene also where the functional part is in the world."""
    structure, site = case.structure, mujoco.mj_name2id(case.model, mujoco.mjtObj.mjOBJ_SITE, FUNCTIONAL_SITE)
    found = {
        "characteristic_length_m": structure.characteristic_length_m,
        "moving_mass_kg": structure.mass_kg,
        "chains": [len(chain.bodies) for chain in structure.chains],
        "tendons": len(structure.tendons),
        "actuators": len(structure.actuators),
        "sensors": len(structure.sensors),
        "degrees_of_freedom": case.model.nv,
        "timestep_s": float(case.model.opt.timestep),
    }
    return found if site < 0 else {**found, "functional_part_m": np.round(case.drawn.site_xpos[site], 6).tolist()}


def measure(case: Case) -> dict[str, Any]:
    """Return what the tests measured, as numbers."""
    evidence = case.driven
    if evidence.battery is None:
        return {}
    effects = {
        case.actuator(drive.actuator): round(case.effect_of(index), 6) for index, drive in enumerate(evidence.drives)
    }
    speeds = evidence.battery.speed_m_s[:, :, list(case.structure.bodies)]
    return {
        "effect_over_length": effects,
        "largest_effect_over_length": round(max(map(case.effect_in, range(len(evidence.tests))), default=0.0), 6),
        "fastest_body_m_s": round(float(np.max(speeds, initial=0.0)), 6),
        "simulated_s": round(evidence.battery.frame_s * evidence.battery.speed_m_s.shape[1] * len(evidence.tests), 6),
    }
