"""What a child process cannot open where the kernel has Landlock."""

from __future__ import annotations

import socket
from pathlib import Path

import misbehaving
import pytest

from aidsr.sandbox.landlock import landlock_version, limits_network

with_landlock = pytest.mark.skipif(not landlock_version(), reason="this kernel offers no Landlock")
with_network = pytest.mark.skipif(not limits_network(), reason="this kernel offers no Landlock of version 4 or later")


@pytest.fixture
def files(tmp_path: Path) -> list[str]:
    """A file, a folder and a new file, as in a home."""
    (tmp_path / "secret").write_text("key")
    return [str(tmp_path / "secret"), str(tmp_path), str(tmp_path / "new")]


@with_landlock
def test_no_file_of_the_user_can_be_opened(files: list[str]) -> None:
    assert misbehaving.open_files([*files, str(Path.home()), "/etc/hostname"]) == ["/etc/hostname"]


@with_landlock
def test_below_a_folder_that_is_given_everything_can(files: list[str], tmp_path: Path) -> None:
    beside = tmp_path.with_name("beside")
    beside.mkdir()
    assert misbehaving.open_files_below(tmp_path, [*files, str(beside)]) == files
    assert (tmp_path / "new").read_text() == "made"
    assert misbehaving.open_files(files) == []


@with_landlock
def test_a_file_that_is_given_can_be_read_and_its_folder_cannot(files: list[str], tmp_path: Path) -> None:
    assert misbehaving.open_files_below(tmp_path / "secret", files) == files[:1]


@with_landlock
def test_files_within_an_argument_count_and_the_worker_is_used_again(tmp_path: Path) -> None:
    box = misbehaving.Box((tmp_path / "a", tmp_path / "b"))
    for path in box.inside:
        path.write_text("goal")
    assert misbehaving.open_files_in(box) == [str(path) for path in box.inside]
    assert misbehaving.open_files([str(path) for path in box.inside]) == []
    before = misbehaving.process()
    assert misbehaving.open_files_in(box) == [str(path) for path in box.inside]
    assert misbehaving.process() == before


@with_landlock
def test_keys_in_the_environment_of_the_caller_stay_there() -> None:
    assert not misbehaving.variables_of_the_parent()


@with_network
def test_no_connection_can_be_made() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        socket.create_connection(("127.0.0.1", port), timeout=10).close()
        assert not misbehaving.connect(port)
