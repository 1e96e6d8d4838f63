"""A disk that is full ends every command with one sentence, and loses nothing that was finished.

A limit on the size of files (ulimit -f) stands for the full disk: writing fails in the same places, and needs no disk.
"""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from aidsr.core.storage_errors import StorageError, storage_problem
from aidsr.runs import EventLog, Run, read_events, read_status
from aidsr.runs.events import Started
from aidsr.runs.files import replace_file, write_once

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no limit on the size of files")

EXAMPLE = Path(__file__).parents[3] / "src/aidsr/teams/baselines/robots/button_pushing.xml"


def at_most(size_bytes: int) -> Callable[[], None]:
    def limit() -> None:
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, size_bytes))

    return limit


def run(home: Path, *arguments: str, size_bytes: int | None = None) -> subprocess.CompletedProcess[str]:
    """Run a command whose files may have so many bytes."""
    return subprocess.run(
        [sys.executable, "-m", "aidsr", *arguments],
        cwd=home,
        capture_output=True,
        text=True,
        timeout=300,
        preexec_fn=at_most(size_bytes) if size_bytes else None,
        check=False,
    )


def test_a_run_that_met_a_full_disk_is_resumed_to_its_end(tmp_path: Path) -> None:
    ended = run(tmp_path, "design", "--task", "button_pushing", "--concepts", "1", size_bytes=20_000)
    assert ended.returncode in (1, 2)
    assert "Traceback" not in ended.stdout + ended.stderr
    assert "the file would be larger than is allowed" in ended.stdout + ended.stderr
    (folder,) = (tmp_path / "runs").iterdir()
    assert read_status(Run(folder)).state == "stopped"
    assert run(tmp_path, "resume", str(folder)).returncode == 0
    assert read_status(Run(folder)).approved == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ("design", "--task", "button_pushing"),
        ("validate", str(EXAMPLE), "--report", "page.html"),
        ("fix", str(EXAMPLE), "--out", "fixed.xml"),
        ("benchmark", "study", "--tasks", "gap", "--designs", "1"),
    ],
)
def test_a_command_ends_with_one_sentence(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    ended = run(tmp_path, *arguments, size_bytes=100)
    assert ended.returncode == 2
    assert ended.stderr.startswith("aidsr: ")
    assert "Traceback" not in ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1


def test_a_file_that_is_fixed_in_place_is_whole_after_a_full_disk(tmp_path: Path) -> None:
    before = EXAMPLE.read_text().replace("<mujoco", "<!-- a -- b --><mujoco", 1)
    (tmp_path / "robot.xml").write_text(before)
    ended = run(tmp_path, "fix", "robot.xml", "--in-place", size_bytes=100)
    assert ended.returncode == 2
    assert ended.stderr.startswith("aidsr: ")
    assert (tmp_path / "robot.xml").read_text() == before
    assert [path.name for path in tmp_path.iterdir()] == ["robot.xml"]


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EACCES, errno.EDQUOT, errno.EIO])
def test_a_file_that_cannot_be_written_keeps_what_it_held(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    file = tmp_path / "file"
    write_once(file, b"before")

    def full(_descriptor: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(StorageError, match=str(file)):
        replace_file(file, b"after")
    assert file.read_bytes() == b"before"
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_line_that_fits_in_part_is_taken_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write = os.write
    with EventLog(tmp_path / "events.jsonl") as log:
        log.write(Started())
        monkeypatch.setattr(os, "write", lambda file, line: write(file, line[:7]))
        with pytest.raises(StorageError, match="disk is full"):
            log.write(Started())
        monkeypatch.setattr(os, "write", write)
        log.write(Started())
    assert len(read_events(tmp_path / "events.jsonl")) == 2


def test_other_errors_are_no_problem_of_the_disk() -> None:
    assert storage_problem(ValueError("x")) is None
    assert storage_problem(BrokenPipeError(errno.EPIPE, "x")) is None
    sentence = storage_problem(OSError(errno.EROFS, "x", "/mnt/run.json"))
    assert sentence is not None
    assert sentence.startswith("/mnt/run.json: the file system is read-only; name a folder")
