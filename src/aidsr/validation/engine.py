"""The validator inside the worker process: MJCF text in, report out. Never called in the user's process."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr import __version__
from aidsr.core.artifacts import Fault, Layer, ValidationReport
from aidsr.core.errors import MjcfError
from aidsr.mjcf.compile import compile_mjcf, load_mjcf
from aidsr.sim.functional_part import FUNCTIONAL_SITE
from aidsr.sim.structure import read_structure
from aidsr.validation.mount import MountedModel, mount_model
from aidsr.validation.overlap import REFUTED, overlap_explains_divergence, with_verdict
from aidsr.validation.points import last_quarter
from aidsr.validation.protocol import Protocol, gather_evidence
from aidsr.validation.registry import packages_with_rules, select_rules, without_consequences
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Rule, Stage
from aidsr.validation.rules.document import LOAD_ERROR
from aidsr.validation.rules.winches import motor_measurements
from aidsr.validation.validator import Mount

_LAYERS = ("load", "structure", "scope", "simulate", "realizability")


@dataclass(frozen=True, eq=False)
class Examination:
    """A report with the data behind it, for callers that show more than the report contains.

    Attributes:
        report: The report that `validate` returns.
        mounted: The model that was tested; None for a document that cannot be loaded.
        robot: The input of the rules; its evidence is None if nothing was simulated. None for a document that cannot be
            loaded.
    """

    report: ValidationReport
    mounted: MountedModel | None = None
    robot: RobotUnderTest | None = None


def examine_text(
    text: str,
    mount: Mount = "auto",
    needs_contact: bool = False,
    environment: str = "",
    realizable: bool = False,
    drive: bool = True,
    select: Collection[str] = (),
    ignore: Collection[str] = (),
) -> Examination:
    """Return the report on an MJCF text with the data behind it; see `aidsr.validation.validate` for the arguments.

    Without `drive`, or if no selected rule needs the simulation, only the compiled model is examined, which takes
    milliseconds.
    """
    rules = select_rules(select, ignore)
    notes = tuple(_selection_notes(select, ignore))
    try:
        loaded = load_mjcf(text)
        notes += loaded.notes
        mounted = mount_model(loaded, mount, _open_environment(environment) if environment else None)
    except MjcfError as error:
        return Examination(make_report(error.faults, {}, notes, realizable))
    model = mounted.model
    robot = RobotUnderTest(model=model, structure=read_structure(model), needs_contact=needs_contact)
    robot.found.extend(find_overflow(robot))
    if robot.found:
        return Examination(make_report(tuple(robot.found), {}, notes + mounted.notes, realizable), mounted, robot)
    apply_rules(_of_layer(rules, "structure", "scope"), robot)
    measurements = measure_model(robot)
    robot.found.extend(find_long_tests(robot))
    drive = drive and bool(_of_layer(rules, "simulate", "realizability"))
    if drive and robot.structure.moving and not any(fault.code == "load_error" for fault in robot.found):
        robot = replace(robot, evidence=gather_evidence(model, robot.structure))
        apply_rules(_of_layer(rules, "simulate"), robot)
        measurements |= measure_tests(robot) | measure_places(robot)
        works = all(fault.severity != "error" or fault.layer == "scope" for fault in robot.found)
        apply_rules(_of_stage(rules, Stage.DRAWING), robot)
        # the forces and speeds of a robot with errors do not show which motors it needs
        if works:
            apply_rules(_of_stage(rules, Stage.BUILDING), robot)
            measurements["motors"] = motor_measurements(robot)
    overlap_explains = overlap_explains_divergence(robot)
    if overlap_explains is not None:
        measurements["overlap_explains_divergence"] = overlap_explains
    faults = _without_explained(robot.found, overlap_explains)
    report = make_report(faults, measurements, notes + mounted.notes, realizable)
    return Examination(report, mounted, robot)


def _selection_notes(select: Collection[str], ignore: Collection[str]) -> Iterator[str]:
    if select:
        yield f"looked only for {', '.join(select)}"
    if ignore:
        yield f"did not look for {', '.join(ignore)}"


def _of_layer(rules: Sequence[Rule], *layers: Layer) -> list[Rule]:
    return [rule for rule in rules if rule.layer in layers]


def _of_stage(rules: Sequence[Rule], stage: Stage) -> list[Rule]:
    return [rule for rule in rules if rule.stage is stage]


def _without_explained(faults: Sequence[Fault], overlap_explains: bool | None) -> tuple[Fault, ...]:
    """Return the faults without those that another fault explains.

    Args:
        faults: All faults of a robot.
        overlap_explains: Result of `overlap_explains_divergence`.
    """
    if overlap_explains is None:
        return without_consequences(faults)
    return without_consequences(with_verdict(faults, overlap_explains), () if overlap_explains else REFUTED)


def _open_environment(text: str) -> mujoco.MjModel:
    """Return the compiled environment.

    Raises:
        MjcfError: The environment cannot be compiled; the messages of the faults name the environment.
    """
    try:
        return compile_mjcf(text)
    except MjcfError as error:
        theirs = [f.model_copy(update={"message": f"in the environment: {f.message}"}) for f in error.faults]
        raise MjcfError(theirs) from error


def find_overflow(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find numbers that are not finite: the size of the robot, tendon lengths, moment arms, or the time step.

    A time step of 0 or less counts as well.
    """
    drawn, timestep_s = robot.drawn, float(robot.model.opt.timestep)
    broken = [robot.tendon(tendon) for tendon in np.flatnonzero(~np.isfinite(drawn.ten_length)).tolist()]
    if not (np.isfinite(drawn.ten_J).all() and np.isfinite(drawn.actuator_moment).all()):
        broken = broken or [robot.tendon(tendon.id) for tendon in robot.structure.tendons]
    length_m = robot.structure.characteristic_length_m
    if broken or not (0 < timestep_s < math.inf and math.isfinite(length_m)):
        yield LOAD_ERROR.fault(
            names=broken,
            message=f"numbers overflow: a robot of {length_m:g} m with a time step of {timestep_s:g} s",
        )


