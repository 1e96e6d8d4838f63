"""Every fault code: a robot made bad in one way reports that fault and no other."""

from __future__ import annotations

from pathlib import Path

import faulty
import pytest

from aidsr.validation import validate
from aidsr.validation.causes import EXPLAINS
from aidsr.validation.page import traced

MOVING = {
    "numerical_instability",
    "chatter",
    "gravity_collapse",
    "passive_collapse",
    "underdamped",
    "base_not_attached",
    "free_fall",
    "limit_overrun",
    "self_collision_lock",
    "antagonist_lock",
    "too_stiff",
    "sensor_constant",
    "tendon_pushes",
    "actuator_overforce",
    "actuator_power",
    "actuator_speed",
}
"""What is read off signals over time, and CROSSING what crosses its limit in them."""
CROSSING = {"actuator_overforce", "actuator_power", "actuator_speed", "chatter", "limit_overrun"}

RELATIVE = {"m g L", "g", "times the median segment"}
"""Units beside which an SI unit is told, as beside all that begin with "of"."""


@pytest.mark.parametrize("bad", faulty.BAD, ids=[f"{bad.code}-{index}" for index, bad in enumerate(faulty.BAD)])
def test_a_bad_robot_reports_exactly_its_fault_and_the_signal_of_it(bad: faulty.Bad) -> None:
    found = traced(bad.mjcf(), **bad.arguments)
    report = found.report
    beside = [*((code, "error") for code in bad.beside), *((code, "warning") for code in bad.warned)]
    expected = [(bad.code, bad.severity), *beside]
    assert [(fault.code, fault.severity) for fault in report.faults] == expected
    assert report.stable == (bad.severity == "warning")
    assert all(fault.message and fault.cure for fault in report.faults)
    assert len(report.account().encode()) <= 1600
    assert all(fault.measured is None or fault.measured != fault.limit for fault in report.faults)
    relative = [fault for fault in report.faults if fault.unit in RELATIVE or fault.unit.startswith("of ")]
    assert [fault for fault in report.faults if fault.whole] == [each for each in relative if each.measured is not None]
    signal = found.signals[0]
    if bad.code in MOVING:
        assert signal is not None
        assert signal.lines
        assert signal.test
        assert all(len(line.values) == len(signal.time_s) <= 240 for line in signal.lines)
    if bad.code in CROSSING:
        assert signal is not None
        values = [value for line in signal.lines for value in line.values]
        assert max(values) > max(signal.limits) or min(values) < min(signal.limits)


def test_every_rule_has_a_bad_robot() -> None:
    assert set(EXPLAINS) <= {bad.code for bad in faulty.BAD}


def test_the_documentation_lists_every_fault() -> None:
    page = (Path(__file__).parents[2] / "docs" / "validation.md").read_text(encoding="utf-8")
    assert [bad.code for bad in faulty.BAD if f"`{bad.code}`" not in page] == []


def test_no_fault_explains_itself() -> None:
    assert not [code for code, consequences in EXPLAINS.items() if code in consequences]


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("too_stiff", "with joints and tendons 50 times softer)"),
        ("self_collision_lock", "where its parts may pass through each other)"),
        ("tendon_against_limit", "without limits)"),
    ],
)
def test_what_holds_a_robot_is_said_with_what_it_would_do_without_it(code: str, words: str) -> None:
    bad = next(bad for bad in faulty.BAD if bad.code == code)
    report = validate(bad.mjcf(), **bad.arguments)
    assert words in next(fault.message for fault in report.faults if fault.code == code)
