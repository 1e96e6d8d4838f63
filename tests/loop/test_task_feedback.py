"""Scenes that the Judge passed are tried on their task, and go back a bounded number of times."""

from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest

from aidsr.core.artifacts import Critique, CritiqueIssue, Decision, TaskReport
from aidsr.core.config import Budget
from aidsr.core.errors import BudgetError, IsolationError, UserError
from aidsr.core.roles import Team
from aidsr.loop.early_stop import no_progress
from aidsr.loop.routing import Change, after_trial
from aidsr.loop.run import parts_of
from aidsr.loop.runner import run_designs
from aidsr.runs import Run, read_events, read_status
from aidsr.runs.event_text import DOING, sentence
from aidsr.runs.events import Decided, Step, StepDone, Waiting
from aidsr.runs.stages import iteration_stages
from scripted import Script, Scripted, new_run, parts


def solved() -> TaskReport:
    return TaskReport(phase="solved", progress=1.0, critique=Critique(passed=True, summary="It can do it."))


def short(blame: str = "coder", progress: float = 0.2, problem: str = "touches with 0.1 N") -> TaskReport:
    issue = CritiqueIssue(blame=blame, component="tip", problem=problem, suggestion="pull more")
    critique = Critique(passed=False, summary=f"It comes to {progress}.", issues=(issue,))
    return TaskReport(phase="no_force", progress=progress, critique=critique)


def grow(tmp_path: Path, *reports: TaskReport | Exception, script: Script | None = None, **changes):
    left = list(reports)

    def try_on_task(_robot, _scene):
        report = left.pop(0)
        if isinstance(report, Exception):
            raise report
        return report

    scripted = Scripted([script or Script()])
    run = new_run(tmp_path)
    run_designs(run, parts(scripted, **{"try_on_task": try_on_task, "task_rounds": 2, **changes}))
    assert left == [], "some of the trials were not made"
    return run, [role for role, _, _ in scripted.asked], read_status(run).designs[0].outcome, scripted


def test_a_scene_that_can_do_its_task_is_approved(tmp_path) -> None:
    run, asked, outcome, _ = grow(tmp_path, solved())
    assert asked == ["designer", "coder", "integrator", "judge"]
    assert outcome.reason == "Plausible. It can do it."
    assert run.design(1).iteration(1).task_report.read() == solved()
    assert sentence(StepDone(step="task_report", summary="no force")) == "tried on its task: no force"
    done = [event for event in read_events(run.design(1).events) if isinstance(event, StepDone)]
    assert [event.summary for event in done if event.step == "task_report"] == ["solved"]


@pytest.mark.parametrize(
    ("blame", "again"),
    [("coder", ["coder"]), ("integrator", ["integrator"]), ("designer", ["designer", "coder", "integrator"])],
)
def test_one_that_falls_short_returns_to_the_role_to_blame(tmp_path, blame: str, again: list[str]) -> None:
    run, asked, outcome, _ = grow(tmp_path, short(blame), solved())
    assert asked == ["designer", "coder", "integrator", "judge", *again, "judge"]
    assert (outcome.outcome, outcome.iteration) == ("approved", 2)
    status = read_status(run).designs[0]
    iterations = iteration_stages(run.design(1), status)
    stages = [stage for iteration in iterations for stage in iteration.stages if stage.name == "tried"]
    assert [(stage.mark, stage.text) for stage in stages] == [("bad", "no force"), ("good", "solved")]


class PlacesWithRobot(Scripted):
    def team(self, folder: Path) -> Team:
        return replace(super().team(folder), places_with_robot=True)


