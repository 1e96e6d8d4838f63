"""`aidsr train` and `aidsr evaluate`, as a person types them."""

import io
import json
import shlex
import shutil
from collections.abc import Callable
from contextlib import ExitStack, redirect_stdout
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

from test_training import SMALL

from aidsr.api import find_scene
from aidsr.apps.cli import main
from aidsr.apps.cli.training import train_designs
from aidsr.core.artifacts import ActuatorGroup, Evaluation, Outcome, Robot
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.learn.rl import isolated_learning, training
from aidsr.learn.rl.isolated_learning import run_training
from aidsr.learn.rl.trained import FinishedTraining
from aidsr.learn.rl.training_config import TrainingConfig
from aidsr.learn.rl.training_folder import FolderInUseError, TrainingFolder
from aidsr.runs.folders import DesignFolder, Run, new_run
from aidsr.runs.record import RunRecord
from aidsr.tasks import load_task
from scenes import small_arm, small_scene

EASY = ("--threads", "1", "--no-videos")
QUICK = ("--steps", "64", *EASY)
TWICE = "1024"
"""Control steps of a training with two updates, so that it is told of before it is over."""


def run_main(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return ended.value.code


class Impatient(io.StringIO):
    """The terminal of somebody who presses Control-C when a text has come so often."""

    def __init__(self, text: str, times: int) -> None:
        super().__init__()
        self.text, self.times, self.pressed = text, times, False

    def write(self, said: str) -> int:
        written = super().write(said)
        if not self.pressed and self.getvalue().count(self.text) >= self.times:
            self.pressed = True
            raise KeyboardInterrupt
        return written


def interrupted(command: Callable[[], int], text: str, times: int = 1) -> str:
    """Interrupt a command at a text, and return all that it said."""
    with redirect_stdout(Impatient(text, times)) as terminal:
        assert command() == 130
    return terminal.getvalue()


def win(folder: Path) -> None:
    """Write the verdict of a training anew, as one that is valid and successful."""
    verdict = json.loads((folder / "evaluation.json").read_text())
    for episode in verdict["episodes"]:
        episode["ended"] = "succeeded"
    for check in verdict["checks"]:
        check["passed"] = True
    (folder / "evaluation.json").write_text(json.dumps(verdict))


def kinds_of(folder: Path) -> list[str]:
    return [json.loads(line)["kind"] for line in (folder / "events.jsonl").read_text().splitlines()]


@pytest.fixture
def design(tmp_path) -> Path:
    """The folder of an approved design for the catching task, as far as training looks at it."""
    record = RunRecord(
        objective="catch",
        task="grasping/dynamic_catching",
        level="hard",
        config=RunConfig(),
        started="2026-01-31T10:02:00+00:00",
        versions={},
    )
    run = new_run(tmp_path / "runs", record, load_task("dynamic_catching").brief())
    design = run.design(1)
    group = ActuatorGroup(name="both", actuators=("pull_left", "pull_right"))
    design.iteration(1).robot.write(Robot(mjcf=small_arm(), functional_part="tip", actuator_groups=(group,)))
    design.final_scene.write(small_scene("dynamic_catching").encode())
    return design.path


def test_a_design_is_what_was_approved_and_not_what_was_tried_after_it(design):
    folder = DesignFolder(design)
    folder.iteration(2).robot.write(Robot(mjcf=small_arm(), functional_part="tip"))
    assert find_scene(design).groups == ()
    folder.outcome.write(Outcome(outcome="approved", reason="It came farthest.", iteration=1))
    assert [group.name for group in find_scene(design).groups] == ["both"]


def test_smoothing_that_would_never_move_is_refused(design, capsys):
    assert run_main("train", design, *QUICK, "--smoothing", "1") == 2
    assert "Must be < 1" in capsys.readouterr().err


def test_seeds_become_numbered_trainings_with_a_verdict_each(tmp_path, capsys, monkeypatch):
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
    assert "0% (0 of 100; 0% to 4%)" in told
    again = ("evaluate", out / "002", "--no-videos", "--json", "--threads", "1", "--episodes")
    assert run_main(*again, "21") == 2  # the verdict that is there says more
    assert "100" in capsys.readouterr().err
    assert run_main(*again, "101") == 1
    verdict = Evaluation.model_validate_json(capsys.readouterr().out)
    assert (verdict.task, len(verdict.episodes)) == ("grasping/dynamic_catching", 101)
    win(out / "001")
    assert run_main(*words) == 0
    won = Evaluation.model_validate_json((out / "001" / "evaluation.json").read_text())
    monkeypatch.setattr(isolated_learning, "run_evaluation", lambda *_, **__: won)
    assert run_main(*again, "101") == 0


def test_what_is_asked_of_a_training_and_what_its_design_says_are_kept_with_it(design, capsys):
    first, second = design / "training" / "001", design / "training" / "002"
    words = ("train", design, *QUICK, "--no-evaluate", "--first-seed", "5")
    assert run_main(*words, "--grouping", "off", "--tensorboard", "--smoothing", "0.7") == 0
    config = TrainingFolder(first).read("config.json", TrainingConfig)
    assert (config.seed, config.recipe.from_probe, config.recipe.smoothing) == (5, True, 0.7)
    assert [group.actuators for group in config.groups] == [("robot/pull_left",), ("robot/pull_right",)]
    assert any((first / "tensorboard").rglob("events.*"))
    capsys.readouterr()
    assert run_main(*words, "--protocol", "paper", "--from-probe") == 0
    assert "grasping/dynamic_catching: 2 actuators in 1 actions" in capsys.readouterr().out
    config = TrainingFolder(second).read("config.json", TrainingConfig)
    assert (config.task, config.level) == ("grasping/dynamic_catching", "hard")
    assert (config.recipe.from_probe, [group.name for group in config.groups]) == (True, ["both"])
    assert not (second / "tensorboard").exists()


def script_of(training: Path) -> str:
    return TrainingFolder(training).read("config.json", TrainingConfig).recipe.script


def test_a_policy_begins_with_the_script_of_its_design(design, tmp_path, capsys):
    first = DesignFolder(design).iteration(1)
    robot = first.robot.read()
    (design / "01" / "robot.json").unlink()
    first.robot.write(robot.model_copy(update={"script": "both: 0.5"}))
    other = tmp_path / "other.txt"
    other.write_text("both: t=0 -1, t=1 1\n")
    words = ("train", design, *QUICK, "--no-evaluate")
    home = design / "training"
    assert run_main(*words) == 0
    assert "starts from the script of the design's author" in capsys.readouterr().out
    assert run_main(*words, "--script", "none") == 0
    assert run_main(*words, "--script", other) == 0
    assert [script_of(home / number) for number in ("001", "002", "003")] == ["both: 0.5", "", other.read_text()]
    assert run_main(*words, "--protocol", "paper") == 0, "which begins with nothing"
    assert script_of(home / "004") == ""
    assert find_scene(design, level="standard").script == "", "another job"
    assert find_scene(design, "dynamic_catching", level="hard").script == "both: 0.5"


@pytest.mark.parametrize(("inside", "given"), [("", "."), ("..", "1"), ("../..", "designs/1")])
def test_a_design_is_found_from_inside_its_run(design, monkeypatch, capsys, inside, given):
    first = DesignFolder(design).iteration(1)
    robot = first.robot.read()
    (design / "01" / "robot.json").unlink()
    first.robot.write(robot.model_copy(update={"script": "both: 0.5"}))
    monkeypatch.chdir(design / inside)
    found = find_scene(given, "dynamic_catching", level="hard")
    assert (found.task, found.level, found.script) == ("dynamic_catching", "hard", "both: 0.5")
    assert find_scene(given).task == "grasping/dynamic_catching"
    assert DesignFolder(Path(given)).run.record.read().level == "hard"
    assert run_main("show", given) == 0
    assert "catch" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (None, "script not found: "),
        ("both", 'motion.txt is no script: line 1 of the script has no group: "both"'),
        ("wheel: 1", 'no group "wheel" in this scene'),
    ],
)
def test_what_is_no_script_of_the_design_is_refused(design, tmp_path, capsys, text, sentence):
    if text is not None:
        (tmp_path / "motion.txt").write_text(text)
    assert run_main("train", design, *QUICK, "--script", tmp_path / "motion.txt") == 2
    assert sentence in capsys.readouterr().err
    assert not list(design.glob("training/*/config.json"))


