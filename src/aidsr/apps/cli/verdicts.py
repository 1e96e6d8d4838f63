"""Output of `aidsr validate` for a file, as plain text."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from aidsr.core.artifacts import Fault
from aidsr.core.formatting import counted, format_number
from aidsr.validation.json_report import FileReport

_REALIZABILITY_BYTES = 1000
"""Maximum length of the text about buildability [bytes]; the text about other faults may have 1,600 bytes."""


def verdict(report: FileReport) -> str:
    """Return the verdicts in a few words: whether the model is stable, sound, buildable and in scope."""
    layers = {fault.layer for fault in report.errors}
    if "load" in layers:
        return "cannot be loaded"
    physics = "not sound" if layers - {"scope", "realizability"} else "sound"
    building = ", but not buildable" if "realizability" in layers and physics == "sound" else ""
    stable = "stable" if report.stable else "not stable"
    warned = ", with warnings" if report.stable and report.faults else ""
    return f"{stable} ({physics}{building}, {'in' if report.in_scope else 'out of'} scope){warned}"


def format_verdict(
    report: FileReport, *, repaired: Path | None = None, named: bool = False, motors: bool = False
) -> str:
    """Return the report on a file as text: repairs, verdict, faults, buildability, motors, fidelity.

    Args:
        report: Report on the file.
        repaired: File to which the repaired text was written; None without repairs.
        named: Whether to begin the verdict with the name of the file.
        motors: Whether to list suitable motors.
    """
    return "\n\n".join(_parts(report, repaired, named, motors)).rstrip()


def _parts(report: FileReport, repaired: Path | None, named: bool, motors: bool) -> Iterator[str]:
    if report.repairs is not None and repaired is not None:
        yield _format_repairs(report, repaired)
    moving = tuple(fault for fault in report.faults if fault.layer != "realizability")
    building = tuple(fault for fault in report.faults if fault.layer == "realizability")
    head = (f"{report.file}: " if named else "") + verdict(report) + ("" if report.faults else ": no faults found")
    yield "\n".join([head, _account(report, moving)] if moving else [head])
    if building:
        enforced = any(fault.severity == "error" for fault in building)
        about = "Buildability" + (":" if enforced else " (not part of the verdict; --realizable includes it):")
        yield f"{about}\n{_account(report, building, _REALIZABILITY_BYTES)}"
    if motors and (lines := list(_format_motors(report))):
        yield "\n".join(["Cheapest motor of the catalogue that provides the measured load of each cable:", *lines])
    if report.fidelity is not None:
        yield report.fidelity.account()


def _account(report: FileReport, faults: tuple[Fault, ...], max_bytes: int = 1600) -> str:
    return report.model_copy(update={"faults": faults}).account(max_bytes)


def _format_repairs(report: FileReport, place: Path) -> str:
    repairs = report.repairs
    if repairs is None or not repairs.total:
        return f"nothing to fix; the text was written to {place} unchanged"
    changes = counted(repairs.total, "automatic fix")
    return "\n".join([f"{changes}, written to {place}:", *(f"- {note}" for note in repairs.notes)])


def _format_motors(report: FileReport) -> Iterator[str]:
    """Yield one line for each motor, with its actuators and the largest values that any of them requires."""
    groups: dict[str, list[str]] = {}
    asked = report.measurements.get("motors", {})
    for actuator, needs in asked.items():
        groups.setdefault(needs["cheapest_motor"] or "no suitable motor in the catalogue", []).append(actuator)
    for motor, actuators in groups.items():
        tension_n, speed_m_s, stroke_m = (
            max(asked[actuator][name] for actuator in actuators) for name in ("tension_n", "speed_m_s", "stroke_m")
        )
        needs = (
            f"{format_number(tension_n)} N, {format_number(speed_m_s)} m/s, stroke {format_number(1000 * stroke_m)} mm"
        )
        yield f"- {', '.join(actuators)} ({needs}): {motor}"
