"""`traced`: what a report was read off. Loads no simulator; the work is done in an isolated worker."""

from __future__ import annotations

from aidsr.core.artifacts import Artifact, ValidationReport
from aidsr.core.errors import IsolationError, MjcfError
from aidsr.sandbox.isolation import call
from aidsr.validation.page.traces import ActuatorTrace, Signal
from aidsr.validation.validating import Mount, unexamined


class Traced(Artifact):
    """A report and what it was read off."""

    report: ValidationReport
    signals: tuple[Signal | None, ...] = ()
    """One for each fault of the report; None where a fault is no matter of time."""
    actuators: tuple[ActuatorTrace, ...] = ()


def traced(mjcf: str, *, mount: Mount = "auto", needs_contact: bool = False, realizable: bool = False) -> Traced:
    """Validate a text as `aidsr.validate` does, and keep what the page shows; see there for the arguments."""
    options = {"mount": mount, "needs_contact": needs_contact, "realizable": realizable}
    try:
        return Traced.model_validate(call("aidsr.validation.page.tracing:trace", {"text": mjcf, **options}))
    except (IsolationError, MjcfError) as error:
        return Traced(report=unexamined(error))