def find_long_tests(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find a time step so small that the tests take too many steps. A bound on steps is the same on every machine."""
    protocol, timestep_s = Protocol(), float(robot.model.opt.timestep)
    steps = protocol.steps(robot.model, robot.structure)
    if steps > protocol.most_steps:
        yield LOAD_ERROR.fault(
            measured=steps,
            limit=protocol.most_steps,
            unit="time steps",
            message=f"with a time step of {timestep_s:g} s the tests take too many steps",
            cure="Use a time step of 0.001 to 0.002 s.",
        )


def apply_rules(rules: Sequence[Rule], robot: RobotUnderTest) -> None:
    """Append the faults that some rules find to `robot.found`, in the order of the rules.

    A check that several rules share runs once.
    """
    codes = {rule.code for rule in rules}
    for check in dict.fromkeys(rule.check for rule in rules if rule.check is not None):
        robot.found.extend(fault for fault in check(robot) if fault.code in codes)


def make_report(
    faults: tuple[Fault, ...], measurements: dict[str, Any], notes: tuple[str, ...], realizable: bool
) -> ValidationReport:
    """Return the report, errors first.

    Args:
        faults: Faults to report.
        measurements: Measured values, by name.
        notes: Remarks on how the document was tested.
        realizable: Whether faults of the layer "realizability" keep their severity; else they become warnings.
    """
    ranked = [
        fault if realizable or fault.layer != "realizability" else fault.model_copy(update={"severity": "warning"})
        for fault in faults
    ]
    ranked.sort(key=lambda fault: (fault.severity != "error", _LAYERS.index(fault.layer)))
    return ValidationReport(
        stable=all(fault.severity != "error" for fault in ranked),
        faults=tuple(ranked),
        measurements=measurements,
        versions={"aidsr": __version__, "mujoco": mujoco.__version__, **packages_with_rules()},
        notes=notes,
    )


def measure_model(robot: RobotUnderTest) -> dict[str, Any]:
    """Return counts and sizes of the robot, and the position of its functional part in the world if it has one [m]."""
    structure, site = robot.structure, mujoco.mj_name2id(robot.model, mujoco.mjtObj.mjOBJ_SITE, FUNCTIONAL_SITE)
    found = {
        "characteristic_length_m": structure.characteristic_length_m,
        "moving_mass_kg": structure.mass_kg,
        "chains": [len(chain.bodies) for chain in structure.chains],
        "tendons": len(structure.tendons),
        "actuators": len(structure.actuators),
        "sensors": len(structure.sensors),
        "degrees_of_freedom": int(np.isin(robot.model.dof_bodyid, structure.bodies).sum()),
        "timestep_s": float(robot.model.opt.timestep),
    }
    return found if site < 0 else {**found, "functional_part_m": np.round(robot.drawn.site_xpos[site], 6).tolist()}


def measure_tests(robot: RobotUnderTest) -> dict[str, Any]:
    """Return the results of the tests as numbers, by name; empty if the simulation of settling failed."""
    evidence = robot.driven
    if evidence.battery is None:
        return {}
    effects = {
        robot.actuator(drive.actuator): round(robot.effect_of(index), 6) for index, drive in enumerate(evidence.drives)
    }
    speeds = evidence.battery.speed_m_s[:, :, list(robot.structure.bodies)]
    return {
        "effect_over_length": effects,
        "largest_effect_over_length": round(max(map(robot.effect_in, range(len(evidence.tests))), default=0.0), 6),
        "fastest_body_m_s": round(float(np.max(speeds, initial=0.0)), 6),
        "simulated_s": round(evidence.battery.frame_s * evidence.battery.speed_m_s.shape[1] * len(evidence.tests), 6),
    }


def measure_places(robot: RobotUnderTest) -> dict[str, Any]:
    """Return positions of the functional part of a scene and of all free bodies in the tests, in the world [m].

    "functional_part_at_rest_m" and "free_bodies_at_rest_m" are at the end of the passive phase, with all tendons slack.
    "functional_part_pulled_m" has two positions of the part for each actuator, with the other tendons slack: when the
    command is halfway up its ramp to the pulling end, and the mean over the last quarter, when the command is held at
    that end. Empty if the model has no functional part or the passive phase cannot be measured.
    """
    evidence, model = robot.driven, robot.model
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, FUNCTIONAL_SITE)
    if evidence.battery is None or site < 0 or not robot.settled:
        return {}
    free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE).tolist()
    places_m = evidence.battery.fields["site_xpos"][:, :, site]
    half = round(evidence.protocol.ramp_share * places_m.shape[1] / 2)  # frames of the ramp count from 1
    pulled = {}
    for row in sorted(set(robot.single_tests(range(len(evidence.drives)))) & set(robot.sound_tests)):
        drive = evidence.drives[evidence.tests[row].drive]
        if evidence.tests[row].command == drive.pull:
            held_m = last_quarter(places_m[row], axis=0).mean(axis=0)
            pulled[robot.actuator(drive.actuator)] = [_rounded(places_m[row][max(0, half - 1)]), _rounded(held_m)]
    return {
        "functional_part_at_rest_m": _rounded(evidence.settled.site_xpos[site]),
        "functional_part_pulled_m": pulled,
        "free_bodies_at_rest_m": {
            robot.body(body): _rounded(evidence.settled.xpos[body]) for body in model.jnt_bodyid[free].tolist()
        },
    }


def _rounded(point_m: NDArray[np.float64]) -> list[float]:
    rounded: list[float] = np.round(point_m, 6).tolist()
    return rounded
