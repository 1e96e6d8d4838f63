"""The search finds better numbers than it began with, within the ranges of the family, and again the same."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

pytest.importorskip("cma", reason="needs the extra search")

from aidsr.core.artifacts import Brief, Concept
from aidsr.core.errors import UserError
from aidsr.runs import Run
from aidsr.tasks import load_task
from aidsr.teams.baselines.generations import Generation, format_search, read_search, write_search
from aidsr.teams.baselines.search import SearchDesigner, probe_value, searchable, team
from aidsr.teams.rules.designer import RuleDesigner
from aidsr.teams.rules.families import BUILT_IN as FAMILIES

BRIEF = load_task("button_pushing").brief()


def near_a_quarter_longer(brief: Brief, concept: Concept) -> float:
    (start,) = RuleDesigner(3).propose(brief, 1)
    return -abs(math.log(concept.parameters["length_m"] / start.parameters["length_m"] / 1.25))


def test_it_finds_what_is_worth_more_and_changes_no_shape() -> None:
    (start,), (found,) = (
        maker.propose(BRIEF, 1) for maker in (RuleDesigner(3), SearchDesigner(3, near_a_quarter_longer, 48))
    )
    assert found.parameters["length_m"] / start.parameters["length_m"] == pytest.approx(1.25, abs=0.03)
    fixed = set(start.parameters) - set(searchable(FAMILIES[start.family].read(start)))
    assert {name: found.parameters[name] for name in fixed} == {name: start.parameters[name] for name in fixed}
    assert FAMILIES[found.family].read(found), "within the ranges of the family"
    assert SearchDesigner(3, near_a_quarter_longer, 48).propose(BRIEF, 1) == (found,)


def test_what_is_never_bettered_stays() -> None:
    (start,) = RuleDesigner(3).propose(BRIEF, 1)
    (found,) = SearchDesigner(3, lambda _brief, concept: -float(concept.parameters != start.parameters), 8).propose(
        BRIEF, 1
    )
    assert found.parameters == start.parameters


def test_every_generation_is_told_and_one_that_was_is_not_measured_again(tmp_path: Path) -> None:
    tried: list[Concept] = []

    def worth(brief: Brief, concept: Concept) -> float:
        tried.append(concept)
        return near_a_quarter_longer(brief, concept)

    told: list[Generation] = []
    found = SearchDesigner(3, worth, 32, on_generation=told.append).propose(BRIEF, 1)
    assert [(each.generation, len(each.values)) for each in told] == [(0, 1), (1, 8), (2, 8), (3, 8), (4, 8)]
    assert len(tried) == 33, "the budget, beside the rules' own robot"
    assert max(told[-1].values) > told[0].values[0], "the search gets somewhere"
    assert format_search(told).startswith("generation 4 of 4, worth -0.")
    run = Run(tmp_path)
    assert (read_search(run), format_search(())) == ((), "")
    write_search(run, told[:3])
    assert '"worths"' in (tmp_path / "search.json").read_text(), "as in files of earlier versions"
    before = {(each.concept, each.generation): each.values for each in read_search(run)}
    tried.clear()
    assert SearchDesigner(3, worth, 32, before).propose(BRIEF, 1) == found
    assert len(tried) == 16, "what was measured before the interruption is not measured again"


def test_it_ends_once_nothing_can_be_worth_more() -> None:
    told: list[Generation] = []
    (found,) = SearchDesigner(3, lambda _brief, _concept: 2.0, 32, on_generation=told.append).propose(BRIEF, 1)
    assert [each.generation for each in told] == [0]
    assert "over 0 robots: worth 2.00 to the probe, 2.00 at first" in found.rationale


def test_it_needs_a_task_to_measure_by() -> None:
    with pytest.raises(UserError, match="needs a benchmark task"):
        SearchDesigner(0, near_a_quarter_longer, 48).propose(BRIEF.model_copy(update={"task": ""}), 1)
    assert team(0, "standard", 8).coder.write(BRIEF, RuleDesigner(0).propose(BRIEF, 1)[0])


@pytest.mark.slow
def test_the_probe_tells_robots_apart() -> None:
    (concept,) = RuleDesigner(3).propose(BRIEF, 1)
    short = concept.model_copy(update={"parameters": {**concept.parameters, "length_m": 0.15}})
    assert probe_value(BRIEF, concept, level="standard") > probe_value(BRIEF, short, level="standard")
