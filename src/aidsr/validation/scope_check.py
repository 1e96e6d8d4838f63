"""The check that all scope rules share: whether the robot is a tendon-driven continuum robot.

The measurements and their limits are in `aidsr.sim.scope`, which the evaluation of policies uses too.
"""

from __future__ import annotations

from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.sim.scope import find_out_of_scope
from aidsr.validation.registry import require_rule
from aidsr.validation.robot_under_test import RobotUnderTest


def find_out_of_scope_faults(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find the reasons why a robot is not a tendon-driven continuum robot."""
    for found in find_out_of_scope(robot.model, robot.structure):
        rule = require_rule(found.code)
        yield rule.fault(
            found.message,
            names=found.names,
            measured=found.measured,
            limit=found.limit,
            unit=found.unit or rule.unit,
            whole=found.whole,
            whole_unit=found.whole_unit,
        )


def added(element: str, text: str) -> tuple[str, str]:
    """Return a change to the example arm that adds text at the end of an element; see `Example.changes`."""
    return f"  </{element}>", f"  {text}\n  </{element}>"


def inside(body: str, text: str) -> tuple[str, str]:
    """Return a change to the example arm that adds text at the beginning of a body; see `Example.changes`."""
    place = "" if body == "base" else ' pos="0 0 0.025"'
    return f'<body name="{body}"{place}>', f'<body name="{body}"{place}>\n        {text}'
