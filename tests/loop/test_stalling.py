"""When repairing leads nowhere."""

import pytest

from aidsr.core.artifacts import Critique, CritiqueIssue, Decision, Fault, ValidationReport
from aidsr.loop.early_stop import never_stop, no_progress
from aidsr.loop.routing import Change
from aidsr.loop.run import parts_of
from aidsr.loop.runner import run_designs
from aidsr.runs import read_status
from aidsr.studies.arms import make_arms
from scripted import Script, Scripted, fault, new_run, parts


def report(*faults: Fault) -> ValidationReport:
    return ValidationReport(stable=False, faults=faults)


def measured(value: float | None, limit: float = 10.0) -> ValidationReport:
    return report(fault("chatter", "s1").model_copy(update={"measured": value, "limit": limit}))


def critique(problem: str) -> Critique:
    return Critique(passed=False, issues=(CritiqueIssue(blame="coder", component="body", problem=problem),))


def test_the_same_faults_at_the_same_places_twice_are_enough() -> None:
    assert no_progress([Change(robot=report(fault("chatter", "s1")))] * 2)
    assert not no_progress([Change(robot=report(fault("chatter", "s1")))])


@pytest.mark.parametrize(
    ("before", "now"),
    [
        (report(fault("chatter", "s1")), report(fault("chatter", "s2"))),
        (report(fault("chatter", "s1")), report(fault("underdamped", "s1"))),
        (report(fault("chatter", "s1"), fault("chatter", "s2")), report(fault("chatter", "s1"))),
        (measured(30.0), measured(28.0)),
        (measured(2.0), measured(3.0)),
        (critique("Too short."), critique("Too weak.")),
    ],
)
def test_what_changed_or_got_better_is_tried_again(before, now) -> None:
    assert not no_progress([Change(robot=before), Change(robot=now)])


@pytest.mark.parametrize(
    ("before", "now"),
    [
        (measured(30.0), measured(29.5)),
        (measured(30.0), measured(40.0)),
        (measured(None), measured(None)),
        (critique("Too short."), critique("Too short.")),
    ],
)
def test_what_is_as_bad_or_worse_is_not(before, now) -> None:
    assert no_progress([Change(robot=before), Change(robot=now)])


def test_another_role_gets_its_attempt() -> None:
    falling = report(fault("free_fall", "robot/base"))
    handed_over = [Change(placement=falling), Change(robot=falling)]
    assert not no_progress(handed_over)
    assert no_progress([*handed_over, Change(placement=falling)])
    assert not no_progress([Change(placement=falling), Change(robot=measured(3.0)), Change(placement=falling)])


def test_a_warning_is_no_problem_that_stays() -> None:
    warning = fault("slack", "t1").model_copy(update={"severity": "warning"})
    assert no_progress([Change(robot=report(fault("chatter"), warning)), Change(robot=report(fault("chatter")))])


def grow(tmp_path, stalled, *scripts: Script, **changes):
    scripted = Scripted(scripts)
    run = new_run(tmp_path)
    run_designs(run, parts(scripted, stalled=stalled, **changes))
    return [role for role, _, _ in scripted.asked], read_status(run).designs[0].outcome


def test_a_stuck_design_costs_three_calls_instead_of_ten(tmp_path) -> None:
    stuck = Script(robots=["chatter@s1"])
    early, outcome = grow(tmp_path, no_progress, stuck)
    assert early == ["designer", "coder", "coder"]
    assert (outcome.outcome, outcome.iteration) == ("invalid", 2)
    said = "iterations 1 and 2 found the same faults, without improvement"
    assert outcome.reason == f"Stopped early: {said}: chatter: chatter was seen."
    late, outcome = grow(tmp_path, never_stop, stuck)
    assert late == ["designer", *["coder"] * 9]
    assert outcome.iteration == 9


def test_the_coder_still_hears_of_what_the_integrator_could_not_cure(tmp_path) -> None:
    asked, outcome = grow(tmp_path, no_progress, Script(placements=["free_fall@robot/tip"]))
    assert asked == ["designer", "coder", "integrator", "integrator", "coder"]
    assert outcome.reason.startswith("Stopped early: iterations 1 and 3 found the same faults"), "2 went to the Coder"


def test_a_persons_refinement_begins_anew(tmp_path) -> None:
    decisions = [Decision(verdict="refine", text="longer"), Decision(verdict="approve")]
    script = Script(robots=["chatter@s1", "ok", "chatter@s1", "ok"])
    _, outcome = grow(tmp_path, no_progress, script, person=lambda *_: decisions.pop(0))
    assert outcome.outcome == "approved"


@pytest.mark.parametrize(("early_stop", "part"), [(True, no_progress), (False, never_stop)])
def test_the_switch_chooses_the_part(tmp_path, early_stop: bool, part) -> None:
    run = new_run(tmp_path, early_stop=early_stop)
    assert parts_of(run).stalled is part


def test_studies_of_the_papers_method_use_up_their_iterations() -> None:
    (arm,) = make_arms(["builtin"], ["full"], concepts=3, feedback={})
    assert arm.config.early_stop is False
