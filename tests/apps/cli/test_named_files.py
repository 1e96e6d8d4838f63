"""Every command that is given an empty file, or a place that cannot be written, ends with one sentence."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from aidsr.apps.cli import app, main
from aidsr.apps.cli.output_file import write_output
from aidsr.core.artifacts import Concept, Outcome, Robot
from aidsr.core.errors import UserError
from aidsr.runs import Run, read_status
from aidsr.runs.files import MjcfFile, replace_file
from scenes import small_arm, small_scene
from scripted import new_run

EMPTY = {
    "design": ["design", "--task", "button_pushing", "--robot", "{empty.xml}"],
    "design an objective": ["design", "press", "--environment", "{empty.xml}"],
    "design with a goal": ["design", "press", "--environment", "{scene.xml}", "--goal", "{empty.toml}"],
    "resume": ["resume", "{run}"],
    "show": ["show", "{run}"],
    "import": ["import", "{empty.xml}"],
    "view": ["view", "{empty.xml}"],
    "probe": ["probe", "{empty.xml}", "--task", "button_pushing"],
    "train": ["train", "{empty.xml}", "--task", "button_pushing"],
    "evaluate": ["evaluate", "{training}"],
    "export": ["export", "{empty.xml}"],
    "benchmark": ["benchmark", "{study}", "--resume"],
    "report": ["report", "{study}"],
    "compare": ["compare", "{study}", "{study}"],
    "submit": ["submit", "{study}"],
    "leaderboard": ["leaderboard", "{empty.json}"],
    "check": ["check", "{empty.xml}", "{empty.toml}"],
    "evolve": ["evolve", "press", "--environment", "{empty.xml}", "--goal", "{empty.toml}"],
    "memory": ["memory", "show", "{run}"],
}
UNWRITABLE = {
    "design": ["design", "--task", "button_pushing", "--runs", "{file}"],
    "validate": ["validate", "{arm.xml}", "--report", "{file}/a.html"],
    "validate and repair": ["validate", "{arm.xml}", "--repair", "{file}/a.xml"],
    "fix": ["fix", "{slip.xml}", "--out", "{file}/a.xml"],
    "import": ["import", "{arm.xml}", "--out", "{file}/a.xml"],
    "view": ["view", "{arm.xml}", "--picture", "{file}/a.png"],
    "probe": ["probe", "{scene.xml}", "--task", "button_pushing", "--candidates", "16", "--max-steps", "100",
              "--out", "{file}/a.json"],
    "train": ["train", "{scene.xml}", "--task", "button_pushing", "--steps", "64", "--out", "{file}/a"],
    "export": ["export", "{arm.xml}", "--out", "{file}/a"],
    "new": ["new", "{file}/a"],
    "evolve": ["evolve", "--task", "gap", "--out", "{file}/a"],
    "web": ["web", "--runs", "{file}", "--no-browser", "--port", "39417"],
    "benchmark": ["benchmark", "{file}/a", "--tasks", "gap", "--designs", "1", "--concepts", "1"],
}  # fmt: skip
NO_FILE = {"tasks", "rules", "doctor"}
"""Commands that are given none, and write none."""
ELSEWHERE = {
    "mcp",  # writes when a client asks: tests/apps/mcp
    "evaluate",  # writes beside the policy it reads: tests/learn/rl
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    home = tmp_path_factory.mktemp("named")
    found = {name: home / name for name in ("run", "study", "training", "file")}
    for name in ("empty.xml", "empty.toml", "empty.json", "file"):
        found[name] = home / name
        found[name].touch()
    for folder, name in (("run", "run.json"), ("study", "study.toml"), ("training", "config.json")):
        found[folder].mkdir()
        (found[folder] / name).touch()
    for name, text in (
        ("scene.xml", small_scene()),
        ("arm.xml", small_arm()),
        ("slip.xml", small_arm().replace("<mujoco", "<!-- a -- b --><mujoco", 1)),
    ):
        found[name] = home / name
        found[name].write_text(text)
    return found


def words(command: list[str], files: dict[str, Path]) -> list[str]:
    for name, path in files.items():
        command = [word.replace(f"{{{name}}}", str(path)) for word in command]
    return command


def test_every_command_has_its_case() -> None:
    commands = {name for name in app if not name.startswith("-")}
    assert commands - NO_FILE - ELSEWHERE == {case.partition(" ")[0] for case in (*EMPTY, *UNWRITABLE)} - ELSEWHERE


@pytest.mark.parametrize("cases", [EMPTY, UNWRITABLE], ids=["empty", "unwritable"])
@pytest.mark.parametrize("case", [*dict.fromkeys([*EMPTY, *UNWRITABLE])])
def test_one_sentence(
    cases: dict[str, list[str]], case: str, files: dict[str, Path], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    if case not in cases:
        return
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(words(cases[case], files))
    assert ended.value.code in (1, 2)
    # a probe's progress goes to the same stream
    said = [line for line in capsys.readouterr().err.strip().splitlines() if "motions tried" not in line]
    assert len(said) == 1, said
    assert said[0].startswith("aidsr: ")
    assert any(str(path) in said[0] for name, path in files.items() if f"{{{name}" in " ".join(cases[case]))
    assert not list(tmp_path.iterdir())
    assert files["arm.xml"].read_text() == small_arm()


def test_an_empty_robot_in_a_run_stops_its_design_and_is_approved_by_nobody(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = new_run(tmp_path)
    concept = Concept(name="a", interpretation="x", morphology="x", actuation="x", functional_part="tip", family="arm")
    run.concepts.write((concept,))
    first = run.design(1).iteration(1)
    first.concept.write(concept)
    first.robot.write(Robot(mjcf=small_arm(), functional_part="tip"))
    first.robot.xml.path.write_bytes(b"")
    with pytest.raises(SystemExit) as ended:
        main(["resume", str(run.path)])
    assert ended.value.code == 1
    assert "robot.xml is empty; restore or remove it" in " ".join(capsys.readouterr().out.split())
    assert read_status(Run(run.path)).approved == 0


def test_a_file_of_a_run_that_was_edited_ends_resuming_with_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = new_run(tmp_path)
    concept = Concept(name="a", interpretation="x", morphology="x", actuation="x", functional_part="tip", family="arm")
    run.concepts.write((concept,))
    run.design(1).iteration(1).concept.write(concept.model_copy(update={"name": "b"}))
    with pytest.raises(SystemExit) as ended:
        main(["resume", str(run.path)])
    assert ended.value.code in (1, 2)
    told = capsys.readouterr()
    assert "Traceback" not in told.out + told.err
    assert "concept.json is written once and holds something else" in " ".join((told.out + told.err).split())


@pytest.mark.parametrize("name", ["final.xml", "final_robot.xml"])
@pytest.mark.parametrize(
    ("left", "said"),
    [
        pytest.param(b"", "its document has no end", id="empty"),
        pytest.param(small_arm()[:100].encode(), "its document has no end", id="cut off"),
        pytest.param(small_arm().encode("utf-16"), "it is not UTF-8 text", id="binary"),
    ],
)
@pytest.mark.parametrize("command", ["show", "export", "train", "probe"])
def test_what_is_left_of_an_approved_scene_is_not_taken_for_one(
    name: str, left: bytes, said: str, command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    run = new_run(tmp_path)
    design = run.design(1)
    design.outcome.write(Outcome(outcome="approved", iteration=1, reason=""))
    for file in ("final.xml", "final_robot.xml"):
        (design.path / file).write_text(small_arm())
    assert read_status(run).approved == 1
    (design.path / name).write_bytes(left)
    with pytest.raises(SystemExit) as ended:
        main([command, str(run.path if command == "show" else design.path)])
    assert ended.value.code == 2
    assert f"{name} is damaged: {said}" in capsys.readouterr().err
    assert not (design.path / "export").exists()


def test_a_robot_that_is_no_text_is_one_sentence(tmp_path: Path) -> None:
    file = MjcfFile(tmp_path, "robot", Robot)
    file.write(Robot(mjcf="<mujoco/>", functional_part="tip"))
    (tmp_path / "robot.xml").write_bytes(b"\xff\xfe")
    with pytest.raises(UserError, match="not UTF-8 text; restore or remove it"):
        file.read()


def test_a_file_fixed_in_place_keeps_its_permissions_and_the_links_to_it(tmp_path: Path) -> None:
    file, link = tmp_path / "a.xml", tmp_path / "link.xml"
    file.write_text("before")
    file.chmod(0o600)
    link.symlink_to(file)
    write_output(link, "after")
    assert link.is_symlink()
    assert file.read_text() == "after"
    assert file.stat().st_mode & 0o777 == 0o600
    with pytest.raises(UserError, match=r"the folder .* does not exist"):
        write_output(tmp_path / "none" / "a.xml", "x")
    shutil.rmtree(tmp_path)
    with pytest.raises(UserError, match="cannot write"):
        write_output(file, "x")


def test_a_storage_fault_names_the_file_that_is_meant(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(UserError, match=rf"^{tmp_path}/file/a.json: "):
        replace_file(tmp_path / "file" / "a.json", b"")
