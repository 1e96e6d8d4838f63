"""Every fault code: a robot made bad in one way reports that fault and no other."""

from __future__ import annotations

import faulty
import pytest

from aidsr.validation import validate
from aidsr.validation.causes import EXPLAINS


@pytest.mark.parametrize("bad", faulty.BAD, ids=[f"{bad.code}-{index}" for index, bad in enumerate(faulty.BAD)])
def test_a_bad_robot_reports_exactly_its_fault(bad: faulty.Bad) -> None:
    report = validate(bad.mjcf(), **bad.arguments)
    beside = [*((code, "error") for code in bad.beside), *((code, "warning") for code in bad.warned)]
    expected = [(bad.code, bad.severity), *beside]
    assert [(fault.code, fault.severity) for fault in report.faults] == expected
    assert report.stable == (bad.severity == "warning")
    assert all(fault.message and fault.cure for fault in report.faults)
    assert len(report.account().encode()) <= 1600


def test_every_rule_has_a_bad_robot() -> None:
    assert set(EXPLAINS) <= {bad.code for bad in faulty.BAD}


def test_no_fault_explains_itself() -> None:
    assert not [code for code, consequences in EXPLAINS.items() if code in consequences]
