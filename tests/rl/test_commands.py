"""`aidsr train` and `aidsr evaluate`, as a person types them."""

import json
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

from aidsr.artifacts import ActuatorGroup, Evaluation, Robot
from aidsr.cli import main
from aidsr.rl.files import TrainingConfig
from aidsr.runs import RunConfig
from aidsr.runs.folders import Run
from aidsr.runs.record import RunRecord
from scenes import small_arm, small_scene

QUICK = ("--steps", "64", "--threads", "1", "--no-videos")


def run_main(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return ended.value.code


@pytest.fixture
def design(tmp_path) -> Path:
    """The folder of an approved design for the catching task, as far as training looks at it."""
    run = Run(tmp_path / "run")
    record = RunRecord(
        objective="catch", task="grasping/dynamic_catching", level="hard", config=RunConfig(), started="", versions={}
    )
    run.record.write(record)
    design = run.design(1)
    group = ActuatorGroup(name="both", actuators=("pull_left", "pull_right"))
    design.iteration(1).robot.write(Robot(mjcf=small_arm(), functional_part="tip", actuator_groups=(group,)))
    design.final_scene.write(small_scene("dynamic_catching").encode())
    return design.path


def test_a_design_knows_its_task_its_level_and_its_groups(design, capsys):
    assert run_main("train", design, *QUICK, "--no-evaluate") == 0
    told = capsys.readouterr().out
    assert "grasping/dynamic_catching: 2 actuators in 1 actions" in told
    config = TrainingConfig.model_validate_json((design / "training" / "001" / "config.json").read_text())
    assert (config.task, config.level) == ("grasping/dynamic_catching", "hard")
    assert [group.name for group in config.groups] == ["both"]


def test_smoothing_of_actions_is_asked_for_and_kept(design, capsys):
    assert run_main("train", design, *QUICK, "--no-evaluate", "--smoothing", "0.7") == 0
    config = TrainingConfig.model_validate_json((design / "training" / "001" / "config.json").read_text())
    assert config.recipe.smoothing == 0.7
    assert run_main("train", design, *QUICK, "--smoothing", "1") == 2
    assert "Must be < 1" in capsys.readouterr().err


def test_seeds_become_numbered_trainings_with_a_verdict_each(tmp_path, capsys):
    scene = tmp_path / "scene.xml"
    scene.write_text(small_scene("dynamic_catching"))
    out = tmp_path / "learned"
    words = ("train", scene, "--task", "dynamic_catching", "--out", out, "--seeds", "2", *QUICK)
    assert run_main(*words) == 1
    told = capsys.readouterr().out
    assert [path.name for path in sorted(out.iterdir())] == ["001", "002"]
    for number, folder in enumerate(sorted(out.iterdir())):
        assert json.loads((folder / "config.json").read_text())["seed"] == number
        assert not Evaluation.model_validate_json((folder / "evaluation.json").read_text()).successful
        assert str(folder) in told
    assert "0% (0 of 20)" in told
    assert run_main("evaluate", out / "002", "--no-videos", "--json", "--threads", "1") == 1
    assert Evaluation.model_validate_json(capsys.readouterr().out).task == "grasping/dynamic_catching"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["train", "scene.xml"], "--task"),
        (["train", "nowhere.xml", "--task", "button_pushing"], "nowhere.xml"),
        (["train", "scene.xml", "--task", "flat_ground"], "lacks ground, lane"),
        (["train", "."], "final.xml"),
        (["evaluate", "."], "config.json"),
    ],
)
def test_mistakes_are_one_sentence_and_exit_2(words, sentence, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.xml").write_text(small_scene())
    assert run_main(*words) == 2
    told = capsys.readouterr()
    assert sentence in told.err
    assert told.err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["scene.xml"]


def test_an_objective_in_words_cannot_be_trained_without_a_task(design, capsys):
    record = design.parent.parent / "run.json"
    record.write_text(record.read_text().replace("grasping/dynamic_catching", ""))
    assert run_main("train", design) == 2
    assert "no measure of success" in capsys.readouterr().err
