"""The worker's side of `traced`: a report, and what it was read off."""

from __future__ import annotations

from typing import Any

from aidsr.validation.engine import examine_text
from aidsr.validation.page.acting import actuator_traces
from aidsr.validation.page.signals import signal_of


def trace(argument: dict[str, Any]) -> dict[str, Any]:
    """Answer a request of `aidsr.validation.page.traced`."""
    examined = examine_text(**argument)
    robot, faults = examined.robot, examined.report.faults
    signals = [signal_of(robot, fault) if robot is not None else None for fault in faults]
    return {
        "report": examined.report.model_dump(mode="json"),
        "signals": [None if found is None else found.model_dump(mode="json") for found in signals],
        "actuators": [each.model_dump(mode="json") for each in actuator_traces(robot)] if robot is not None else [],
    }
