"""`aidsr validate`: several files, repairs, realizability, the page, and JSON by its schema."""

from __future__ import annotations

import json
import sys
from io import BytesIO, TextIOWrapper
from pathlib import Path

import faulty
import pytest
import robots

from aidsr.apps.cli import main
from aidsr.validation.json_report import FileReport, schema_text

ROOT = Path(__file__).parents[3]
SLIP = robots.arm().replace("stiffness=", "stifness=", 1)


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    texts = {"good": robots.arm(), "strong": faulty.arm(bend_rad=3), "stiff": faulty.stiff(200), "slip": SLIP}
    for name, text in texts.items():
        (tmp_path / f"{name}.xml").write_text(text)
    return tmp_path


def run(*words: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["validate", *words])
    return int(ended.value.code or 0)


def test_several_files_end_with_the_worst(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("good.xml", "good.xml") == 0
    assert capsys.readouterr().out == "good.xml: stable (sound, in scope): no faults found\n\n" * 2
    assert run("good.xml", "stiff.xml") == 1
    said = capsys.readouterr().out
    assert said.startswith("good.xml: stable")
    assert "stiff.xml: not stable (not sound, in scope)\ntoo_stiff at" in said


def test_a_file_that_is_not_there_is_a_mistake(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("good.xml", "absent.xml") == 2
    assert "absent.xml" in capsys.readouterr().err
    assert run() == 2
    assert "no file given" in capsys.readouterr().err


def test_rules_are_selected_and_ignored_by_code(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("stiff.xml", "--ignore", "too_stiff", "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert report["sound"]
    assert report["notes"] == ["did not look for too_stiff"]
    assert run("stiff.xml", "good.xml", "--select", "too_stiff, no_sensors", "--json") == 1
    reports = json.loads(capsys.readouterr().out)
    assert [[fault["code"] for fault in report["faults"]] for report in reports] == [["too_stiff"], []]
    assert run("stiff.xml", "--ignore", "to_stiff") == 2
    assert capsys.readouterr().err == "aidsr: no such rule: to_stiff; did you mean too_stiff?\n"


def test_realizability_is_told_apart_and_enforced_on_request(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("strong.xml") == 0
    said = capsys.readouterr().out
    assert said.startswith("stable (sound, in scope), with warnings\n\nBuildability (not part of the verdict")
    assert run("strong.xml", "--realizable") == 1
    said = capsys.readouterr().out
    assert said.startswith("not stable (sound, but not buildable, in scope)")
    assert "at most 34.3" in said


def test_a_robot_out_of_scope_fails_only_where_scope_is_asked_for(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = Path("good.xml").read_text()
    Path("wheels.xml").write_text(
        text.replace("</actuator>", '<motor name="turn" joint="j0x" ctrlrange="-0.1 0.1"/></actuator>')
    )
    assert run("wheels.xml") == 0
    assert capsys.readouterr().out.startswith("not stable (sound, out of scope)\nmotorized_joint at turn: ")
    assert run("wheels.xml", "--scope", "--json") == 1
    report = json.loads(capsys.readouterr().out)
    assert (report["sound"], report["in_scope"], report["stable"]) == (True, False, False)
    assert run("good.xml", "--scope") == 0
    assert run("stiff.xml") == 1


def test_the_cheapest_motors_are_named(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("good.xml", "--realizable") == 0
    assert "- m0, m1, m2, m3 (46.8 N, 0.0371 m/s, stroke 29 mm): Feetech" in capsys.readouterr().out


def test_repairs_are_made_on_request_and_told(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("slip.xml") == 1
    assert run("slip.xml", "--repair", "mended.xml") == 0
    said = capsys.readouterr().out
    assert "1 automatic fix, written to mended.xml:\n- <joint> 'j0x' in line 1: wrote stiffness" in said
    assert Path("slip.xml").read_text() == SLIP
    assert run("mended.xml") == 0
    assert run("good.xml", "--repair", "same.xml") == 0
    assert "nothing to fix" in capsys.readouterr().out
    assert Path("same.xml").read_bytes() == Path("good.xml").read_bytes()


def test_nothing_is_overwritten_unasked(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for option, file in (("--repair", "good.xml"), ("--report", "stiff.xml")):
        before = Path(file).read_bytes()
        assert run("slip.xml", option, file) == 2
        assert "--force" in capsys.readouterr().err
        assert Path(file).read_bytes() == before
    assert run("slip.xml", "--repair", "slip.xml", "--force") == 0
    assert Path("slip.xml").read_text() != SLIP
    assert run("slip.xml", "--repair", "nowhere/mended.xml") == 2
    assert run("slip.xml", "--repair", "both.xml", "--report", "./both.xml", "--force") == 2
    assert "name the same file: both.xml" in capsys.readouterr().err
    assert not Path("both.xml").exists()
    assert run("good.xml", "slip.xml", "--repair", "mended.xml") == 2
    assert "one at a time" in capsys.readouterr().err


def test_a_page_is_written_beside_what_is_said(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("stiff.xml", "--report", "stiff.html") == 1
    assert "too_stiff" in capsys.readouterr().out
    page = Path("stiff.html").read_text()
    assert "<title>stiff.xml: Not sound, in scope" in page
    assert run("stiff.xml", "--report", "stiff.html") == 1, "a page of ours is replaced"
    assert Path("stiff.html").read_text() == page


def test_standard_input_can_be_repaired_and_shown(
    files: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdin", TextIOWrapper(BytesIO(SLIP.encode())))
    assert run("-", "--repair", "mended.xml", "--report", "mended.html", "--json") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["file"] == "-"
    assert answer["repairs"]["counts"] == {"misspelt_attributes": 1}
    assert "wrote stiffness for stifness" in Path("mended.html").read_text()


@pytest.mark.parametrize("errors", ["strict", "surrogateescape"])
def test_standard_input_that_is_no_text_is_a_mistake_as_a_file_is(
    files: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], errors: str
) -> None:
    monkeypatch.setattr(sys, "stdin", TextIOWrapper(BytesIO(b"<mujoco>\xff</mujoco>"), "utf-8", errors))
    assert run("-", "--repair", "mended.xml") == 2
    assert "standard input is not UTF-8 text" in capsys.readouterr().err
    assert not Path("mended.xml").exists()


def test_json_is_an_object_for_one_file_and_a_list_for_several(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("stiff.xml", "--json") == 1
    one = json.loads(capsys.readouterr().out)
    assert one["schema_version"] == 1
    assert FileReport.model_validate(one).faults[0].code == "too_stiff"
    assert run("good.xml", "stiff.xml", "--json") == 1
    assert [each["stable"] for each in json.loads(capsys.readouterr().out)] == [True, False]


def test_the_documented_schema_is_current(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--schema") == 0
    assert capsys.readouterr().out == schema_text()
    written = (ROOT / "docs" / "validation-schema.json").read_text()
    assert written == schema_text(), "write it anew: aidsr validate --schema > docs/validation-schema.json"


def test_the_schema_names_what_is_printed(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run("stiff.xml", "--json")
    printed, schema = json.loads(capsys.readouterr().out), json.loads(schema_text())
    assert set(printed) == set(schema["properties"]) == set(schema["required"])
    assert set(printed["faults"][0]) == set(schema["$defs"]["Fault"]["properties"])
    assert all("description" in schema["properties"][name] for name in ("schema_version", "file", "repairs"))
