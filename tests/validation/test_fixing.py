"""`fix_until_stable`: fixes and validations in turns, of which the best version is returned."""

from __future__ import annotations

import pytest

import aidsr
from aidsr.core.artifacts import ValidationReport
from aidsr.fixes import FixResult
from aidsr.validation import fixing
from aidsr.validation.registry import require_rule
from aidsr.validation.rules_page import EXAMPLE_ARM


def broken(code: str) -> str:
    rule = require_rule(code)
    assert rule.example
    return rule.example.fails(EXAMPLE_ARM)


def test_a_sound_robot_comes_back_as_it_was() -> None:
    fixed = aidsr.fix_until_stable(EXAMPLE_ARM)
    assert (fixed.mjcf, fixed.notes, fixed.unfixed, fixed.report.stable) == (EXAMPLE_ARM, (), (), True)


@pytest.mark.parametrize("code", ["underdamped", "zero_gear", "duplicate_name"])
def test_a_robot_with_one_mistake_becomes_stable(code: str) -> None:
    assert not aidsr.validate(broken(code)).stable
    fixed = aidsr.fix_until_stable(broken(code))
    assert fixed.report.stable
    assert fixed.report.faults == aidsr.validate(fixed.mjcf).faults
    assert fixed.notes
    assert sum(fixed.counts.values()) == fixed.total >= 1


def test_a_version_with_a_new_error_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fixing, "fix", lambda *_: FixResult(mjcf=broken("zero_gear"), notes=("harmed",)))
    fixed = aidsr.fix_until_stable(broken("underdamped"))
    assert (fixed.mjcf, fixed.notes, fixed.unfixed) == (broken("underdamped"), (), ("underdamped",))


def test_an_error_that_could_not_be_seen_before_is_no_harm() -> None:
    hidden = broken("underdamped").replace("<mujoco", "<!-- a -- b --><mujoco", 1)
    assert {fault.layer for fault in aidsr.validate(hidden).errors} == {"load"}
    assert aidsr.fix_until_stable(hidden, rounds=1).unfixed == ("underdamped",)


def test_after_the_last_round_the_best_version_is_returned(monkeypatch: pytest.MonkeyPatch) -> None:
    reports: list[ValidationReport] = []
    monkeypatch.setattr(fixing, "fix", lambda text, _: FixResult(mjcf=text + " ", notes=("nothing",)))
    validate = fixing.validate

    def counted(*arguments: object, **options: object) -> ValidationReport:
        reports.append(validate(broken("underdamped"), **{}))
        return reports[-1]

    monkeypatch.setattr(fixing, "validate", counted)
    fixing.fix_until_stable(broken("underdamped"), rounds=3)
    assert len(reports) == 4


def test_what_is_asked_of_parts_is_asked_in_every_round() -> None:
    assert aidsr.fix_until_stable(broken("actuator_overforce")).notes == ()
    fixed = aidsr.fix_until_stable(broken("actuator_overforce"), realizable=True)
    assert fixed.report.stable
    assert fixed.notes[0].startswith("actuator_overforce: multiplied the force")
