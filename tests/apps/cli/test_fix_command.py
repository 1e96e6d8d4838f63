"""`aidsr fix`: what it prints, what it writes, its exit codes."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from aidsr.apps.cli import main
from aidsr.apps.cli.fix import fixes_table
from aidsr.fixes import fix
from aidsr.validation import validate
from aidsr.validation.registry import require_rule
from aidsr.validation.rules_page import EXAMPLE_ARM

SLIP = """<mujoco>
  <worldbody>
    <body name="b"><joint name="j" stifness="1"/><geom size="0.1"/></body>
  </worldbody>
</mujoco>
"""
GOOD = SLIP.replace("stifness", "stiffness")


def run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as end:
        main(["fix", *arguments])
    return int(end.value.code or 0)


@pytest.fixture
def slip(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "slip.xml"
    file.write_text(SLIP)
    return file


def test_without_a_place_to_write_it_says_what_it_would_fix(slip: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("slip.xml") == 1
    printed = capsys.readouterr().out
    assert (
        printed == "slip.xml: 1 fix, not written; add --in-place or --out FILE to write\n"
        "- <joint> 'j' in line 3: wrote stiffness for stifness.\n"
    )
    assert slip.read_text() == SLIP


def test_a_file_is_fixed_in_place_and_then_has_nothing_to_fix(slip: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("slip.xml", "--in-place") == 0
    assert slip.read_text() == GOOD
    assert "1 fix, written to slip.xml" in capsys.readouterr().out
    assert run("slip.xml") == 0
    assert "nothing to fix" in capsys.readouterr().out


@pytest.mark.parametrize("simulate", [[], ["--simulate"]])
def test_line_ends_stay_and_text_around_the_document_goes_with_a_note(
    slip: Path, capsys: pytest.CaptureFixture[str], simulate: list[str]
) -> None:
    before = slip.read_text()
    slip.write_bytes(f"Here it is:\n{before}\n".replace("\n", "\r\n").encode())
    assert run("slip.xml", "--in-place", *simulate) == bool(simulate)
    after = slip.read_bytes()
    assert after.startswith(b"<mujoco")
    assert after.count(b"\n") == after.count(b"\r\n") > 2
    assert after.endswith(b"\r\n")
    assert "Put aside what stood around the document, 11 characters beginning 'Here it is:'" in capsys.readouterr().out


def test_a_new_file_is_written_and_an_old_one_only_by_force(slip: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("slip.xml", "--out", "fixed.xml") == 0
    assert Path("fixed.xml").read_text() == GOOD
    assert slip.read_text() == SLIP
    assert run("slip.xml", "--out", "fixed.xml") == 2
    assert "fixed.xml exists" in capsys.readouterr().err
    assert run("slip.xml", "--out", "fixed.xml", "--force") == 0


def test_what_is_left_is_named_and_counts(slip: Path, capsys: pytest.CaptureFixture[str]) -> None:
    slip.write_text(SLIP.replace("/></body>", ' colour="1"/></body>'))
    assert run("slip.xml", "--in-place") == 1
    assert "remaining: unknown_attribute; see aidsr validate" in capsys.readouterr().out
    assert "stiffness" in slip.read_text()


def test_standard_input_goes_to_standard_output(
    slip: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(SLIP.encode())))
    assert run("-") == 0
    captured = capsys.readouterr()
    assert captured.out == GOOD
    assert "1 fix" in captured.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "no file given"),
        (("--magic",), "unknown option: --magic"),
        (("a.xml", "b.xml", "--out", "c.xml"), "--out writes one file"),
        (("a.xml", "--out", "c.xml", "--in-place"), "--out writes one file"),
        (("-", "--in-place"), "standard input cannot be fixed in place"),
        (("slip.xml", "--out", "nowhere/c.xml"), "cannot write nowhere/c.xml"),
        (("missing.xml",), "missing.xml"),
    ],
)
def test_mistakes_are_said_in_a_sentence(
    arguments: tuple[str, ...], words: str, slip: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*arguments) == 2
    assert words in " ".join(capsys.readouterr().err.split())


def test_the_docs_list_every_fix(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--list") == 0
    page = (Path(__file__).parents[3] / "docs" / "validation.md").read_text(encoding="utf-8")
    assert capsys.readouterr().out == fixes_table()
    assert fixes_table() in page, "put what `aidsr fix --list` prints into docs/validation.md"


def test_what_the_command_writes_is_what_the_function_returns(slip: Path) -> None:
    assert fix(slip).mjcf == GOOD.rstrip("\n")


def test_with_simulate_it_fixes_what_simulation_finds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    rule = require_rule("underdamped")
    assert rule.example
    Path("robot.xml").write_text(rule.example.fails(EXAMPLE_ARM))
    assert run("robot.xml", "--out", "safe.xml") == 0
    assert not validate("safe.xml").stable
    assert run("robot.xml", "--simulate", "--out", "stable.xml") == 0
    assert validate("stable.xml").stable
    assert "underdamped: " in capsys.readouterr().out
