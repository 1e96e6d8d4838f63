"""The built-in team for a goal: what it reads of goal and geometry, where it puts bodies, and what it says of them."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from aidsr.core.artifacts import Placement
from aidsr.core.config import RunConfig
from aidsr.core.errors import IsolationError, NoBetterDesignError, UserError
from aidsr.examples import examples
from aidsr.loop.run import create_run, make_brief, parts_of
from aidsr.loop.runner import run_designs
from aidsr.runs.event_text import sentence, tried_text
from aidsr.runs.events import Tried, read_events
from aidsr.runs.status import read_status
from aidsr.runs.summary import write_summary
from aidsr.sim.assembly import assemble
from aidsr.tasks import TASKS, goal_task, parse_goal
from aidsr.teams import rules
from aidsr.teams.fitting import check, judge, trial, views
from aidsr.teams.fitting.judge import FittingJudge
from aidsr.teams.fitting.team import FittingDesigner, fitting_team
from aidsr.teams.fitting.tool import CHECK
from aidsr.teams.fitting.views import View, as_placed, as_the_rules_read, as_viewed, candidates, place_of_work, turns_of
from aidsr.teams.rules.families import load_families
from aidsr.teams.rules.job import read_job
from aidsr.tools import OWNER_TOOLS, Workspace


def job_of(name):
    example = examples()[name]
    task = goal_task(parse_goal(example.goal), example.environment)
    brief = task.brief().model_copy(update={"task": "", "objective": example.objective})
    return brief, task.goal


def test_the_place_of_work_is_where_a_push_has_a_long_arm():
    brief, goal = job_of("valve")
    x, y, z = place_of_work(brief, goal)
    assert (x, z) == pytest.approx((0.275, 0.32), abs=0.006)
    assert 0.05 < y < 0.08, "on the lever, towards its end, not at the stem"
    assert place_of_work(*job_of("walk")) is None
    assert place_of_work(*job_of("duct")) == pytest.approx((0.359, 0.19, 0.3))
    assert place_of_work(*job_of("trace")) == pytest.approx((0.08, -0.06, 0.26))


@pytest.mark.parametrize("name", [name for name in examples() if name != "walk"])
def test_the_rules_are_told_what_the_goal_says(name):
    brief, goal = job_of(name)
    for view, _, _ in candidates(brief, goal, load_families()):
        job = read_job(as_the_rules_read(brief, goal, view))
        assert job.kind == view.kind
        assert job.target is not None
        assert job.target.body == "workpiece"
        assert job.mount is not None
        assert (job.base == "moving") == (name in ("lamp", "cup"))


def test_a_robot_that_has_to_travel_is_free():
    brief, goal = job_of("walk")
    tried = list(candidates(brief, goal, load_families()))
    assert {family for _, family, _ in tried} == {"crawler", "worm", "ring"}
    for view, _, _ in tried:
        job = read_job(as_the_rules_read(brief, goal, view))
        assert (job.kind, job.base) == (view.kind, "free")


def test_a_robot_that_stands_on_nothing_travels_whatever_the_goal():
    brief, goal = job_of("lamp")
    goal, brief = goal.model_copy(update={"base": "free"}), brief.model_copy(update={"base": "free"})
    assert {family for _, family, _ in candidates(brief, goal, load_families())} == {"crawler", "worm", "ring"}


@pytest.mark.parametrize("turn_deg", [0.0, 90.0, 270.0])
def test_a_turned_mount_points_at_the_place_of_work(turn_deg):
    brief, goal = job_of("valve")
    view = View("reach", 0, turn_deg)
    mount = as_the_rules_read(brief, goal, view).summary.mounts[0]
    way = np.subtract(place_of_work(brief, goal), mount.position_m)
    assert np.dot(mount.z_axis, way / np.linalg.norm(way)) == pytest.approx(1.0, abs=1e-5)


def test_a_placement_in_a_turned_mount_is_one_in_the_environment_and_back():
    brief, goal = job_of("valve")
    view = View("reach", 0, 90.0)
    seen = Placement(mount="mount", base="fixed", position_m=(0.01, 0.0, -0.05), rotation_deg=(0.0, 25.0, 0.0))
    placed = as_placed(brief, goal, view, seen)
    assert placed.intended_contacts == ("valve",)
    back = as_viewed(brief, goal, view, placed)
    assert back.position_m == pytest.approx(seen.position_m, abs=1e-4)
    assert back.rotation_deg == pytest.approx(seen.rotation_deg, abs=1e-2)


@pytest.mark.parametrize("about_y_deg", [-90.0, -89.0, 90.0])
def test_a_quarter_turn_about_y_is_kept(about_y_deg):
    wanted = views._matrix((30.0, about_y_deg, 40.0))
    aside = views._matrix((11.0, 22.0, 33.0))
    rounded = aside @ (aside.T @ wanted)
    assert views._matrix(views._angles_deg(rounded)) == pytest.approx(wanted, abs=1e-4)


def test_a_concept_keeps_its_view():
    brief, goal = job_of("bell")
    designer = FittingDesigner(goal, 0)
    rng = np.random.default_rng(0)
    for view, name, variant in candidates(brief, goal, load_families()):
        for turned in turns_of(view):
            concept = designer._concept(brief, goal, turned, name, variant, rng)
            assert View.of(concept) == turned
            assert fitting_team(goal, 0).coder.write(brief, concept).mjcf


def test_a_body_is_written_and_placed_by_the_families_of_its_designer():
    brief, goal = job_of("bell")
    designer = FittingDesigner(goal, 0, families={"mine": replace(load_families()["tentacle"], name="mine")})
    concept = next(designer._free(brief, judge.task_of(goal, brief)))
    assert concept.family == "mine"


def test_what_overlaps_its_surroundings_is_seen():
    brief, goal = job_of("valve")
    designer, rng = FittingDesigner(goal, 0), np.random.default_rng(0)
    (view, name, variant), *_ = candidates(brief, goal, load_families())
    found = []
    for turned in turns_of(view):
        concept = designer._concept(brief, goal, turned, name, variant, rng)
        team = fitting_team(goal, 0)
        robot = team.coder.write(brief, concept)
        scene = assemble(robot, brief.environment, team.integrator.place(brief, concept, robot))
        found.append(trial.overlaps(scene.mjcf))
    assert set(found) == {True, False}, "straight ahead it would grow into the pipe, aside it does not"


def test_no_body_that_comes_near_is_said_and_not_approved(tmp_path, monkeypatch):
    brief, goal = job_of("bell")
    fits = {"progress": 0.2, "success": False, "reached": "begun", "why": "it is too short"}
    from aidsr.teams.fitting import team as module

    monkeypatch.setattr(module, "fit", lambda *_, **__: trial.Fit(**fits))
    monkeypatch.setattr(judge, "fit", lambda *_, **__: trial.Fit(**fits))
    monkeypatch.setattr(module, "ROUNDS", (trial.Round(2, 16, 1), trial.Round(1, 16, 1)))
    team = fitting_team(goal, 0)
    (concept,) = team.designer.propose(brief, 1)
    assert "tried" in concept.rationale
    assert "0.20" in concept.rationale
    robot = team.coder.write(brief, concept)
    scene = assemble(
        robot,
        brief.environment,
        team.integrator.place(brief, concept, robot),
        goal_task(goal, brief.environment).sensors,
    )
    from aidsr.validation import validate

    report = validate(scene.mjcf, needs_contact=True)
    critique = FittingJudge(goal).judge(brief, concept, robot, scene, report)
    assert not critique.passed
    assert critique.summary == ("No motion of this body wins without learning: begun, progress 0.20; it is too short.")
    fits["progress"] = 0.9
    assert not FittingJudge(goal).judge(brief, concept, robot, scene, report).passed, "near is not done"
    fits["idle"] = 0.25
    said = FittingJudge(goal).judge(brief, concept, robot, scene, report).summary
    assert "progress 0.90, of which 0.25 by doing nothing; it is too short" in said
    fits |= {"success": True, "won": 1, "variations": 2}
    critique = FittingJudge(goal).judge(brief, concept, robot, scene, report)
    assert critique.passed
    assert "a motion succeeds in 1 of 2 tested variations" in critique.summary

    def crash(*_, **__):
        raise IsolationError("time", "it took more than 600 s")

    monkeypatch.setattr(judge, "fit", crash)
    critique = FittingJudge(goal).judge(brief, concept, robot, scene, report)
    assert not critique.passed, "nothing is known of it"
    assert critique.summary == "This body could not be tried with its goal: it took more than 600 s."
    (issue,) = critique.issues
    feedback = f"{issue.component}: {issue.problem}. {issue.suggestion}"
    assert "It takes the place of" in team.designer.revise(brief, concept, robot, feedback).rationale


def test_what_stands_before_the_place_of_work_is_seen():
    brief, goal = job_of("valve")
    mount, place = brief.summary.mounts[0].position_m, place_of_work(brief, goal)
    assert trial.is_in_the_way(brief.environment, mount, place, ("valve",))
    aside = (mount[0], mount[1] + 0.1, mount[2])
    assert not trial.is_in_the_way(brief.environment, aside, place, ("valve",)), "beside the pipe"
    brief, goal = job_of("knob")
    mount, place = brief.summary.mounts[0].position_m, place_of_work(brief, goal)
    assert not trial.is_in_the_way(brief.environment, mount, place, ("knob",))
    assert trial.is_in_the_way(brief.environment, mount, (0.28, 0.0, 0.3), ())


def test_a_body_that_has_to_get_round_something_is_longer():
    brief, goal = job_of("valve")
    designer = FittingDesigner(goal, 0)
    assert designer._blocked(brief, goal) == {0}
    knob, turn = job_of("knob")
    assert FittingDesigner(turn, 0)._blocked(knob, turn) == set()
    straight, about = (
        designer._concept(brief, goal, view, "arm", "two sections", np.random.default_rng(0)).parameters["length_m"]
        for view in (View("reach", 0, 0.0), views.detour(View("reach", 0, 0.0)))
    )
    assert about == pytest.approx(1.25 * straight, rel=0.01)


def test_a_body_that_overlaps_its_surroundings_is_no_reference(tmp_path, monkeypatch):
    from aidsr.teams.fitting import team as module

    monkeypatch.setattr(module, "overlaps", lambda _scene: True)
    monkeypatch.setattr(module, "_SIDE_BY_SIDE", 2)  # so many are tried before it is given up
    example = examples()["bell"]
    for name, text in (("bell.xml", example.environment), ("bell.toml", example.goal)):
        (tmp_path / name).write_text(text)
    found = check.check_goal(tmp_path / "bell.xml", tmp_path / "bell.toml")
    assert any("No built-in robot could be placed" in line for line in found.lines)
    assert (found.reference, found.blind, found.probe, found.scene) == ("", None, None, example.environment)
    assert found.problems == (
        "No built-in robot could be placed: each overlaps something at the start; make room at the mount.",
    )
    (concept,) = FittingDesigner(parse_goal(example.goal), 0).propose(job_of("bell")[0], 1)
    assert "no body could be placed" in concept.rationale


def test_a_run_with_a_goal_is_designed_by_measuring(tmp_path):
    example = examples()["bell"]
    for name, text in (("bell.xml", example.environment), ("bell.toml", example.goal)):
        (tmp_path / name).write_text(text)
    config = RunConfig(model="builtin")
    own = make_brief("Ring it", environment=tmp_path / "bell.xml", goal=tmp_path / "bell.toml")
    run = create_run(own, config, runs=tmp_path / "runs", goal=tmp_path / "bell.toml")
    assert isinstance(parts_of(run).team_for(tmp_path).designer, FittingDesigner)


@pytest.mark.parametrize("name", TASKS)
def test_the_team_of_a_benchmark_task_is_that_of_the_frozen_rules(name, tmp_path):
    config = RunConfig(model="builtin", seed=3)
    run = create_run(make_brief(task=name), config, level="standard", runs=tmp_path)
    team = parts_of(run).team_for(tmp_path)
    assert team == rules.team(3)
    parts = (team.designer, team.coder, team.integrator, team.judge)
    assert {type(role).__module__.rpartition(".")[0] for role in parts} == {"aidsr.teams.rules"}


@pytest.mark.parametrize(("pose", "axis"), [("0 0.3 0", 3), ("0.3 0 0", 1), ("0 0 -0.3", 5)])
def test_a_robot_that_is_brought_is_turned_beside_the_work_and_scaled_to_the_way(pose, axis, monkeypatch):
    from aidsr.teams.fitting import team as module

    brief, goal = job_of("valve")
    mine = f"""<mujoco><worldbody><body name="arm"><joint name="bend" axis="1 1 1" stiffness="1" damping="0.1"/>
      <geom type="capsule" size="0.005" fromto="0 0 0 {pose}"/><site name="tip" pos="{pose}"/></body></worldbody>
      <actuator><motor name="m" joint="bend" ctrlrange="-1 1"/></actuator></mujoco>"""
    brief = brief.model_copy(update={"starting_robot": mine})
    tried = []

    def fit(scene, *_):
        tried.append(scene)
        return trial.Fit(progress=0.1 * len(tried), success=False, reached="begun")

    monkeypatch.setattr(module, "fit", fit)
    (concept,) = fitting_team(goal, 0).designer.propose(brief, 1)
    assert View.of(concept).axis == axis
    assert View.of(concept).scale == pytest.approx(1.05 * 0.282 / 0.305, abs=0.01)
    team = fitting_team(goal, 0)
    placement = team.integrator.place(brief, concept, team.coder.write(brief, concept))
    scene = assemble(team.coder.write(brief, concept), brief.environment, placement)
    import mujoco

    model = mujoco.MjModel.from_xml_string(scene.mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    way = np.subtract(place_of_work(brief, goal), (0, 0, 0.3))
    along = data.site("robot/functional_part").xpos - (0, 0, 0.3)
    assert along @ way / np.linalg.norm(along) / np.linalg.norm(way) == pytest.approx(np.cos(np.deg2rad(25)), abs=1e-3)
    assert "scaled by" in concept.rationale


@pytest.mark.slow
def test_the_tool_tells_what_the_command_tells_with_both_pictures(tmp_path, monkeypatch):
    monkeypatch.setattr(check, "ROUNDS", (trial.Round(2, 16, 20_000),))  # any body will do
    bell, work = examples()["bell"], Workspace(tmp_path)
    given = {"objective": bell.objective, "environment": bell.environment, "goal": bell.goal}
    OWNER_TOOLS["make_task"].call(work, given)
    told = CHECK.call(work, {"task": "task_1"})
    assert "No actions: 0 of 5 episodes succeed" in told.text
    assert "Random actions: 0 of 5 episodes succeed" in told.text
    assert "A built-in robot: " in told.text
    assert [drawn[:4] for drawn in told.pictures] == [b"\x89PNG"] * 2


def test_the_tool_check_takes_own_tasks_only(tmp_path):
    with pytest.raises(UserError, match="check takes an own task"):
        CHECK.call(Workspace(tmp_path), {"task": "button_pushing"})


def hopeless(monkeypatch, bodies):
    """Bodies that come to less and less, and win nothing."""
    from aidsr.teams.fitting import team as module

    fits = itertools.count()
    monkeypatch.setattr(module, "ROUNDS", (trial.Round(bodies, 16, 1),))
    monkeypatch.setattr(
        module, "fit", lambda *_, **__: trial.Fit(progress=0.9 - 0.1 * next(fits), success=False, reached="begun")
    )


def test_a_refused_body_gives_way_to_the_next_best_and_the_end_is_said(monkeypatch):
    hopeless(monkeypatch, 4)
    brief, goal = job_of("bell")
    designer = FittingDesigner(goal, 0)
    ranked = designer._rank(brief, 2)
    assert len(ranked) == 4
    first, _ = designer.propose(brief, 2)
    refusal = f"family: {judge.REFUSED}: begun, progress 0.20; it is too short. Name a language model."
    second = designer.revise(brief, first, None, refusal)
    assert without_rank(second) == without_rank(ranked[2]) != without_rank(first)
    assert "0.70" in second.rationale, "its own figure"
    assert f"It takes the place of {first.name}" in second.rationale
    with pytest.raises(NoBetterDesignError, match=r"^2 bodies were judged for this design, and no motion") as ended:
        designer.revise(brief, second, None, refusal)
    assert "Name a language model" in str(ended.value)


def without_rank(concept):
    return {name: value for name, value in concept.parameters.items() if name not in ("view_rank", "view_count")}


def test_of_bodies_that_come_equally_far_the_one_with_fewer_winches_is_proposed_first(monkeypatch):
    from aidsr.teams.fitting import team as module

    winches = iter((9, 3, 6))
    monkeypatch.setattr(module, "ROUNDS", (trial.Round(3, 16, 10),))
    monkeypatch.setattr(
        module, "fit", lambda *_: trial.Fit(progress=0.5, success=False, reached="", winches=next(winches))
    )
    brief, goal = job_of("bell")
    tried = []
    ranked = FittingDesigner(goal, 0).with_listener(tried.append)._rank(brief, 1)
    nine, three, six = (body.name for body in tried)
    assert [each.name for each in ranked] == [three, six, nine]


def test_no_body_that_is_tried_pulls_harder_than_the_validator_allows():
    brief, goal = job_of("bell")
    family, view = load_families()["arm"], next(candidates(brief, goal, load_families()))[0]
    designer, rngs = FittingDesigner(goal, 0), [np.random.default_rng(seed) for seed in range(12)]
    job = read_job(as_the_rules_read(brief, goal, view))
    sized = [family.size(job, np.random.default_rng(seed), "three sections") for seed in range(12)]
    too_strong = [each for each in sized if trial.spare_tension(family.write(each).mjcf) < 1.0]
    assert too_strong, "else nothing is tested"
    concepts = [designer._concept(brief, goal, view, "arm", "three sections", rng) for rng in rngs]
    for size, concept in zip(sized, concepts, strict=True):
        robot = fitting_team(goal, 0).coder.write(brief, concept)
        assert trial.spare_tension(robot.mjcf) >= 1.0
        same_bend = concept.parameters["bending_stiffness_n_m2"] / concept.parameters["tension_n"]
        assert same_bend == pytest.approx(size.bending_stiffness_n_m2 / size.tension_n, rel=0.01)


def test_what_a_person_asks_for_keeps_the_interpretation(monkeypatch):
    hopeless(monkeypatch, 2)
    brief, goal = job_of("bell")
    designer = FittingDesigner(goal, 0)
    (concept,) = designer.propose(brief, 1)
    longer = designer.revise(brief, concept, None, "make it longer")
    assert longer.interpretation == concept.interpretation
    assert longer.parameters["length_m"] > concept.parameters["length_m"]
    refused = designer.revise(brief, longer, None, f"family: {judge.REFUSED}: begun.")
    assert without_rank(refused) == without_rank(designer._rank(brief, 1)[1])


def run_of_hopeless_bodies(tmp_path, monkeypatch, *progress):
    """Return a run for a goal of three bodies that win nothing, which the Judge sees make this progress in turn."""
    hopeless(monkeypatch, 3)
    judged = iter(progress)
    monkeypatch.setattr(
        judge, "fit", lambda *_, **__: trial.Fit(progress=next(judged), success=False, reached="there", why="")
    )
    example = examples()["bell"]
    for name, text in (("bell.xml", example.environment), ("bell.toml", example.goal)):
        (tmp_path / name).write_text(text)
    own = make_brief("Ring it", environment=tmp_path / "bell.xml", goal=tmp_path / "bell.toml")
    config = RunConfig(model="builtin", concepts=1, iterations=1)
    return create_run(own, config, runs=tmp_path / "runs", goal=tmp_path / "bell.toml")


def test_a_resumed_run_says_which_of_the_bodies_it_ranks_again_was_refused(tmp_path, monkeypatch):
    run = run_of_hopeless_bodies(tmp_path, monkeypatch, 0.2, 0.8, 0.4)

    def stop(_changes):
        raise UserError("the first body was refused")

    run_designs(run, replace(parts_of(run), stalled=stop))
    assert run.design(1).outcome.read() is None
    hopeless(monkeypatch, 3)
    run_designs(run, parts_of(run))
    told = [event for event in read_events(run.design(1).events) if isinstance(event, Tried)]
    assert [body.refused for body in told] == [True, False, False]
    first = run.design(1).iteration(1).concept.read()
    assert sentence(told[0]).startswith(
        f"body 1 of at most 3: {first.name}: progress 0.90, rejected by the Judge earlier"
    )
    assert "rejected" not in sentence(told[1])
    assert without_rank(run.design(1).iteration(2).concept.read()) != without_rank(first)


def test_a_body_that_is_tried_again_keeps_its_number(monkeypatch):
    hopeless(monkeypatch, 3)
    brief, goal = job_of("bell")
    told = []
    rounds = (trial.Round(3, 16, 1), trial.Round(2, 64, 1))
    FittingDesigner(goal, 0).with_listener(told.append).tried(brief, rounds, enough=2)
    assert [(body.number, body.motions) for body in told] == [(1, 0), (2, 0), (3, 0), (1, 64), (2, 64)]
    assert [body.name for body in told[3:]] == [body.name for body in told[:2]]
    assert tried_text(told[2]).startswith(f"body 3 of at most 3: {told[2].name}: ")
    assert tried_text(told[4]).startswith(f"body 2 again with 64 motions: {told[1].name}: ")


def test_a_design_that_uses_up_its_iterations_is_reported_by_its_best_body(tmp_path, monkeypatch):
    run = run_of_hopeless_bodies(tmp_path, monkeypatch, 0.8, 0.2)
    run_designs(run, parts_of(run))
    outcome = run.design(1).outcome.read()
    assert (outcome.outcome, outcome.iteration) == ("invalid", 1)
    assert "iteration 1. No motion of this body wins without learning: there, progress 0.80" in outcome.reason
    assert "Faults remain after 2 attempts: family: no motion of this body wins" in outcome.reason


def test_each_body_tried_is_told_and_logged(tmp_path, monkeypatch):
    hopeless(monkeypatch, 3)
    judged = iter((0.2, 0.8, 0.4))
    monkeypatch.setattr(
        judge,
        "fit",
        lambda *_, **__: trial.Fit(progress=next(judged), success=False, reached="there", why="it stays for 0.1 s"),
    )
    example = examples()["bell"]
    for name, text in (("bell.xml", example.environment), ("bell.toml", example.goal)):
        (tmp_path / name).write_text(text)
    own = make_brief("Ring it", environment=tmp_path / "bell.xml", goal=tmp_path / "bell.toml")
    config = RunConfig(model="builtin", concepts=1)
    run = create_run(own, config, runs=tmp_path / "runs", goal=tmp_path / "bell.toml")
    run_designs(run, parts_of(run))
    tried = [event for event in read_events(run.events) if isinstance(event, Tried)]
    assert [(event.number, event.most, event.progress) for event in tried] == [
        (1, 3, pytest.approx(0.9)),
        (2, 3, pytest.approx(0.8)),
        (3, 3, pytest.approx(0.7)),
    ]
    assert sentence(tried[0]).startswith(f"body 1 of at most 3: {tried[0].name}: progress 0.90 (")
    outcome = run.design(1).outcome.read()
    names = [run.design(1).iteration(number).concept.read() for number in (1, 2, 3)]
    assert (outcome.outcome, outcome.iteration) == ("invalid", 2), "of the bodies judged the one that came farthest"
    assert outcome.reason.startswith(
        f"The best robot is {names[1].name}, iteration 2. No motion of this body wins without learning: there, "
        "progress 0.80; it stays for 0.1 s. To train it anyway: aidsr train designs/1/02/scene.xml --goal "
        "goal.toml, in the run's folder. 3 bodies were judged for this design, and no motion of any wins."
    )
    assert read_status(run).designs[0].concept == names[1].name
    shown = write_summary(run).read_text()
    assert f"1. {names[1].name}</h3>" in shown
    assert 'href="designs/1/02/preview.png"' in shown
    assert len({str(without_rank(name)) for name in names}) == 3
