"""The examples: each is an environment with a goal that can be met in it, and some are templates."""

import itertools
import shlex
import subprocess
import sys
from importlib import import_module

import mujoco
import numpy as np
import pytest

from aidsr.apps.cli import main
from aidsr.core.errors import UserError
from aidsr.examples import examples, templates
from aidsr.tasks import goal_task, parse_goal
from aidsr.tasks.goals import KINDS


@pytest.mark.parametrize("name", examples())
def test_an_example_is_an_environment_with_its_goal(name):
    example = examples()[name]
    task = goal_task(parse_goal(example.goal), example.environment)
    brief = task.brief()
    assert brief.summary.mounts or task.base == "free"
    assert example.objective.endswith(".")
    assert example.title
    assert "Nothing" not in task.judging()["Episodes differ"] or name in ("walk", "trace")


@pytest.mark.parametrize("name", [name for name, one in examples().items() if parse_goal(one.goal).kind == "turn"])
def test_what_is_to_be_turned_meets_nothing_on_its_way(name):
    example = examples()[name]
    goal = parse_goal(example.goal)
    for x, y in itertools.product((-1, 0, 1), repeat=2):
        model = mujoco.MjModel.from_xml_string(example.environment)
        data = mujoco.MjData(model)
        joint = model.joint(goal.joint)
        vary = goal.vary_m or (0.0, 0.0, 0.0)
        model.body_pos[model.jnt_bodyid[joint.id]][:2] += (x * vary[0], y * vary[1])
        for angle in np.linspace(0.0, np.deg2rad(goal.by_deg), 60):
            data.qpos[joint.qposadr] = model.qpos0[joint.qposadr] + angle
            mujoco.mj_forward(model, data)
            assert not any(contact.dist < 0 for contact in data.contact), f"{np.rad2deg(angle):.0f} degrees"


def test_the_examples_show_every_kind_of_goal():
    shown = {parse_goal(example.goal).kind for example in examples().values()}
    assert shown == set(KINDS)


def test_there_is_a_template_for_each_kind_of_job():
    assert set(templates()) == {"touch", "grasp", "carry", "turn", "crawl"}
    assert parse_goal(templates()["touch"].goal).kind == "touch"
    for example in templates().values():
        lines = example.goal.splitlines()
        assert all("#" in line for line in lines if line.strip()), "each key of a template is explained"


def call(*words):
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return ended.value.code


def test_new_prints_commands_that_can_be_pasted(tmp_path, capsys):
    place = tmp_path / "my [job]"
    assert call("new", place) == 0
    (check,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("  aidsr check"))
    assert shlex.split(check)[2:] == [str(place / "environment.xml"), str(place / "goal.toml")]


@pytest.mark.parametrize("like", ["touch", "grasp", "carry", "turn", "crawl"])
def test_new_writes_what_can_be_designed_for(tmp_path, like, capsys):
    place = tmp_path / "my job"
    assert call("new", place, "--like", like) == 0
    assert "aidsr check" in capsys.readouterr().out
    assert {path.name for path in place.iterdir()} == {"environment.xml", "goal.toml", "check.py"}
    text = (place / "environment.xml").read_text()
    assert '<mujoco model="my job">' in text
    goal_task(parse_goal((place / "goal.toml").read_text()), text)
    compile((place / "check.py").read_text(), "check.py", "exec")
    assert call("new", place) == 2
    assert "exists already" in capsys.readouterr().err
    assert call("new", tmp_path / "nowhere" / "job") == 2
    assert "does not exist" in capsys.readouterr().err


@pytest.mark.slow
def test_check_tells_and_draws_what_is_there(tmp_path, capsys):
    assert call("new", tmp_path / "bell") == 0
    code = call("check", tmp_path / "bell" / "environment.xml", tmp_path / "bell" / "goal.toml")
    said = " ".join(capsys.readouterr().out.split())
    assert code == 0, said
    assert "Mount: mount at (0, 0, 0.5) m, pointing along (0, 0, -1); the place of work is 0.256 m away, 31 deg" in said
    assert "No actions: 0 of 5 episodes succeed" in said
    assert "A built-in robot" in said
    for name in ("check.png", "check_motion.png"):
        assert (tmp_path / "bell" / name).read_bytes().startswith(b"\x89PNG")


