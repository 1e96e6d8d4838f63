"""A policy is trained for a goal, and the goal is kept with it."""

import json

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

from aidsr.apps.cli import main
from aidsr.core.artifacts import Placement, Robot
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.examples import examples
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.trained import FinishedTraining, evaluate_training
from aidsr.learn.rl.training_config import TrainingConfig
from aidsr.runs import Run, RunRecord
from aidsr.runs.trainings import trainings_of, verdict_in_words, verdicts_of
from aidsr.sim.assembly import assemble
from aidsr.tasks import goal_task, parse_goal
from aidsr.tasks.goals import GOAL_VERSION
from scenes import small_arm

ROOM = """
<mujoco>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <site name="mount" pos="0 0 0.5" euler="180 0 0"/>
    <site name="spot" pos="0.1 0 0.3"/>
  </worldbody>
</mujoco>"""
GOAL = 'kind = "reach"\ntarget = "spot"\nhold_s = 0.1\ntime_limit_s = 0.4\nvary_m = [0.02, 0, 0.01]\n'


@pytest.fixture
def design(tmp_path):
    """An approved design for an objective in words, as far as training looks at it."""
    run = Run(tmp_path / "run")
    run.record.write(RunRecord(objective="reach", config=RunConfig(), started="", versions={}))
    arm = Robot(mjcf=small_arm(), functional_part="tip")
    scene = assemble(arm, ROOM, Placement(mount="mount", base="fixed"))
    run.design(1).final_scene.write(scene.mjcf.encode())
    return run.design(1)


def train(design, *words) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["train", str(design.path), "--steps", "64", "--threads", "1", "--no-videos", *map(str, words)])
    return ended.value.code


def test_a_design_without_a_goal_is_not_trained(design, capsys):
    assert train(design) == 2
    told = capsys.readouterr().err
    assert "has no measure of success; give a" in told
    assert told.count("\n") == 1


def test_a_goal_given_later_is_kept_with_the_training(design, tmp_path):
    (tmp_path / "mine.toml").write_text(GOAL)
    assert train(design, "--goal", tmp_path / "mine.toml", "--no-evaluate") == 0
    training = FinishedTraining.load(design.path / "training" / "001")
    assert training.scene.task.name == "goal/reach"
    assert training.scene.task.goal.vary_m == (0.02, 0.0, 0.01)


def test_what_was_trained_for_a_goal_of_an_earlier_meaning_is_refused_and_trained_anew(design, tmp_path):
    (tmp_path / "mine.toml").write_text(GOAL)
    words = ("--goal", tmp_path / "mine.toml", "--no-evaluate")
    assert train(design, *words) == 0
    config = design.path / "training" / "001" / "config.json"
    written = json.loads(config.read_text())
    assert written.pop("goal_version") == GOAL_VERSION
    config.write_text(json.dumps(written))
    with pytest.raises(UserError, match="trained for goals as an earlier version measured them"):
        FinishedTraining.load(config.parent)
    assert train(design, *words) == 0
    assert FinishedTraining.load(design.path / "training" / "002").config.goal_version == GOAL_VERSION


def test_a_run_with_a_goal_knows_it(design):
    Run(design.path.parent.parent).goal.write(GOAL.encode())
    assert train(design, "--no-evaluate") == 0
    assert FinishedTraining.load(design.path / "training" / "001").config.goal.target == "spot"


@pytest.mark.parametrize("given", [True, False])
def test_a_goal_has_no_levels(design, tmp_path, capsys, given):
    """Neither one that is given nor one that the run holds."""
    goal = tmp_path / "mine.toml" if given else Run(design.path.parent.parent).goal.path
    goal.write_text(GOAL)
    assert train(design, "--level", "hard", *(("--goal", goal) if given else ())) == 2
    told = capsys.readouterr().err
    assert "a level requires a task" in told
    assert told.count("\n") == 1


def test_results_for_another_goal_are_not_those_of_the_design(design, tmp_path):
    Run(design.path.parent.parent).goal.write(GOAL.encode())
    (tmp_path / "easy.toml").write_text(GOAL.replace("hold_s = 0.1", "hold_s = 0.05\nwithin_m = 5.0"))
    assert train(design, "--no-evaluate") == 0
    assert train(design, "--no-evaluate", "--goal", tmp_path / "easy.toml") == 0
    own, other = trainings_of(design)
    for training in (own, other):
        evaluate_training(training.path, episodes=20, threads=1, videos=False)
    assert other.evaluation.read().success_share == 1.0
    assert [verdict.success_share for verdict in verdicts_of(design)] == [own.evaluation.read().success_share]
    assert verdict_in_words(own).startswith("training 001: ")
    assert verdict_in_words(other).startswith("training 002, for the goal reach spot: ")
    Run(design.path.parent.parent).goal.path.unlink()
    assert len(verdicts_of(design)) == 2, "an objective in words has no measure of its own"


def test_either_a_task_or_a_goal(design, tmp_path, capsys):
    assert train(design, "--goal", tmp_path / "mine.toml", "--task", "button_pushing") == 2
    assert "both a task and a goal given" in capsys.readouterr().err


THERE_AND_AWAY = """
kind = "stages"
base = "free"
vary_m = [0.01, 0, 0]
time_limit_s = 1.0
[[stages]]
kind = "reach"
target = "spot"
[[stages]]
kind = "travel"
distance_m = 0.01
[[limits]]
kind = "speed"
at_most_m_s = 3.0
"""


@pytest.mark.parametrize("goal", [*(pytest.param(one, id=name) for name, one in examples().items()), THERE_AND_AWAY])
def test_a_goal_is_the_same_after_it_was_written_and_read(goal):
    """The examples have every kind of goal."""
    text, room = (goal, ROOM) if isinstance(goal, str) else (goal.goal, goal.environment)
    scene = TaskScene.of(
        assemble(Robot(mjcf=small_arm(), functional_part="tip"), ROOM, Placement(mount="mount", base="fixed")).mjcf,
        goal_task(parse_goal(GOAL), ROOM),
    )
    config = TrainingConfig.of(scene, steps=64, seed=0).model_copy(
        update={"goal": goal_task(parse_goal(text), room).goal}
    )
    again = TrainingConfig.model_validate_json(config.model_dump_json(indent=2))
    assert again.differences(config) == config.differences(again) == []
    assert goal_task(again.goal, room).goal == config.goal


def test_a_finished_training_for_a_goal_in_stages_is_recognized(design, tmp_path, capsys):
    (tmp_path / "mine.toml").write_text(THERE_AND_AWAY.replace('base = "free"\n', ""))
    for _ in range(2):
        assert train(design, "--goal", tmp_path / "mine.toml", "--no-evaluate") == 0
    assert FinishedTraining.load(design.path / "training" / "001").scene.task.name == "goal/stages"
    assert not (design.path / "training" / "002").exists()
