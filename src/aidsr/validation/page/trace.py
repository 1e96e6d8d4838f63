"""`trace_report`: a report with signals and actuator traces. Loads no simulator: a child process does the work."""

from __future__ import annotations

from collections.abc import Collection

from aidsr.core.artifacts import Artifact, ValidationReport
from aidsr.core.errors import IsolationError, MjcfError
from aidsr.sandbox.isolated import isolated
from aidsr.validation.signals import ActuatorTrace, Signal
from aidsr.validation.validator import VALIDATION_LIMITS, Mount, failed_report


class TracedReport(Artifact):
    """A report with the signals of its faults and the traces of the actuators."""

    report: ValidationReport
    signals: tuple[Signal | None, ...] = ()
    """One signal for each fault of the report; None for a fault without a course over time. Empty if the child process
    failed."""
    actuators: tuple[ActuatorTrace, ...] = ()


def trace_report(
    mjcf: str,
    *,
    mount: Mount = "auto",
    needs_contact: bool = False,
    realizable: bool = False,
    select: Collection[str] = (),
    ignore: Collection[str] = (),
) -> TracedReport:
    """Validate MJCF text as `aidsr.validate` does and return the report with its signals and actuator traces.

    See `aidsr.validate` for the arguments.
    """
    try:
        return trace_isolated(mjcf, mount, needs_contact, realizable, tuple(select), tuple(ignore))
    except (IsolationError, MjcfError) as error:
        return TracedReport(report=failed_report(error))


@isolated(limits=VALIDATION_LIMITS)
def trace_isolated(
    text: str, mount: Mount, needs_contact: bool, realizable: bool, select: tuple[str, ...], ignore: tuple[str, ...]
) -> TracedReport:
    """Return a report with its signals, computed in an isolated process; the arguments are those of `trace_report`."""
    from aidsr.validation.engine import examine_text
    from aidsr.validation.page.actuators import actuator_traces
    from aidsr.validation.registry import find_rule

    examined = examine_text(text, mount, needs_contact, realizable=realizable, select=select, ignore=ignore)
    robot, faults = examined.robot, examined.report.faults
    if robot is None or robot.evidence is None:
        return TracedReport(report=examined.report, signals=(None,) * len(faults))
    rules = [find_rule(fault.code) for fault in faults]
    return TracedReport(
        report=examined.report,
        signals=tuple(
            rule.signal(robot, fault) if rule is not None and rule.signal is not None else None
            for rule, fault in zip(rules, faults, strict=True)
        ),
        actuators=tuple(actuator_traces(robot)),
    )