def test_the_same_command_goes_on_whatever_it_was_at(tmp_path, capsys):
    """While the second policy learned, before it was judged, while its verdict was told."""
    scene, out = tmp_path / "scene.xml", tmp_path / "learned"
    scene.write_text(small_scene("dynamic_catching"))
    words = ("train", scene, "--task", "dynamic_catching", "--out", out, *EASY, "--seeds", "2", "--steps", TWICE)
    for text, times in (("seed 1: ", 1), (f"{out / '002'}: ", 1), ("(0 of 100; ", 2)):
        assert "Progress is kept; repeat the same command to continue" in interrupted(
            lambda: run_main(*words), text, times
        )
    assert run_main(*words) == 1
    told = capsys.readouterr().out
    assert told.count("already trained") == told.count("(0 of 100; ") == 2
    assert [path.name for path in sorted(out.iterdir())] == ["001", "002"]
    for folder in out.iterdir():
        assert [kinds_of(folder).count(kind) for kind in ("started", "finished", "evaluated")] == [1, 1, 1]


def test_what_was_trained_already_is_trained_again_only_when_asked_for(design, capsys):
    words, home = ("train", design, *EASY, "--steps", TWICE, "--no-evaluate"), design / "training"
    assert run_main(*words) == 0
    assert "repeat the same command without --again" in interrupted(lambda: run_main(*words, "--again"), "seed 0: ")
    assert kinds_of(home / "002") == ["started", "checkpoint"]
    assert run_main(*words) == 0
    assert kinds_of(home / "002")[-1] == "finished"
    assert [path.name for path in sorted(home.iterdir())] == ["001", "002"]


