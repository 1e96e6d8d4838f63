"""Each rule is one record: its example shows the fault, its consequences exist, and it is applied after its causes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import aidsr
from aidsr.core.artifacts import Fault
from aidsr.core.errors import UserError
from aidsr.fixes import FIXES
from aidsr.validation import validate
from aidsr.validation.registry import builtin_rules, find_rule, is_explained, select_rules, without_consequences
from aidsr.validation.rule import Rule, Stage
from aidsr.validation.rules_page import EXAMPLE_ARM, rules_page

SOURCES = Path(aidsr.__file__).parent
RULES = builtin_rules()
CODES = [rule.code for rule in RULES]


def error(code: str, layer: str = "simulate") -> Fault:
    return Fault(code=code, layer=layer, severity="error", message="m")  # type: ignore[arg-type]


@pytest.mark.parametrize("arguments", [{}, {"needs_contact": True}])
def test_the_example_arm_has_no_fault(arguments: dict[str, bool]) -> None:
    assert validate(EXAMPLE_ARM, realizable=True, **arguments).faults == ()


@pytest.mark.parametrize("rule", RULES, ids=CODES)
def test_the_example_of_a_rule_has_its_fault(rule: Rule) -> None:
    assert rule.example is not None
    report = validate(rule.example.fails(EXAMPLE_ARM), realizable=True, **rule.example.arguments)
    found = {fault.code: fault for fault in report.faults}
    assert rule.code in found
    assert found[rule.code].layer == rule.layer


def test_a_code_has_one_rule() -> None:
    assert len(CODES) == len(set(CODES))


def test_every_fault_of_a_document_has_a_rule() -> None:
    """Their texts stand where the document is read, below this package."""
    readers = [path.read_text("utf-8") for folder in ("mjcf", "sim") for path in (SOURCES / folder).glob("*.py")]
    written = re.findall(
        r'(?:_fault\(\s*|code=|^    \(\s*)"([a-z]+_[a-z_]+|forbidden)"', "\n".join(readers), re.MULTILINE
    )
    assert len(set(written)) > 10
    assert set(written) <= set(CODES)


def test_consequences_exist_and_are_no_causes_of_themselves() -> None:
    assert {code for rule in RULES for code in rule.explains} <= set(CODES)
    assert not [rule.code for rule in RULES if rule.code in rule.explains]


def test_every_fix_cures_a_fault_that_a_rule_finds() -> None:
    assert {code for fix in FIXES for code in fix.cures} <= set(CODES)


def test_rules_are_applied_stage_by_stage_and_after_their_causes() -> None:
    stages = [list(Stage).index(rule.stage) for rule in RULES]
    assert stages == sorted(stages)
    late = [
        (rule.code, code)
        for place, rule in enumerate(RULES)
        for code in rule.explains
        if CODES.index(code) < place and RULES[CODES.index(code)].stage is rule.stage
    ]
    assert late == []


def test_an_error_hides_its_consequences_and_a_warning_nothing() -> None:
    faults = [error("zero_gear"), error("no_effect"), error("chatter")]
    assert [fault.code for fault in without_consequences(faults)] == ["zero_gear", "chatter"]
    warning = faults[0].model_copy(update={"severity": "warning"})
    assert not is_explained("no_effect", [warning])
    assert without_consequences([warning, faults[1]]) == (warning, faults[1])


def test_a_refuted_explanation_hides_nothing() -> None:
    faults = (error("initial_penetration"), error("numerical_instability"))
    assert without_consequences(faults) == faults[:1]
    assert without_consequences(faults, {("initial_penetration", "numerical_instability")}) == faults


def test_rules_are_selected_by_code() -> None:
    selected = [rule.code for rule in select_rules(["chatter", "no_tendons"]) if rule.stage is not Stage.DOCUMENT]
    assert selected == ["no_tendons", "chatter"]
    assert {"chatter"} == set(CODES) - {rule.code for rule in select_rules(ignore=["chatter"])}


def test_an_unknown_code_is_one_sentence_with_the_nearest() -> None:
    with pytest.raises(UserError, match=r"^no such rule: chater; did you mean chatter\?$"):
        validate(EXAMPLE_ARM, select=["chater"])


def test_a_fault_of_the_document_cannot_be_ignored() -> None:
    with pytest.raises(UserError, match=r"^xml_syntax cannot be ignored: a document that does not load"):
        validate(EXAMPLE_ARM, ignore=["xml_syntax"])


def test_what_is_not_selected_is_neither_reported_nor_an_explanation() -> None:
    rule = find_rule("zero_gear")
    assert rule is not None
    assert rule.example is not None
    text = rule.example.fails(EXAMPLE_ARM)
    assert [fault.code for fault in validate(text).faults] == ["zero_gear"]
    ignoring = validate(text, ignore=["zero_gear"])
    assert [(fault.code, fault.severity) for fault in ignoring.faults] == [("no_effect", "warning")]
    assert "did not look for zero_gear" in ignoring.notes
    only = validate(text, select=["no_sensors", "no_tendons"])
    assert only.stable
    assert only.notes == ("looked only for no_sensors, no_tendons",)
    assert "fastest_body_m_s" not in only.measurements


def test_the_page_of_rules_is_what_the_records_say() -> None:
    page = (Path(__file__).parents[2] / "docs" / "rules.md").read_text(encoding="utf-8")
    assert page == rules_page(RULES), "write it anew: aidsr rules --page > docs/rules.md"