@pytest.mark.parametrize("blame", ["coder", "integrator"])
def test_a_team_that_makes_robot_and_placement_together_makes_both_again(tmp_path, blame: str) -> None:
    scripted, reports = PlacesWithRobot(), [short(blame), solved()]
    run = new_run(tmp_path)
    run_designs(run, parts(scripted, try_on_task=lambda _robot, _scene: reports.pop(0), task_rounds=2))
    asked = [role for role, _, _ in scripted.asked]
    assert asked == ["designer", "coder", "integrator", "judge", "coder", "integrator", "judge"]
    feedback = [feedback for _, _, feedback in scripted.asked[4:6]]
    assert [issue.problem for one in feedback for issue in one.issues] == ["touches with 0.1 N"] * 2
    assert run.design(1).iteration(2).robot.read() is not None


def test_issues_of_robot_and_placement_are_told_together_once() -> None:
    issues = [CritiqueIssue(blame=role, component=role, problem="off") for role in ("coder", "integrator")]
    robot, placement = (Critique(passed=False, issues=(issue,)) for issue in issues)
    together = Change(robot=robot, placement=placement).of_robot_and_placement
    assert together.robot == together.placement == Critique(passed=False, issues=tuple(issues))
    assert Change(concept="longer").of_robot_and_placement == Change(concept="longer")


def test_the_designer_is_told_how_far_it_came() -> None:
    assert after_trial(short("designer")).concept == "It comes to 0.2.\ntip: touches with 0.1 N. pull more"
    assert after_trial(short("coder")).concept == ""


def test_after_its_rounds_what_came_farthest_is_kept(tmp_path) -> None:
    trials = [short(progress=0.2, problem="a"), short(progress=0.4, problem="b"), short(progress=0.3, problem="c")]
    run, asked, outcome, _ = grow(tmp_path, *trials)
    assert asked.count("coder") == 3
    assert (outcome.outcome, outcome.iteration) == ("approved", 2)
    assert outcome.reason == "Plausible. It comes to 0.4."
    assert run.design(1).final_robot.read() == run.design(1).iteration(2).robot.xml.read()
    assert [it.number for it in run.design(1).leading_to()] == [2, 1]
    assert read_status(run).designs[0].stable
    assert "02/critique.json" in run.summary.read_text()


def test_each_round_has_all_its_iterations_and_a_failed_one_keeps_what_was(tmp_path) -> None:
    script = Script(robots=["ok", *["chatter"] * 20])
    run, asked, outcome, _ = grow(tmp_path, short(), script=script)
    status = read_status(run).designs[0]
    assert (status.iteration, status.stable, status.faults) == (10, True, ())
    assert asked.count("coder") == 1 + 9
    assert (outcome.outcome, outcome.iteration) == ("approved", 1)
    assert run.design(1).final_scene.read() == run.design(1).iteration(1).scene.xml.read()


@pytest.mark.parametrize(("replaced", "ends"), [(False, "approved"), (True, "out_of_budget")])
def test_a_spent_budget_keeps_what_was_unless_the_run_may_get_another(tmp_path, replaced: bool, ends: str) -> None:
    run, spent = new_run(tmp_path), BudgetError("1,000 tokens are spent", "tokens")
    if replaced:
        run.larger_budget.write_text(Budget(tokens=1000).model_dump_json())
    scripted = Scripted([Script(robots=["ok", spent])])
    run_designs(run, parts(scripted, try_on_task=lambda _robot, _scene: short(), task_rounds=2))
    assert run.design(1).outcome.read().outcome == ends


def test_the_judge_sees_the_trial_before_it_decides(tmp_path) -> None:
    given = solved().model_copy(update={"account": "- 40 motions: progress 1.00"})
    scripted = grow(tmp_path, given)[3]
    assert [told for role, _, told in scripted.asked if role == "judge"] == [
        "It can do it.\n- 40 motions: progress 1.00"
    ]


