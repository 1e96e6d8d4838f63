"""Every task of the benchmark has a robot designed by hand that stands in it and is fit for it."""

from __future__ import annotations

import pytest
from lxml import etree

from aidsr.core.artifacts import ValidationReport
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.loop.run import create_run, make_brief, parts_of
from aidsr.loop.runner import run_designs
from aidsr.sim.assembly import assemble
from aidsr.tasks import TASKS_IN_SAMPLE, load_task
from aidsr.teams.baselines.reference import read_reference, team
from aidsr.validation import validate


@pytest.mark.parametrize("name", TASKS_IN_SAMPLE)
def test_it_stands_in_its_task_and_the_judge_finds_nothing_missing(name: str) -> None:
    task, hand = load_task(name), team()
    brief = task.brief()
    (concept,) = hand.designer.propose(brief, 1)
    robot, placement = hand.coder.write(brief, concept), hand.integrator.place(brief, concept, hand.coder)
    scene = assemble(robot, brief.environment, placement, task.sensors)
    verdict = hand.judge.judge(brief, concept, robot, scene, ValidationReport(stable=True))
    assert verdict.passed, verdict.issues
    actuators = {each.get("name") for each in etree.fromstring(robot.mjcf).find("actuator")}
    grouped = [actuator for group in robot.actuator_groups for actuator in group.actuators]
    assert set(grouped) <= actuators
    assert len(set(grouped)) == len(grouped)


@pytest.mark.slow
@pytest.mark.parametrize("name", TASKS_IN_SAMPLE)
def test_it_is_stable_at_both_levels(name: str) -> None:
    found, robot = read_reference(name)
    for level in ("standard", "hard"):
        task = load_task(name, level)
        scene = assemble(robot, task.brief().environment, found.placement, task.sensors)
        report = validate(scene.mjcf, needs_contact=task.needs_contact)
        assert report.stable, report.account()


def test_no_two_robots_are_the_same() -> None:
    assert len({read_reference(name)[1].mjcf for name in TASKS_IN_SAMPLE}) == len(TASKS_IN_SAMPLE)


def test_a_task_of_ones_own_has_none() -> None:
    with pytest.raises(UserError, match="no reference robot for"):
        read_reference("own/task")
    with pytest.raises(UserError, match="set concepts to 1"):
        team().designer.propose(load_task("gap").brief(), 3)


def test_it_goes_through_the_same_loop(tmp_path) -> None:
    config = RunConfig(model="reference", concepts=1, iterations=0)
    run = create_run(make_brief(task="gap"), config, level="standard", runs=tmp_path)
    run_designs(run, parts_of(run))
    assert run.design(1).outcome.read().outcome == "approved"
    assert run.design(1).final_robot.read().decode() == read_reference("gap")[1].mjcf
