"""Faults that stand beside each other: divergence and chatter hide nothing that can still be measured."""

from __future__ import annotations

import faulty
import mujoco
import pytest

from aidsr.core.artifacts import Fault, ValidationReport
from aidsr.sim.structure import read_structure
from aidsr.validation import validate
from aidsr.validation.counterfactuals import softer
from aidsr.validation.engine import examine_text
from aidsr.validation.registry import without_consequences
from aidsr.validation.rules_page import EXAMPLE_ARM
from aidsr.validation.stiffness import explain_divergence


def codes(report: ValidationReport) -> list[str]:
    return [fault.code for fault in report.errors]


def test_limits_are_looked_at_in_the_tests_that_do_not_diverge() -> None:
    """Pulled forty times too hard it flies apart in some tests; in the others its joints overrun their limits."""
    report = validate(faulty.overrun(40, radius_m=0.011))
    assert codes(report) == ["numerical_instability", "chatter", "limit_overrun"]


def test_the_kick_of_a_stiff_robot_is_small() -> None:
    """0.02 rad in springs like these would make it faster than anything real, which would be the test's fault."""
    assert codes(validate(faulty.stiff(1e5))) == ["too_stiff"]


def test_a_servo_that_loses_its_force_in_chatter_is_not_too_weak() -> None:
    found = [
        Fault(code=code, layer="simulate", severity="error", message="m")
        for code in ("chatter", "too_stiff", "tendon_against_limit")
    ]
    assert [fault.code for fault in without_consequences(found)] == ["chatter", "tendon_against_limit"]


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        (faulty.hammering_servos(), "Euler treats kv explicitly"),
        (faulty.swapped(r'(<geom name="g7" [^>]*) mass="[^"]*"', r'\1 mass="60"', faulty.arm()), "the median's mass"),
        (faulty.unstable(), "too stiff for the time step"),
    ],
)
def test_what_makes_a_simulation_diverge_is_named(text: str, cause: str) -> None:
    model = mujoco.MjModel.from_xml_string(text)
    assert cause in explain_divergence(model, read_structure(model))


def test_the_effects_of_a_change_belong_to_their_tests() -> None:
    robot = examine_text(EXAMPLE_ARM).robot
    assert robot is not None
    first, second = robot.single_tests([0]), robot.single_tests([1])
    assert robot.effects_if("softer", softer(2.0), first).keys() == set(first)
    assert robot.effects_if("softer", softer(2.0), second).keys() == set(second)