def test_each_of_several_commands_takes_a_folder_of_its_own(tmp_path, monkeypatch):
    """Where another process takes a number just before this one does; and one is told where it does the very same."""
    learn = training.train
    tries, others = [], ExitStack()

    def just_after_another(learning, folder, **options):
        tries.append((folder.name, options["seed"]))
        if folder.name == "001":
            learn(learning, folder, **options | {"seed": 7})
        elif folder.name in {"002", "004"}:
            others.enter_context(TrainingFolder(folder).locked())
            if folder.name == "004":
                shutil.copy(tmp_path / "003" / "config.json", folder)
                config = TrainingFolder(folder).read_json("config.json")
                TrainingFolder(folder).write_json("config.json", config | {"seed": 2})
        return learn(learning, folder, **options)

    monkeypatch.setattr(training, "train", just_after_another)
    scene = (small_scene("dynamic_catching"), "dynamic_catching", "standard", (), "auto")
    how = (SMALL, None, 1, False, False, lambda _point: None)
    with others:
        run_training(*scene, tmp_path, "", 64, 1, *how)
        with pytest.raises(FolderInUseError, match=r"another process trains, judges or films in .*004; wait"):
            run_training(*scene, tmp_path, "", 64, 2, *how)
    assert tries == [("001", 1), ("002", 1), ("003", 1), ("004", 2)]
    seeds = {path.parent.name: json.loads(path.read_text())["seed"] for path in tmp_path.glob("*/config.json")}
    assert seeds == {"001": 7, "003": 1, "004": 2}


def test_an_interrupted_training_of_a_run_names_the_commands_that_go_on(design):
    run = Run(design.parent.parent)
    run.design(2).final_scene.write(small_scene("dynamic_catching").encode())
    for one in run.designs:
        one.outcome.write(Outcome(outcome="approved", reason="good", iteration=1))
    told = interrupted(lambda: train_designs(run, steps=int(TWICE), seeds=1), "seed 0: ")
    commands = [line.strip() for line in told.splitlines() if line.startswith("  aidsr")]
    assert commands == [f"aidsr train {one.path} --steps {TWICE} --seeds 1" for one in run.designs]
    assert "same command" not in told
    assert run_main(*shlex.split(commands[0])[1:], "--no-evaluate") == 0
    assert [path.name for path in (design / "training").iterdir()] == ["001"]
    assert kinds_of(design / "training" / "001")[-1] == "finished"


def test_a_run_is_trained_with_success_where_one_of_its_designs_is(design, capsys):
    run = Run(design.parent.parent)
    run.design(1).outcome.write(Outcome(outcome="approved", reason="good", iteration=1))
    assert run_main("train", design, *QUICK) == 1
    shutil.copytree(design, run.design(2).path)  # trained as the first was
    summary = run.path / "summary.html"
    assert train_designs(run, steps=64, seeds=1) == 1
    assert "valid and successful" not in summary.read_text()
    win(design / "training" / "001")
    capsys.readouterr()
    assert train_designs(run, steps=64, seeds=1) == 0
    assert "valid and successful" in summary.read_text()
    assert "design 2" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["train", "scene.xml"], "has no task; name one"),
        (["train", "nowhere.xml", "--task", "button_pushing"], "nowhere.xml"),
        (["train", "scene.xml", "--task", "flat_ground"], "ground, lane missing"),
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


def test_a_folder_of_trainings_names_the_last_of_them(tmp_path: Path) -> None:
    (tmp_path / "training" / "002").mkdir(parents=True)
    (tmp_path / "training" / "002" / "training.json").touch()
    for folder in (tmp_path, tmp_path / "training"):
        with pytest.raises(UserError, match=r"Name one of its trainings: .*training/002$"):
            FinishedTraining.load(folder)
    with pytest.raises(UserError, match=r"Train first, with aidsr train$"):
        FinishedTraining.load(tmp_path / "elsewhere")
