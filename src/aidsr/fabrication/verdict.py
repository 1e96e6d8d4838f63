"""The verdict on whether the robot can be built and how it moves as built."""

from __future__ import annotations

import math
from collections.abc import Sequence

from aidsr.core.artifacts import Fault, ValidationReport
from aidsr.core.formatting import format_fault
from aidsr.fabrication.build import RobotBuild
from aidsr.fabrication.changes import changes_of, masses_of
from aidsr.fabrication.schema import BUILDING_LAYERS, REACH_TOLERANCE, Retest, Verdict, motion_errors

MASS_TOLERANCE = 0.15
"""Largest allowed relative difference of the moving mass. Source: the project's requirement on a built robot. A larger
difference is only a warning, because the robot is tested again with its new mass."""

_ANSWERED = frozenset({"actuator_overforce", "actuator_power", "actuator_speed", "cable_stroke", "implausible_density"})
"""Codes of faults that the validator finds by rules of thumb. They are reported as warnings, because an export chooses
actual motors, lines and plastics, or reports errors of its own where it finds none."""


def retest_of(designed: ValidationReport, built: ValidationReport) -> Retest:
    """Return the comparison of two reports of the validator, on the robot as designed and on the robot as built."""

    def reach(report: ValidationReport) -> float:
        share = report.measurements.get("largest_effect_over_length", 0.0)
        return float(share) * float(report.measurements.get("characteristic_length_m", 0.0))

    return Retest(
        stable=not motion_errors(built.faults),
        reach_m=reach(built),
        designed_reach_m=reach(designed),
        faults=built.faults,
        designed_faults=designed.faults,
    )


def judge(build: RobotBuild, bill: tuple[tuple[str, float | None], ...], retest: Retest | None) -> Verdict:
    """Return the verdict.

    Args:
        build: The robot.
        bill: Name and cost in USD of each item to buy; the cost is None where it is unknown.
        retest: Test results of the robot as built; None where it was not tested.
    """
    reasons, changes = [*build.faults], changes_of(build)
    if retest is not None:
        reasons = [*_design_reasons(retest, build.faults), *reasons, *_retest_reasons(retest)]
    errors = [fault for fault in reasons if fault.severity == "error"]
    masses = masses_of(build)
    reasons += _mass_reasons(masses.moving_simulated_kg, masses.moving_built_kg)
    weights = [w.fit.motor.mass_kg if w.fit else None for w in build.winches]
    return Verdict(
        verdict="not buildable" if errors else "buildable with changes" if changes else "buildable",
        reasons=tuple(sorted(reasons, key=lambda fault: fault.severity != "error")),
        changes=changes,
        printer=build.printer.name,
        material=build.material.name,
        simulated_g=round(1000 * masses.simulated_kg, 1),
        built_g=round(1000 * masses.built_kg, 1),
        moving_simulated_g=round(1000 * masses.moving_simulated_kg, 1),
        moving_built_g=round(1000 * masses.moving_built_kg, 1),
        winches_g=None if None in weights else round(1000 * sum(weight or 0.0 for weight in weights), 1),
        cost_usd=round(sum(cost or 0.0 for _, cost in bill), 2),
        unpriced=tuple(what for what, cost in bill if cost is None),
        retest=retest,
    )


def _mass_reasons(simulated_kg: float, built_kg: float) -> list[Fault]:
    if abs(built_kg - simulated_kg) <= MASS_TOLERANCE * simulated_kg:
        return []
    return [
        Fault(
            code="mass_changed",
            layer="realizability",
            severity="warning",
            measured=1000 * built_kg,
            limit=1000 * simulated_kg * (1 + math.copysign(MASS_TOLERANCE, built_kg - simulated_kg)),
            unit="g",
            message=f"what moves weighs another mass than the {1000 * simulated_kg:.4g} g simulated",
            cure="Give the limbs the density of what they are printed of, walls and infill included.",
        )
    ]


def _design_reasons(retest: Retest, known: tuple[Fault, ...]) -> list[Fault]:
    """Return the faults of the robot as designed: errors in how it moves, and what cannot be built.

    Args:
        retest: Test results, which include the faults of the design.
        known: Faults that are already reported; they are left out.
    """
    reported = {(fault.code, fault.severity, name) for fault in known for name in fault.names}
    found = []
    if unsound := motion_errors(retest.designed_faults):
        message = "the design itself is unstable, before anything is changed to build it"
        found.append(_unstable("unstable_as_designed", unsound, message, "Fix the faults that aidsr validate reports."))
    found += [
        _as_reported(fault)
        for fault in retest.designed_faults
        if fault.layer in BUILDING_LAYERS
        and not any((fault.code, _as_reported(fault).severity, name) in reported for name in fault.names)
    ]
    return found


def _as_reported(fault: Fault) -> Fault:
    return fault.model_copy(update={"severity": "warning"}) if fault.code in _ANSWERED else fault


def _retest_reasons(retest: Retest) -> list[Fault]:
    """Return the faults of the robot as built that the design does not have."""
    had = {fault.code for fault in retest.designed_faults if fault.severity == "error"}
    found = [
        _as_reported(fault).model_copy(update={"message": f"as built, {fault.message}"})
        for fault in retest.faults
        if fault.severity == "error" and fault.layer in BUILDING_LAYERS and fault.code not in had
    ]
    if unsound := [fault for fault in retest.motion_faults if fault.code not in had]:
        message = "is unstable with the masses, springs and stops it is built with"
        found.append(_unstable("unstable_as_built", unsound, message, "See the faults under retest."))
    if not retest.same_reach and not motion_errors(retest.designed_faults):
        found.append(
            Fault(
                code="reach_changed",
                layer="realizability",
                severity="error",
                measured=retest.reach_m,
                limit=retest.designed_reach_m
                * (1 + math.copysign(REACH_TOLERANCE, retest.reach_m - retest.designed_reach_m)),
                unit="m",
                message=f"moves another distance at most than the {retest.designed_reach_m:.3g} m designed",
                cure="Design it with what is built: joints that bend until walls touch, and the masses under changes.",
            )
        )
    return found


def _unstable(code: str, faults: Sequence[Fault], message: str, cure: str) -> Fault:
    return Fault(
        code=code,
        layer="realizability",
        severity="error",
        names=tuple(dict.fromkeys(fault.code for fault in faults)),
        message=f"{message}: {'; '.join(map(format_fault, faults))}",
        cure=cure,
    )
