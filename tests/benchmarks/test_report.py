"""The arithmetic of the corpus report."""

from __future__ import annotations

import math

from benchmarks.validator.corpus.keeping import Corpus
from benchmarks.validator.corpus.specimen import Specimen
from benchmarks.validator.report import Verdict, score, summarize
from benchmarks.validator.tables import markdown

from aidsr.core.artifacts import Fault, ValidationReport

EMPTY = "<mujoco/>"


def verdict(name: str, grade: str, code: str, *errors: str, warnings: tuple[str, ...] = (), **more: object) -> Verdict:
    faults = [Fault(code=each, layer="simulate", severity="error", message="m") for each in errors]
    faults += [Fault(code=each, layer="realizability", severity="warning", message="m") for each in warnings]
    specimen = Specimen(name, "tuning", "arm", "hinges", EMPTY, grade=grade, code=code, **more)  # type: ignore[arg-type]
    return Verdict(specimen, ValidationReport(stable=not errors, faults=tuple(faults)))


def test_recall_precision_and_what_was_said_instead() -> None:
    verdicts = [
        verdict("a", "bad", "chatter", "chatter"),
        verdict("b", "bad", "chatter", "underdamped", loads=False),
        verdict("c", "near miss", "chatter", "chatter"),
        verdict("d", "band", "chatter", "chatter"),
        verdict("e", "good", ""),
        verdict("f", "good", "", "too_stiff"),
        verdict("g", "good", "", warnings=("actuator_speed",), symptoms={"actuator_speed": 0.3}),
        verdict("h", "good", "", warnings=("actuator_speed",), symptoms={"actuator_speed": 0.9}),
    ]
    scores = score(verdicts)
    chatter = scores["chatter"]
    assert (chatter.bad, chatter.found, chatter.recall) == (2, 1, 0.5)
    assert dict(chatter.instead) == {"underdamped": 1}
    assert (chatter.near_blamed, chatter.band_blamed, chatter.precision) == (1, 1, 0.5)
    assert scores["too_stiff"].good_blamed == ["f"]
    assert math.isnan(scores["too_stiff"].recall)
    assert scores["actuator_speed"].good_blamed == ["g"]
    figures = summarize(Corpus(), verdicts, scores)
    assert (figures["recall"], figures["false_alarm_share"]) == (0.5, 0.25)
    text = markdown({"tuning": figures})
    assert "| `chatter` | 2 | 1 | 50 % | 50 % | 1 of 1 | 1 of 1 | 0 | 0 |" in text
    assert "- chatter: underdamped (1)" in text
    assert "| bad robots found | 1 of 2 (50.0 %) | 9 to 91 % |" in text
    assert "- missed: b: " in text
    assert "| Simulate: driven | 2 | 2, 100.0 % (34 to 100 %) | 1, 50.0 % (9 to 91 %) |" in text
    assert "| hinges | 4 | 1, 25.0 % (5 to 70 %) |" in text


def test_a_fault_beside_another_counts_as_true_only_if_the_oracle_finds_it() -> None:
    bare = '<mujoco><worldbody><body><joint/><geom size="0.1"/></body></worldbody></mujoco>'
    specimen = Specimen("bare", "tuning", "arm", "hinges", bare, grade="bad", code="no_tendons")
    faults = [
        Fault(code=code, layer="structure", severity="error", message="m")
        for code in ("no_tendons", "no_sensors", "range_inverted_ignored")
    ]
    scores = score([Verdict(specimen, ValidationReport(stable=False, faults=tuple(faults)))])
    assert scores["no_sensors"].beside == 1
    assert dict(scores["range_inverted_ignored"].beside_false) == {"bare": 1}
