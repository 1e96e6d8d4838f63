"""`aidsr probe`, as a person types it."""

import json

import numpy as np
import pytest
from PIL import Image

from aidsr.apps.cli import main
from aidsr.core.artifacts import ActuatorGroup, Robot
from aidsr.core.config import RunConfig
from aidsr.learn.openloop import ProbeReport
from aidsr.render.pictures import gl_status
from aidsr.runs import Run, RunRecord
from scenes import small_arm, small_scene

QUICK = ("--candidates", "16", "--variations", "1", "--threads", "1")


def run_main(*words: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return ended.value.code


def test_a_design_knows_its_task_and_keeps_the_report(tmp_path, capsys):
    run = Run(tmp_path)
    run.record.write(
        RunRecord(
            objective="catch",
            task="grasping/dynamic_catching",
            level="hard",
            config=RunConfig(),
            started="",
            versions={},
        )
    )
    design = run.design(1)
    design.final_scene.write(small_scene("dynamic_catching").encode())
    for _ in range(2):  # a later probe takes the place of the first
        assert run_main("probe", design.path, *QUICK) == 1
    told = capsys.readouterr().out
    assert "0 of 1 variations solved; best single motion solves 0 of 1" in told
    assert "\n1 of 1: " in told
    report = ProbeReport.model_validate_json((design.path / "probe.json").read_text())
    assert (report.task, report.level, report.candidates) == ("grasping/dynamic_catching", "hard", 16)
    strip = Image.open(design.path / "probe.png")
    assert strip.width > 4 * strip.height, "moments side by side"
    first, last = (
        np.asarray(strip.crop((x, 0, x + strip.height, strip.height))) for x in (0, strip.width - strip.height)
    )
    assert (first != last).any(), "the body has moved"


def test_a_film_is_a_video_of_the_whole_motion(tmp_path):
    av = pytest.importorskip("av")
    if "no videos" in gl_status():
        pytest.skip(gl_status())
    scene = tmp_path / "scene.xml"
    scene.write_text(small_scene("dynamic_catching"))
    run_main("probe", scene, "--task", "dynamic_catching", *QUICK, "--out", tmp_path / "found.json", "--film")
    report = ProbeReport.model_validate_json((tmp_path / "found.json").read_text())
    with av.open(str(tmp_path / "found.mp4")) as film:
        (stream,) = film.streams.video
        frames = [frame.to_ndarray(format="rgb24").astype(int) for frame in film.decode(stream)]
        rate = float(stream.average_rate)
    # the start, and one frame for each control step
    assert len(frames) == pytest.approx(report.best.episode.time_s * rate + 1, abs=1)
    assert np.abs(frames[-1] - frames[0]).max() > 50, "it moves"


def test_what_is_asked_for_is_passed_on(tmp_path, capsys):
    design = Run(tmp_path).design(1)
    design.final_scene.write(small_scene("dynamic_catching").encode())
    both = ActuatorGroup(name="both", actuators=("pull_left", "pull_right"))
    design.iteration(1).robot.write(Robot(mjcf=small_arm(), functional_part="tip", actuator_groups=(both,)))

    def found(*words: object) -> ProbeReport:
        run_main("probe", design.path, "--task", "dynamic_catching", *QUICK, "--max-steps", "6000", *words, "--json")
        said = capsys.readouterr()
        return ProbeReport.model_validate_json(said.out)

    plain, asked = found(), found("--seed", "3", "--level", "hard", "--grouping", "off")
    assert (plain.seed, plain.level, plain.max_steps) == (0, "standard", 6000)
    assert [group.group for group in plain.best.motion.groups] == ["both"]
    assert (asked.seed, asked.level, len(asked.best.motion.groups)) == (3, "hard", 2)


def test_motions_come_in_generations_of_sixteen_and_fewer_are_refused_at_once(capsys):
    run_main("probe", "--help")
    assert "in whole generations of 16" in " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert run_main("probe", "nowhere.xml", "--candidates", "15") == 2
    assert "Must be >= 16" in capsys.readouterr().err


def test_a_scene_gives_json_and_leaves_nothing_unless_asked(tmp_path, capsys):
    scene = tmp_path / "scene.xml"
    scene.write_text(small_scene("dynamic_catching"))
    words = ("probe", scene, "--task", "dynamic_catching", *QUICK)
    assert run_main(*words, "--json") == 1
    assert json.loads(capsys.readouterr().out)["success_share"] == 0.0
    assert [path.name for path in tmp_path.iterdir()] == ["scene.xml"]
    (tmp_path / "new").mkdir()
    assert run_main(*words, "--out", tmp_path / "new" / "found.json") == 1
    assert ProbeReport.model_validate_json((tmp_path / "new" / "found.json").read_text()).level == "standard"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["scene.xml"], "has no task; name one"),
        (["nowhere.xml", "--task", "button_pushing"], "nowhere.xml"),
        (["scene.xml", "--task", "buton_pushing"], "did you mean"),
        (["."], "final.xml"),
    ],
)
def test_mistakes_are_one_sentence_and_exit_2(words, sentence, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.xml").write_text(small_scene())
    assert run_main("probe", *words) == 2
    told = capsys.readouterr()
    assert sentence in told.err
    assert told.err.count("\n") == 1


@pytest.mark.parametrize("command", ["probe", "train"])
def test_an_environment_without_a_robot_is_a_mistake_in_the_command(command, tmp_path, capsys):
    if command == "train":
        pytest.importorskip("stable_baselines3")
    scene, goal = tmp_path / "lever.xml", tmp_path / "goal.toml"
    scene.write_text(
        '<mujoco><worldbody><site name="mount"/><body name="lever" pos="0.1 0 0"><joint name="hinge" axis="0 1 0"/>'
        '<geom size="0.01"/></body></worldbody></mujoco>'
    )
    goal.write_text('kind = "turn"\njoint = "hinge"\nby_deg = 20\n')
    assert run_main(command, scene, "--goal", goal) == 2
    told = capsys.readouterr().err
    assert "the scene holds no robot" in told
    assert "functional_part" not in told
