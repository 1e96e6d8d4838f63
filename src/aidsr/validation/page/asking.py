"""`traced`: what a report was read off. Loads no simulator; the work is done in an isolated worker."""

from __future__ import annotations

from collections.abc import Collection

from aidsr.core.artifacts import Artifact, ValidationReport
from aidsr.core.errors import IsolationError, MjcfError
from aidsr.sandbox.isolated import isolated
from aidsr.validation.signals import ActuatorTrace, Signal
from aidsr.validation.validating import Mount, unexamined


class Traced(Artifact):
    """A report and what it was read off."""

    report: ValidationReport
    signals: tuple[Signal | None, ...] = ()
    """One for each fault of the report; None where a fault is no matter of time."""
    actuators: tuple[ActuatorTrace, ...] = ()


def traced(
    mjcf: str,
    *,
    mount: Mount = "auto",
    needs_contact: bool = False,
    realizable: bool = False,
    select: Collection[str] = (),
    ignore: Collection[str] = (),
) -> Traced:
    """Validate a text as `aidsr.validate` does, and keep what the page shows; see there for the arguments."""
    try:
        return trace(mjcf, mount, needs_contact, realizable, tuple(select), tuple(ignore))
    except (IsolationError, MjcfError) as error:
        return Traced(report=unexamined(error))


@isolated
def trace(
    text: str, mount: Mount, needs_contact: bool, realizable: bool, select: tuple[str, ...], ignore: tuple[str, ...]
) -> Traced:
    """Do the work of `traced` in an isolated process."""
    from aidsr.validation.engine import examine_text
    from aidsr.validation.page.acting import actuator_traces
    from aidsr.validation.registry import find_rule

    examined = examine_text(text, mount, needs_contact, realizable=realizable, select=select, ignore=ignore)
    robot, faults = examined.robot, examined.report.faults
    if robot is None or robot.evidence is None:
        return Traced(report=examined.report, signals=(None,) * len(faults))
    rules = [find_rule(fault.code) for fault in faults]
    return Traced(
        report=examined.report,
        signals=tuple(
            rule.signal(robot, fault) if rule is not None and rule.signal is not None else None
            for rule, fault in zip(rules, faults, strict=True)
        ),
        actuators=tuple(actuator_traces(robot)),
    )