def test_check_leaves_no_motion_of_an_earlier_one_where_no_body_could_be_placed(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(import_module("aidsr.teams.fitting.team"), "overlaps", lambda _scene: True)
    assert call("new", tmp_path / "bell") == 0
    environment = tmp_path / "bell" / "environment.xml"
    (tmp_path / "bell" / "check_motion.png").write_bytes(b"of an earlier check")
    assert call("check", environment, tmp_path / "bell" / "goal.toml") == 1
    assert "No built-in robot could be placed" in " ".join(capsys.readouterr().out.split())
    assert (tmp_path / "bell" / "check.png").exists()
    assert not (tmp_path / "bell" / "check_motion.png").exists()


def test_check_says_what_is_known_before_it_tries_bodies(tmp_path, capsys, monkeypatch):
    def stop(*_words, **_names):
        raise UserError("stopped")

    assert call("new", tmp_path / "bell") == 0
    monkeypatch.setattr(import_module("aidsr.teams.fitting.check"), "FittingDesigner", stop)
    capsys.readouterr()
    assert call("check", tmp_path / "bell" / "environment.xml", tmp_path / "bell" / "goal.toml") == 2
    said = " ".join(capsys.readouterr().out.split())
    assert "Success: " in said
    assert "the place of work is 0.256 m away" in said


def test_check_refuses_millimetres_at_once(tmp_path, capsys):
    assert call("new", tmp_path / "bell") == 0
    environment = tmp_path / "bell" / "environment.xml"
    environment.write_text(environment.read_text().replace('name="mount" pos="0 0 0.5"', 'name="mount" pos="0 0 500"'))
    assert call("check", environment, tmp_path / "bell" / "goal.toml") == 1
    assert "are these millimetres?" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(("mount", "code"), [("mount", 0), ("monut", 1)])
def test_check_describes_an_environment_without_a_goal(tmp_path, capsys, mount, code):
    assert call("new", tmp_path / "bell") == 0
    environment = tmp_path / "bell" / "environment.xml"
    environment.write_text(environment.read_text().replace('name="mount"', f'name="{mount}"'))
    capsys.readouterr()
    assert call("check", environment) == code
    said = " ".join(capsys.readouterr().out.split())
    assert f"Mount: {mount} at" in said or "Mount: none" in said
    assert "Body: bell at" in said
    assert "write a goal" in said
    assert ('did you mean "monut"?' in said) == (code == 1)
    assert (tmp_path / "bell" / "check.png").exists()


@pytest.mark.slow
def test_check_says_where_a_goal_is_met_by_doing_nothing(tmp_path, capsys):
    assert call("new", tmp_path / "easy") == 0
    goal = tmp_path / "easy" / "goal.toml"
    goal.write_text('kind = "reach"\ntarget = "bell"\nwithin_m = 0.4\nhold_s = 0.1\ntime_limit_s = 1\n')
    code = call("check", tmp_path / "easy" / "environment.xml", goal)
    assert code == 1
    assert "at rest wins 5 of 5 episodes: make the goal harder" in " ".join(capsys.readouterr().out.split())


def test_check_refuses_what_cannot_be_met(tmp_path, capsys):
    assert call("new", tmp_path / "knob", "--like", "turn") == 0
    goal = tmp_path / "knob" / "goal.toml"
    goal.write_text('kind = "turn"\njoint = "shaft"\nby_deg = 120\n')
    assert call("check", tmp_path / "knob" / "environment.xml", goal) == 2
    assert "cannot be turned by 120 deg" in capsys.readouterr().err


@pytest.mark.slow
def test_the_check_script_does_the_same(tmp_path):
    assert call("new", tmp_path / "bell") == 0
    done = subprocess.run([sys.executable, tmp_path / "bell" / "check.py"], capture_output=True, text=True, check=True)
    assert "Of 5 episodes, 0 succeed without actions, 0 with random actions." in done.stdout
    assert (tmp_path / "bell" / "check_motion.png").exists()
