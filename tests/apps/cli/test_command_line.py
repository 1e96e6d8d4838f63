"""Commands as a person types them: exit codes, sentences, help."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from cyclopts import App, Argument

import aidsr.tasks
from aidsr.apps.cli import app, main
from aidsr.apps.cli.doctor import checks
from aidsr.apps.cli.view import model_of
from aidsr.core.artifacts import EpisodeResult, Outcome
from aidsr.core.config import Budget
from aidsr.core.errors import ModelError, UserError
from aidsr.learn.openloop.motion import Motion
from aidsr.learn.openloop.report import ProbedVariation, ProbeReport
from aidsr.loop.runner import run_designs
from aidsr.mjcf.read import SIZE_LIMITS
from aidsr.runs import layout_text
from scripted import Script, Scripted, new_run, parts

PLACE = str(Path(aidsr.tasks.__file__).with_name("reaching") / "button_pushing.xml")


def run_main(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(list(words))
    return ended.value.code


def test_an_objective_without_quotes_is_pointed_out(capsys) -> None:
    assert run_main("design", "press", "it") == 2
    assert "Unexpected words: it; put an objective in quotes" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["design"], "no task and no objective"),
        (["design", "press it"], "requires an environment"),
        (["design", "press it", "--environment", "nowhere.xml"], "nowhere.xml does not exist"),
        (["design", "--task", "no_such_task"], "no_such_task"),
        (["design", "press it", "--task", "button_pushing"], "has its own objective"),
        (["design", "--task", "button_pushing", "--model", "gpt"], "gpt"),
        (["design", "press it", "--environment", "nowhere.xml", "--train"], "--train requires a measure of success"),
        (["design", "press it", "--environment", "nowhere.xml", "--level", "hard"], "--level requires a task"),
        (
            ["design", "press it", "--environment", PLACE, "--task-feedback", "--dry-run"],
            "requires a measure of success",
        ),
        (
            ["design", "--task", "button_pushing", "--task-training", "9", "--dry-run"],
            "task_training requires task_feedback",
        ),
        (["design", "--task", "button_pushing", "--memory", "lessons.jsonl"], "the built-in rules do not use a memory"),
        (
            ["design", "--task", "button_pushing", "--memory", "nowhere.jsonl", "--model", "manual:desk", "--dry-run"],
            "the memory nowhere.jsonl does not exist",
        ),
        (["design", "--task", "button_pushing", "--text-tools"], "text_tools is for the measuring team"),
        (["evolve", "--task", "button_pushing", "--tool-calls", "9"], "tool_calls is for the measuring team"),
        (["design", "--task", "button_pushing", "--task-rounds", "3"], "task_rounds requires task_feedback"),
        (["show"], "no run given; give the folder of a run"),
        (["show", "."], ". is not a run folder: run.json not found; give the folder of a run, as runs/…"),
        (["view", PLACE, "--picture", "ball.gif"], "give a file name that ends in .png"),
        (["resume", "nowhere"], "run.json"),
        (["validate", "nowhere.xml"], "nowhere.xml"),
        (["view", "nowhere.xml"], "nowhere.xml"),
        (["view", PLACE, "--picture", "nowhere/ball.png"], "the folder nowhere does not exist"),
        (["show", PLACE], "button_pushing.xml is a file, not a run folder; give the folder of a run"),
        (["resume", PLACE], "button_pushing.xml is a file, not a run folder; give the folder of a run"),
        (["report", "nowhere"], "study.toml not found; give the folder of a study"),
        (["design", "--task", "gap", "--robot", aidsr.tasks.__file__], "is not MJCF: it has no element <mujoco>"),
        (["probe", PLACE, "--task", "button_pushing", "--out", "found.xml"], "--out found.xml is not a JSON file"),
        (["probe", PLACE, "--task", "button_pushing", "--out", "new/found.json"], "the folder new does not exist"),
        (["probe", PLACE, "--task", "button_pushing", "--film"], "--film writes beside the report"),
        (["train", PLACE, "--task", "button_pushing", "--minutes", "inf"], "for --minutes"),
        (["memory", "show", str(Path(PLACE).parent)], "is a folder; give the file of a memory"),
        (["mcp", "--folder", PLACE, "--config"], "button_pushing.xml is a file; give a folder"),
        (["design", "--concepts", "0"], 'Invalid value "0" for --concepts. Must be >= 1.'),
        (["nonsense"], 'Unknown command "nonsense"'),
    ],
)
def test_mistakes_are_one_sentence_and_exit_2(words, sentence, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_main(*words) == 2
    told = capsys.readouterr()
    assert sentence in told.err
    assert "Traceback" not in told.err
    assert told.err.count("\n") == 1
    assert told.out == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "words",
    [["nonsense"], ["design", "--concepts", "0"], ["design", "--concepts", "2.6"], ["design", "--level", "easy"]],
)
def test_what_cannot_be_parsed_exits_2(words, capsys) -> None:
    assert run_main(*words, *["--dry-run"] * (words[0] == "design")) == 2


def test_a_key_that_is_missing_is_named_before_a_folder_is_made(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    assert run_main("design", "--task", "button_pushing", "--model", "openai:gpt-5") == 2
    told = capsys.readouterr()
    assert "OPENAI_API_KEY" in told.err
    assert told.out == "", "the estimate of calls that cannot be made"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["design", "resume", "show", "tasks", "validate", "view", "doctor"])
def test_help_says_what_the_command_does_and_how_to_type_it(command, capsys) -> None:
    app([command, "--help"])
    said = capsys.readouterr().out
    assert f"aidsr {command}" in said.split("Usage")[1].split("\n", 1)[1], "an example"
    app(["--help"])
    assert command in capsys.readouterr().out


@pytest.mark.parametrize("command", ["design", "evolve", "benchmark"])
def test_help_names_only_options_that_the_command_has(command, capsys) -> None:
    app([command, "--help"])
    said = " ".join(capsys.readouterr().out.replace("│", " ").split())
    options = {name for one in app[command].assemble_argument_collection() for name in one.names}
    of_this_command = re.sub(r"aidsr (?!" + command + r")[a-z]+ --[a-z-]+", "", said)
    assert set(re.findall(r"--[a-z][a-z-]+", of_this_command)) - options == set()


def test_view_finds_the_model_of_a_design(tmp_path) -> None:
    run = new_run(tmp_path, concepts=3, iterations=1)
    scripts = [Script(), Script(robots=["chatter"]), Script(placements=["chatter"])]
    run_designs(run, parts(Scripted(scripts)))
    newest = [model_of(run.design(number).path).relative_to(run.path).as_posix() for number in (1, 2, 3)]
    assert newest == ["designs/1/final.xml", "designs/2/02/robot.xml", "designs/3/02/scene.xml"]
    assert model_of(run.design(1).iteration(1).path).name == "scene.xml"
    assert model_of(tmp_path / "any.xml") == tmp_path / "any.xml"
    with pytest.raises(UserError, match="this run has no design 9; it has: 1, 2, 3"):
        model_of(run.path / "designs" / "9")
    for nothing in (run.path, tmp_path):
        with pytest.raises(UserError, match=r"is a run, not a design|is not a design"):
            model_of(nothing)


@pytest.mark.parametrize("command", ["validate", "fix"])
def test_a_folder_is_no_mjcf_file(tmp_path, capsys, command) -> None:
    assert run_main(command, str(tmp_path)) == 2
    assert f"{tmp_path} is a folder, not an MJCF file; name a file" in capsys.readouterr().err
    (tmp_path / "final.xml").touch()
    assert run_main(command, str(tmp_path)) == 2
    assert f"for example {tmp_path / 'final.xml'}" in capsys.readouterr().err


def test_view_finds_the_newest_of_a_hundred_iterations(tmp_path) -> None:
    for name in ("02", "10", "99", "100"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "robot.xml").touch()
    assert model_of(tmp_path) == tmp_path / "100" / "robot.xml"


def test_resume_says_that_a_run_is_finished(tmp_path, capsys) -> None:
    for ended, told in (("invalid", True), ("out_of_budget", False)):
        run = new_run(tmp_path)
        run.concepts.write(())
        run.design(1).outcome.write(Outcome(outcome=ended, reason="made", iteration=1))
        assert run_main("resume", str(run.path)) == 1
        assert ("already finished" in capsys.readouterr().out) == told


def test_resume_replaces_only_the_limits_that_are_given(tmp_path) -> None:
    run = new_run(tmp_path, budget=Budget(tokens=60, cost_usd=1))
    run.concepts.write(())
    run.design(1).outcome.write(Outcome(outcome="invalid", reason="made", iteration=1))
    assert run_main("resume", str(run.path), "--max-cost", "2") == 1
    assert run.budget() == Budget(tokens=60, cost_usd=2)
    assert run_main("resume", str(run.path), "--max-tokens", "90") == 1
    assert run.budget() == Budget(tokens=90, cost_usd=2)


def options_of(command: App) -> Iterator[Argument]:
    for name in command:
        if name.startswith("-"):
            continue
        if command[name].default_command is None:
            yield from options_of(command[name])
        else:
            yield from (each for each in command[name].assemble_argument_collection(parse_docstring=True) if each.show)


def test_every_option_is_explained() -> None:
    options = list(options_of(app))
    assert len(options) > 100
    assert [each.name for each in options if not each.parameter.help] == []
    assert [each.name for each in options if each.show_default and each.field_info.default == ""] == []
    offered = [each for each in options if any(name.startswith("--no-") for name in each.names)]
    assert [each.name for each in offered if each.field_info.default is False] == [], "nothing is on that it turns off"
    assert [each.name for each in options if each.required and each.name.startswith("--")] == []


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is always a display")
def test_view_draws_a_picture_where_there_is_no_display(tmp_path, monkeypatch, capsys) -> None:
    for variable in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.chdir(tmp_path)
    Path("ball.xml").write_text('<mujoco><worldbody><geom size="0.1"/></worldbody></mujoco>')
    assert run_main("view", "ball.xml", "--picture", "ball.png") == 0
    assert Path("ball.png").read_bytes().startswith(b"\x89PNG")
    assert "ball.png" in capsys.readouterr().out
    assert run_main("view", "ball.xml", "--picture", "nowhere/ball.png") == 2
    assert "cannot write nowhere/ball.png" in capsys.readouterr().err


def test_view_reads_files_by_the_bounds_of_the_validator(tmp_path, capsys) -> None:
    for name, content, said in (
        ("large.xml", b" " * (SIZE_LIMITS.characters + 1), "are read"),
        ("bytes.xml", b"\xff\xfe", "UTF-8"),
        ("absent.xml", None, "cannot read the MJCF file"),
    ):
        if content is not None:
            (tmp_path / name).write_bytes(content)
        assert run_main("view", str(tmp_path / name)) in (1, 2)
        assert said in capsys.readouterr().err


def test_show_prints_layout_status_and_files(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert run_main("show", "--layout") == 0
    assert capsys.readouterr().out == layout_text() + "\n"
    run = new_run(tmp_path, concepts=2)
    run_designs(run, parts(Scripted([Script(robots=["misspelt"]), Script(robots=[ModelError("no answer from x")])])))
    assert run_main("show", str(run.path)) == 0
    said = capsys.readouterr().out
    assert all(word in said for word in ("approved", "stopped", "no answer from x", "aidsr resume", "final.xml"))
    titles = next(line for line in said.splitlines() if line.startswith("design "))
    assert titles.split() == ["design", "concept", "state", "iterations", "fixes", "tokens", "cost", "time"]
    assert run.asked().objective in said
    assert "probe" not in said
    won = EpisodeResult(variation=0, ended="succeeded", progress=1, best_progress=1, time_s=1, reward=1)
    probed = ProbedVariation(episode=won, family="pull", motion=Motion(begin_s=0, ramp_s=1, frequency_hz=1, groups=()))
    report = ProbeReport(
        task="gap", level="standard", benchmark_version=6, seed=0, candidates=16, searched_s=1, simulated_s=1,
        wall_s=1, variations=(probed,), same_motion_share=1, reached="held success",
    )  # fmt: skip
    (run.design(1).path / "probe.json").write_text(report.model_dump_json())
    assert run_main("show", str(run.path)) == 0
    assert "design 1, probe: 1 of 1 variations solved, mean best progress 1.00" in capsys.readouterr().out
    assert run_main("show", str(tmp_path)) == 0
    listed = capsys.readouterr().out.splitlines()
    assert [line.split() for line in listed[:2]] == [
        ["run", "approved", "task", "or", "objective"],
        [run.path.name, "1", "of", "2", *(run.asked().task or run.asked().objective).split()],
    ]
    assert run_main("show", str(run.path), "--json") == 0
    status = json.loads(capsys.readouterr().out)
    assert [design["state"] for design in status["designs"]] == ["finished", "stopped"]
    assert [design["mechanical_repairs"] for design in status["designs"]] == [1, 0]


def test_show_takes_the_folder_of_a_design_as_other_commands_do(tmp_path, capsys) -> None:
    run = new_run(tmp_path, concepts=2)
    run_designs(run, parts(Scripted([Script(), Script(robots=[ModelError("no answer from x")])])))
    train = run.design(2).path / "training" / "001"
    train.mkdir(parents=True)
    (train / "config.json").write_text("{}")
    assert run_main("show", str(run.design(1).path)) == 0
    said = capsys.readouterr().out
    assert "concept 1" in said
    assert "final.xml" in said
    assert not any(word in said for word in ("concept 2", "no answer from x", "design 2", "concepts.json"))
    assert run_main("show", str(run.design(2).path), "--json") == 0
    assert [design["number"] for design in json.loads(capsys.readouterr().out)["designs"]] == [2]
    assert run_main("show", str(run.design(7).path)) == 2
    assert "this run has no design 7; it has: 1, 2" in capsys.readouterr().err


def test_tasks_are_listed_with_their_objectives(capsys) -> None:
    assert run_main("tasks") == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "button_pushing" in said
    assert "Press a round push button" in said


def test_doctor_names_keys_and_never_says_them(monkeypatch, capsys) -> None:
    monkeypatch.setenv("ANTHROPIC_API_KEY", "canary-0123456789")
    assert run_main("doctor") == 0
    said = capsys.readouterr().out
    assert "ANTHROPIC_API_KEY" in said
    assert "canary" not in said
    assert {"Python", "packages", "graphics", "isolation", "files", "keys"} <= {check.topic for check in checks()}


def test_doctor_tests_isolation_when_asked(capsys) -> None:
    assert run_main("doctor", "--test-isolation") == 0
    assert "test passed: own process, wall clock, processor time, memory" in " ".join(capsys.readouterr().out.split())


def test_the_command_line_loads_neither_simulator_nor_client() -> None:
    heavy = ("mujoco", "numpy", "torch", "pydantic_ai")
    code = f"import sys, aidsr.apps.cli; print([m for m in {heavy} if m in sys.modules])"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"


def test_validate_reads_standard_input_and_prints_json() -> None:
    program = [Path(sys.executable).with_name("aidsr"), "validate", "-", "--json"]
    told = subprocess.run(program, input="not MJCF", capture_output=True, text=True, check=False, env=os.environ)
    assert told.returncode == 1
    report = json.loads(told.stdout)
    assert report["stable"] is False
    assert report["faults"]
