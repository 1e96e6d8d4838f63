"""The plain text of a report: worst first, repeats together, bounded, nothing lost without a count."""

from __future__ import annotations

from typing import Literal

import pytest

from aidsr.core.artifacts import Fault, PlausibilityCheck, ValidationReport
from aidsr.core.formatting import format_check, format_number


def fault(
    code: str, severity: Literal["error", "warning"] = "error", names: tuple[str, ...] = (), **more: object
) -> Fault:
    return Fault.model_validate(
        {"code": code, "layer": "simulate", "severity": severity, "names": names, "message": "seen", "cure": "Mend it."}
        | more
    )


def account(*faults: Fault, max_bytes: int = 1600) -> str:
    return ValidationReport(stable=False, faults=faults).account(max_bytes)


def test_nothing_found() -> None:
    assert ValidationReport(stable=True).account() == "stable: no faults found"


def test_one_fault_is_one_line_with_all_its_facts() -> None:
    one = fault(
        "too_stiff", names=("m0", "m1"), measured=0.0123, limit=0.05, unit="of L", likely_cause="springs", line=7
    )
    assert account(one) == (
        "too_stiff at m0, m1 (line 7): seen: 0.0123 of L (at least 0.05). Likely cause: springs. Mend it."
    )


@pytest.mark.parametrize(
    ("facts", "told"),
    [
        ({"measured": 0.41, "limit": 0.35, "unit": "of L", "whole": 0.3}, "0.41 of L, 123 mm (at most 0.35, 105 mm)"),
        ({"measured": 0.2, "limit": 0.5, "unit": "of L", "whole": 8.0}, "0.2 of L, 1.6 m (at least 0.5, 4 m)"),
        ({"measured": 312, "limit": 200, "unit": "rad/s"}, "312 rad/s (at most 200)"),
        ({"measured": -0.1, "limit": 0, "unit": "N s/m"}, "-0.1 N s/m (at least 0)"),
        ({"measured": 0, "unit": "N"}, "0 N"),
    ],
)
def test_what_is_allowed_is_said_with_its_direction_and_in_si_units(facts: dict[str, object], told: str) -> None:
    assert f"large: seen: {told}. Mend it." == account(fault("large", whole_unit="m", **facts))


def test_errors_stand_before_warnings() -> None:
    lines = account(fault("small", "warning"), fault("large")).splitlines()
    assert [line.split(":")[0] for line in lines] == ["large", "warning small"]


def test_repeats_share_a_line() -> None:
    text = account(*(fault("undefined_reference", names=(f"s{index}",)) for index in range(1, 41)))
    assert text == "undefined_reference at s1, s2, s3 … s40 (40 in all): seen, and 39 more like it. Mend it."


@pytest.mark.parametrize("max_bytes", [200, 400, 1600])
def test_what_does_not_fit_is_counted(max_bytes: int) -> None:
    codes = [f"fault_{index}" for index in range(40)]
    text = account(*(fault(code, message="é" * 60) for code in codes), max_bytes=max_bytes)
    assert len(text.encode()) <= max_bytes
    *kept, last = text.splitlines()
    assert last.startswith(f"{40 - len(kept)} more")


def test_a_single_long_line_is_cut_whole_characters_only() -> None:
    text = account(fault("long", message="é" * 2000), max_bytes=300)
    assert len(text.encode()) <= 300
    assert text.endswith("…")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (10_000.0, "10,000"),
        (12_345.6, "12,300"),
        (22_590.0, "22,590"),
        (0.0032, "0.0032"),
        (1.2e-5, "1.2e-5"),
        (9.996, "10"),
        (-0.05, "-0.05"),
        (999_999.9, "1e6"),
        (float("inf"), "inf"),
    ],
)
def test_numbers_are_written_as_engineers_do(value: float, text: str) -> None:
    assert format_number(value) == text


@pytest.mark.parametrize(
    ("measured", "bound", "told"),
    [
        (0.82, "at least", "0.82 of it (at least 0.5)"),
        (5.0, "at least", "5 of it (at least 0.5)"),
        (0.2, "at most", "0.2 of it (at most 0.5)"),
        (0.2, "limit", "0.2 of it (limit 0.5)"),
        (None, "at most", "not measured"),
    ],
)
def test_a_check_tells_on_which_side_its_limit_lies(measured, bound, told):
    check = PlausibilityCheck(
        name="x", passed=False, measured=measured, limit=0.5, bound=bound, unit="of it", message=""
    )
    assert format_check(check) == told
