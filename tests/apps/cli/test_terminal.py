"""No text of others controls the terminal it is shown in."""

from __future__ import annotations

import ast
import io
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

import aidsr.apps.cli
from aidsr.apps.cli import main
from aidsr.apps.cli.reporting import print_unwrapped
from aidsr.apps.cli.terminal import make_console, printable, write, write_document
from aidsr.core.artifacts import Concept
from aidsr.core.config import RunConfig
from aidsr.runs import EventLog
from aidsr.runs.events import Started, StepDone
from scripted import new_run

HOSTILE = "\x1b]0;owned\x07\x1b[2Jred\x9b31m\rover\u202eback\ud800\u2028"
"""Sets the title, clears the screen, colours, overwrites its line, turns the text round; half of a character."""
COMMANDS = Path(aidsr.apps.cli.__file__).parent


def is_harmless(text: str) -> bool:
    return not set(text) & set("\x1b\x07\x9b\r\u202e\ud800\u2028")


def test_what_controls_a_terminal_is_shown_as_a_replacement_and_all_else_as_it_is() -> None:
    assert is_harmless(printable(HOSTILE))
    assert printable(HOSTILE).count("\ufffd") == 8
    assert printable("Grüße 机器人 \t1\n") == "Grüße 机器人 \t1\n"
    assert printable("a\r\nb") == "a\nb"


def test_a_console_sends_its_own_colours_and_nobody_elses(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    console = make_console()
    console.file = io.StringIO()
    table = Table(title=HOSTILE)
    table.add_column(HOSTILE)
    table.add_row(Text(HOSTILE, style="red"))
    console.print(table)
    with Live(Text(HOSTILE), console=console):
        console.print(HOSTILE, markup=False)
    sent = console.file.getvalue()
    assert "\x1b[31m" in sent
    for foreign in ("\x1b]0;", "\x1b[2J", "\x07", "\x9b", "\u202e", "\ud800"):
        assert foreign not in sent


def test_a_document_is_exact_in_a_pipe_and_printable_in_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    for out, expected in ((io.StringIO(), "<a>\x9b</a>"), (Terminal(), "<a>\ufffd</a>")):
        monkeypatch.setattr(sys, "stdout", out)
        write_document("<a>\x9b</a>")
        assert out.getvalue() == expected
    write("\x1b[2J", to=(messages := io.StringIO()))
    assert messages.getvalue() == "\ufffd[2J"


def test_names_in_a_run_and_an_error_are_shown_harmless(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    hostile = HOSTILE.replace("\ud800", "")  # no file can hold it
    run = new_run(tmp_path)
    concept = Concept(
        name=hostile, interpretation="x", morphology="x", actuation="x", functional_part="x", family="arm"
    )
    design = run.design(1)
    with EventLog(design.events) as log:
        log.write(Started())
        design.iteration(1).concept.write(concept)
        log.write(StepDone(step="concept", iteration=1, summary=hostile))
    folder = run.path.with_name(f"run{hostile.replace('/', '')}")
    run.path.rename(folder)
    for words in (["show", str(folder)], ["resume", f"{folder}/{hostile}"], ["design", "a", f"b{hostile}"]):
        with pytest.raises(SystemExit):
            main(words)
        shown = capsys.readouterr()
        assert "owned" in shown.out + shown.err
        assert is_harmless(shown.out + shown.err)


def test_a_model_whose_name_is_markup_is_shown_as_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from aidsr.apps.cli.reporting import print_introduction

    for name in ("replay:[/]", "manual:[red]a[/red]", "made[/]up@http://127.0.0.1:1/v1"):
        run = new_run(tmp_path / str(abs(hash(name))))
        asked = run.asked()
        record = asked.model_copy(update={"config": RunConfig(model=name)})
        run.record.path.write_text(record.model_dump_json())
        print_introduction(make_console(), run)
        assert name in "".join(capsys.readouterr().out.split())


def test_no_command_prints_past_the_one_place() -> None:
    for path in sorted(COMMANDS.glob("*.py")):
        if path.name == "terminal.py":
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call):
                called = ast.unparse(node.func)
                assert called not in {"Console", "print", "sys.stdout.write", "sys.stderr.write"}, f"{path}: {called}"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is full")
def test_output_that_cannot_be_written_is_one_sentence() -> None:
    with Path("/dev/full").open("wb") as full:
        ended = subprocess.run(
            [sys.executable, "-m", "aidsr", "tasks"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert ended.returncode == 2
    assert ended.stderr.startswith("aidsr: The disk is full")
    assert len(ended.stderr.splitlines()) == 1


def test_a_reader_that_stops_reading_ends_a_command_quietly() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    ended = subprocess.run(
        [sys.executable, "-m", "aidsr", "rules", "--page"], stdout=writing, stderr=subprocess.PIPE, check=False
    )
    os.close(writing)
    assert ended.stderr == b""
    assert ended.returncode == 128 + signal.SIGPIPE


@pytest.mark.parametrize("in_terminal", [True, False])
def test_a_table_with_whole_rows_has_no_spaces_at_the_ends_of_its_lines(in_terminal: bool) -> None:
    out = io.StringIO()
    console = Console(file=out, width=40, force_terminal=in_terminal, color_system="standard" if in_terminal else None)
    table = Table("name", "what", box=None, padding=(0, 3, 1, 0))
    table.add_row("[bold]a[/]", "word " * 30)
    table.add_row("b", "[red]short[/]")
    print_unwrapped(console, table)
    lines = Text.from_ansi(out.getvalue()).plain.split("\n")
    assert [line for line in lines if line] == ["name   what", f"a      {'word ' * 29}word", "b      short"]
    assert all(line == line.rstrip() for line in lines)
    assert ("\x1b[31mshort" in out.getvalue()) is in_terminal
