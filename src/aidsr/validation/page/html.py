"""The report page as one self-contained HTML file."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from functools import cache
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aidsr.core.artifacts import Fault, Repairs
from aidsr.core.errors import IsolationError, MjcfError
from aidsr.core.formatting import format_absolute, format_limit, format_number
from aidsr.core.html import html_template
from aidsr.validation.fidelity import FidelityReport
from aidsr.validation.page.cards import cards
from aidsr.validation.page.plots import spark
from aidsr.validation.page.trace import TracedReport
from aidsr.validation.signals import ActuatorTrace

if TYPE_CHECKING:
    from jinja2 import Template

GENERATOR = "aidsr validate"
"""Name of the program that the page gives as its generator."""

_FACTS = {
    "characteristic_length_m": ("length", "m"),
    "moving_mass_kg": ("moving mass", "kg"),
    "chains": ("segments", ""),
    "degrees_of_freedom": ("degrees of freedom", ""),
    "tendons": ("tendons", ""),
    "actuators": ("actuators", ""),
    "sensors": ("sensors", ""),
    "timestep_s": ("time step", "s"),
}


def page_html(
    mjcf: str,
    traced: TracedReport,
    *,
    file: str,
    repairs: Repairs | None = None,
    fidelity: FidelityReport | None = None,
) -> str:
    """Return the HTML page on a document that was validated.

    Args:
        mjcf: Text of the document, for the picture and the lines of the faults.
        traced: The report with its signals and actuator traces.
        file: Name of the document for the title.
        repairs: Fixes that were applied before validation.
        fidelity: Result of the fidelity check.
    """
    report = traced.report
    signals = traced.signals or (None,) * len(report.faults)
    shown = list(cards(report.faults, signals, mjcf))
    return _template().render(
        generator=GENERATOR,
        file=file,
        report=report,
        verdict=_verdict(report.faults),
        picture=_picture(mjcf, report.faults),
        facts=[
            (words, _in_words(report.measurements[key]), unit)
            for key, (words, unit) in _FACTS.items()
            if key in report.measurements
        ],
        moving=[card for card in shown if card.fault.layer not in ("scope", "realizability")],
        scope=[card for card in shown if card.fault.layer == "scope"],
        building=[card for card in shown if card.fault.layer == "realizability"],
        rows=_rows(traced.actuators, report.measurements),
        measurements=dumps(report.measurements, indent=2, ensure_ascii=False),
        repairs=repairs,
        fidelity=fidelity,
    )


@dataclass(frozen=True)
class _Verdict:
    """The verdict at the top of the page."""

    kind: str
    words: str
    more: str


def _verdict(faults: tuple[Fault, ...]) -> _Verdict:
    errors = [fault for fault in faults if fault.severity == "error"]
    counted = ", ".join(
        f"{count} {word}{'' if count == 1 else 's'}"
        for count, word in ((len(errors), "error"), (len(faults) - len(errors), "warning"))
        if count
    )
    layers = {fault.layer for fault in errors}
    if "load" in layers:
        return _Verdict("bad", "Cannot be loaded", counted)
    scope = "out of scope" if "scope" in layers else "in scope"
    if layers - {"scope", "realizability"}:
        return _Verdict("bad", f"Not sound, {scope}", counted)
    if "realizability" in layers:
        return _Verdict("bad", f"Sound, but could not be built; {scope}", counted)
    if errors:
        return _Verdict("bad", f"Sound, {scope}", counted)
    if faults:
        return _Verdict("wait", f"Sound, {scope}, with warnings", counted)
    return _Verdict("good", f"Sound, {scope}", "no faults found")


def _picture(mjcf: str, faults: tuple[Fault, ...]) -> str:
    """Return a picture with the faulty parts highlighted, as a data URL; "" if the document cannot be rendered."""
    from aidsr.render.pictures import picture

    errors = [fault for fault in faults if fault.severity == "error"] or list(faults)
    if any(fault.layer == "load" for fault in errors):
        return ""
    highlighted = [name for fault in errors for name in fault.names]
    try:
        drawn = picture(mjcf, width=880, height=660, highlighted=highlighted)
    except (MjcfError, IsolationError):
        return ""
    return "data:image/png;base64," + base64.b64encode(drawn).decode()


@dataclass(frozen=True)
class _Row:
    """The row of one actuator in the page's table."""

    trace: ActuatorTrace
    needs: dict[str, Any]
    moved: str
    pulled: str


def _rows(actuators: tuple[ActuatorTrace, ...], measurements: dict[str, Any]) -> list[_Row]:
    farthest = max((max(trace.displacement, default=0.0) for trace in actuators), default=0.0)
    strongest = max((max(trace.force_n, default=0.0) for trace in actuators), default=0.0)
    motors = measurements.get("motors", {})
    return [
        _Row(trace, motors.get(trace.name, {}), spark(trace.displacement, farthest), spark(trace.force_n, strongest))
        for trace in actuators
    ]


def _in_words(value: object) -> str:
    if isinstance(value, float):
        return format_number(value)
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


@cache
def _template() -> Template:
    return html_template(
        Path(__file__).with_name("page.html.j2"),
        number=format_number,
        absolute=lambda fault: format_absolute(fault, fault.measured),
        allowed=format_limit,
    )
