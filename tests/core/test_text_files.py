"""Files of others: pipes, devices, sizes, and TOML that brings down its parser."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from aidsr.core.errors import UserError
from aidsr.core.formatting import format_cell
from aidsr.core.text_files import parse_toml, read_text_file
from aidsr.mjcf.read import open_mjcf
from aidsr.studies.arms import read_feedback
from aidsr.studies.study import open_study
from aidsr.studies.submission import read_submission
from aidsr.tasks.goals import parse_goal, read_goal

DEEP = "a = " + "[" * 100_000
LONG = "a = " + "9" * 5_000


def test_a_text_is_read_up_to_its_bound(tmp_path: Path) -> None:
    file = tmp_path / "a.txt"
    file.write_bytes(b"\xef\xbb\xbf12345")
    assert read_text_file(file, max_bytes=8) == "12345"
    with pytest.raises(UserError, match="larger than 7 bytes"):
        read_text_file(file, max_bytes=7)
    file.write_bytes(b"\xff")
    with pytest.raises(UserError, match="not UTF-8 text"):
        read_text_file(file, max_bytes=8)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_every_reader_refuses_a_pipe_and_a_device(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (pipe, Path(os.devnull)):
        for read in (read_goal, open_mjcf, read_submission, lambda file: read_feedback(file, ())):
            with pytest.raises(UserError, match="not a regular file"):
                read(path)


@pytest.mark.parametrize(
    "text", [DEEP, LONG, DEEP.replace("[", "{b="), "a.b" + ".b" * 500_000 + "=1", "[" + "a . " * 30 + "a]"]
)
def test_toml_that_breaks_its_parser_is_one_sentence(tmp_path: Path, text: str) -> None:
    with pytest.raises(ValueError, match=r"nested|number|digits") as refused:
        parse_toml(text)
    assert len(str(refused.value)) < 300
    with pytest.raises(UserError):
        parse_goal(text)
    (tmp_path / "study.toml").write_text(text)
    with pytest.raises(UserError):
        open_study(tmp_path)


def test_a_cell_of_a_table_holds_no_markup() -> None:
    assert format_cell("a|b\n<script>*x*</script> [c](d)") == r"a\|b \<script\>\*x\*\</script\> \[c\](d)"
    assert format_cell("openai:gpt-5") == "openai:gpt-5"
