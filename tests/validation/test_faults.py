"""Every fault code: a robot made bad in one way reports that fault and no other."""

from __future__ import annotations

import faulty
import pytest

from aidsr.validation import validate
from aidsr.validation.page import trace_report
from aidsr.validation.registry import builtin_rules, find_rule

CROSSING = {"actuator_overforce", "actuator_power", "actuator_speed", "chatter", "driven_overlap", "limit_overrun"}
"""What crosses its limit in its signal."""

RELATIVE = {"m g L", "g", "times the median segment"}
"""Units beside which an SI unit is told, as beside all that begin with "of"."""


@pytest.mark.parametrize("bad", faulty.BAD, ids=[f"{bad.code}-{index}" for index, bad in enumerate(faulty.BAD)])
def test_a_bad_robot_reports_exactly_its_fault_and_the_signal_of_it(bad: faulty.Bad) -> None:
    found = trace_report(bad.mjcf(), **bad.arguments)
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
    rule = find_rule(bad.code)
    assert rule is not None
    if rule.signal is not None and bad.code != "energy_growth":
        assert signal is not None
        assert signal.lines
        assert signal.test
        assert all(len(line.values) == len(signal.time_s) <= 240 for line in signal.lines)
    if bad.code in CROSSING:
        assert signal is not None
        values = [value for line in signal.lines for value in line.values]
        assert max(values) > max(signal.limits) or min(values) < min(signal.limits)


def test_every_rule_that_is_measured_has_a_bad_robot() -> None:
    measured = {rule.code for rule in builtin_rules() if rule.check is not None}
    assert measured == {bad.code for bad in faulty.BAD}


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("too_stiff", "with joints and tendons 50 times softer)"),
        ("self_collision_lock", "where its parts may pass through each other)"),
        ("self_collision_lock", "own contacts hold it (base on s1, s1 on s3, s3 on s5 and 1 more)"),
        ("tendon_against_limit", "without limits)"),
    ],
)
def test_what_holds_a_robot_is_said_with_what_it_would_do_without_it(code: str, words: str) -> None:
    bad = next(bad for bad in faulty.BAD if bad.code == code)
    report = validate(bad.mjcf(), **bad.arguments)
    assert words in next(fault.message for fault in report.faults if fault.code == code)
