"""A Judge that is shown pictures: which, and who may be asked for that."""

import base64
import json
from dataclasses import replace
from pathlib import Path

import pytest
from test_language_model_runs import Provider

from aidsr.core.artifacts import ValidationReport
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.examples import examples
from aidsr.loop.run import create_run, make_brief, parts_of
from aidsr.loop.runner import run_designs
from aidsr.loop.scene_pictures import motion_view
from aidsr.runs import read_status
from aidsr.tasks import goal_task, load_task, parse_goal
from aidsr.tasks.targets import targets_of
from loopback import Loopback, Received
from scripted import new_run


def judged(received: Received) -> bool:
    return "the Judge" in received.body["messages"][0]["content"]


def test_the_judge_sees_the_pictures_of_the_iteration_and_nobody_else_does(tmp_path: Path) -> None:
    brief = make_brief(task="button_pushing")
    with Loopback(Provider(working_for=100)) as server:
        config = RunConfig(model=f"loop@{server.url}/v1", concepts=1, judge_pictures=True)
        run = create_run(brief, config, level="standard", runs=tmp_path)
        run_designs(run, replace(parts_of(run), validate=lambda *_, **__: ValidationReport(stable=True)))
    assert read_status(run).approved == 1
    iteration = run.design(1).iteration(1)
    shown = [iteration.preview.read(), iteration.motion.read()]
    (call,) = [call for call in iteration.calls if call.question.role == "judge"]
    assert list(call.question.messages[-1].pictures) == shown
    for received in server.requests:
        sent = json.dumps(received.body)
        assert [base64.b64encode(png).decode() in sent for png in shown] == [judged(received)] * 2


def test_rules_see_no_pictures(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="rules cannot use pictures"):
        new_run(tmp_path, judge_pictures=True)


def test_the_picture_of_a_motion_shows_what_the_job_is_about(tmp_path: Path) -> None:
    valve = examples()["valve"]
    (tmp_path / "valve.toml").write_text(valve.goal)
    task = goal_task(parse_goal(valve.goal), valve.environment)
    brief = make_brief(task.objective, environment=valve.environment, goal=tmp_path / "valve.toml")
    with_goal = create_run(brief, RunConfig(), runs=tmp_path, goal=tmp_path / "valve.toml")
    with_task = create_run(make_brief(task="button_pushing"), RunConfig(), level="standard", runs=tmp_path)
    brief = make_brief("Reach out.", environment=valve.environment)
    with_words = create_run(brief, RunConfig(), runs=tmp_path)
    assert motion_view(with_goal).shown == targets_of(task)
    assert motion_view(with_task).shown == targets_of(load_task("button_pushing"))
    assert motion_view(with_words).shown == ()
    assert targets_of(task)
    assert parts_of(with_goal).filmstrip.keywords == {"view": motion_view(with_goal)}