def test_roles_are_told_figures_and_what_earlier_bodies_and_placements_came_to(tmp_path) -> None:
    first = short("integrator").model_copy(update={"account": "- 40 motions: progress 0.20"})
    second = short("coder", progress=0.4, problem="slips").model_copy(update={"account": "- 40 motions: progress 0.40"})
    scripted = grow(tmp_path, first, second, solved())[3]
    (placed,) = [told for role, _, told in scripted.asked if role == "integrator" and told]
    assert placed.summary == "It comes to 0.2.\n\n- 40 motions: progress 0.20\n"
    (repaired,) = [told for role, _, told in scripted.asked if role == "coder" and told]
    assert repaired.summary == (
        "It comes to 0.4.\n\n- 40 motions: progress 0.40\n\nEarlier bodies and placements of this design:\n"
        "- iteration 1, concept 1 as of iteration 1, fixed at ok, position 0 0 0 m, rotation 0 0 0 deg, scale 1: "
        "progress 0.20 (0.20 to 0.20 by seed), no force; tip: touches with 0.1 N\n"
    )


def test_what_is_kept_is_what_comes_farthest_when_it_is_measured_again(tmp_path) -> None:
    trials = [short(progress=0.2, problem="a"), short(progress=0.4, problem="b"), short(progress=0.3, problem="c")]
    fresh = {"1": 0.35, "2": 0.1, "3": 0.3}

    def again(robot, _scene) -> TaskReport:
        return short(progress=fresh[robot.mjcf.partition("number='")[2][0]])

    run, _, outcome, _ = grow(tmp_path, *trials, measure_again=again)
    assert (outcome.outcome, outcome.iteration) == ("approved", 1)
    assert [run.design(1).iteration(n).measured_again.read().progress for n in (1, 2, 3)] == [0.35, 0.1, 0.3]
    done = [event for event in read_events(run.design(1).events) if isinstance(event, StepDone)]
    assert "measured again: progress 0.35" in [sentence(event) for event in done]


def test_the_same_shortfall_twice_is_enough(tmp_path) -> None:
    _, asked, outcome, _ = grow(tmp_path, short(), short(), stalled=no_progress)
    assert asked.count("coder") == 2
    assert outcome.outcome == "approved"


def test_a_person_is_asked_about_what_is_kept(tmp_path) -> None:
    shown = []

    def person(iteration, log, halt) -> Decision:
        log.write(Waiting(iteration=iteration.number))
        (run,) = (Run(path) for path in tmp_path.iterdir())
        status = read_status(run).designs[0]
        shown.append((iteration.number, status.state, status.stands_at, status.iteration))
        log.write(Decided(iteration=iteration.number, verdict="quit"))
        return Decision(verdict="quit", text="not good enough")

    _, _, outcome, _ = grow(
        tmp_path, short(problem="a"), short(progress=0.1, problem="b"), person=person, task_rounds=1
    )
    assert shown == [(1, "waiting", 1, 2)]
    assert (outcome.outcome, outcome.iteration) == ("quit", 1)


def test_a_trial_that_cannot_be_made_stands_in_nobodys_way(tmp_path) -> None:
    run, _, outcome, _ = grow(tmp_path, IsolationError("time", "too slow"))
    assert outcome.outcome == "approved"
    assert "could not be tried on its task: too slow" in run.design(1).iteration(1).task_report.read().critique.summary


def test_resuming_tries_nothing_twice(tmp_path) -> None:
    run, _, _, _ = grow(tmp_path, short(), solved())
    run.design(1).outcome.path.unlink()

    def again(_robot, _scene):
        pytest.fail("tried once more")

    run_designs(run, parts(Scripted(), try_on_task=again, task_rounds=2))
    assert read_status(run).approved == 1


def test_every_step_has_words_while_it_is_at_work() -> None:
    assert set(get_args(Step)) == DOING.keys()


def test_it_is_off_by_default_and_needs_a_task(tmp_path) -> None:
    assert parts_of(new_run(tmp_path)).try_on_task is None
    with pytest.raises(UserError, match="requires a measure of success; name a task, or give a goal"):
        new_run(tmp_path, task_feedback=True)
