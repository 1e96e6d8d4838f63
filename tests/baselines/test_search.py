"""The search finds better numbers than it began with, within the ranges of the family, and again the same."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("cma", reason="needs the extra search")

from aidsr.artifacts import Brief, Concept
from aidsr.baselines.searching import Searched, searchable, team, worth_of
from aidsr.builtin.designer import RuleDesigner
from aidsr.builtin.families import FAMILIES
from aidsr.errors import UserError
from aidsr.tasks import load_task

BRIEF = load_task("button_pushing").brief()


def near_a_quarter_longer(brief: Brief, concept: Concept) -> float:
    (start,) = RuleDesigner(3).propose(brief, 1)
    return -abs(math.log(concept.parameters["length_m"] / start.parameters["length_m"] / 1.25))


def test_it_finds_what_is_worth_more_and_changes_no_shape() -> None:
    (start,), (found,) = (maker.propose(BRIEF, 1) for maker in (RuleDesigner(3), Searched(3, near_a_quarter_longer)))
    assert found.parameters["length_m"] / start.parameters["length_m"] == pytest.approx(1.25, abs=0.03)
    fixed = set(start.parameters) - set(searchable(FAMILIES[start.family].read(start)))
    assert {name: found.parameters[name] for name in fixed} == {name: start.parameters[name] for name in fixed}
    assert FAMILIES[found.family].read(found), "within the ranges of the family"
    assert Searched(3, near_a_quarter_longer).propose(BRIEF, 1) == (found,)


def test_what_is_never_bettered_stays() -> None:
    (start,) = RuleDesigner(3).propose(BRIEF, 1)
    (found,) = Searched(3, lambda _brief, concept: -float(concept.parameters != start.parameters), 8).propose(BRIEF, 1)
    assert found.parameters == start.parameters


def test_it_needs_a_task_to_measure_by() -> None:
    with pytest.raises(UserError, match="needs a benchmark task"):
        Searched(0, near_a_quarter_longer).propose(BRIEF.model_copy(update={"task": ""}), 1)
    assert team(0, "standard").coder.write(BRIEF, RuleDesigner(0).propose(BRIEF, 1)[0])


@pytest.mark.slow
def test_the_probe_tells_robots_apart() -> None:
    (concept,) = RuleDesigner(3).propose(BRIEF, 1)
    short = concept.model_copy(update={"parameters": {**concept.parameters, "length_m": 0.15}})
    assert worth_of(BRIEF, concept, level="standard") > worth_of(BRIEF, short, level="standard")
