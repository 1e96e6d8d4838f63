"""Folders from strangers: links, pipes and sockets are refused before anything reads or writes through them."""

from __future__ import annotations

import os
import shutil
import socket
from pathlib import Path

import pytest

from aidsr.core.errors import UserError
from aidsr.core.plain_tree import require_plain_tree, require_regular_file


def tree(home: Path) -> Path:
    folder = home / "run"
    (folder / "designs" / "1").mkdir(parents=True)
    (folder / "designs" / "1" / "robot.xml").write_text("<mujoco/>")
    return folder


def test_files_and_folders_are_plain(tmp_path: Path) -> None:
    folder = tree(tmp_path)
    require_plain_tree(folder)
    require_regular_file(folder / "designs" / "1" / "robot.xml")


@pytest.mark.parametrize("name", ["link", "designs/link", "designs/1/robot_report.json"])
def test_a_link_at_any_depth_is_refused_by_name(tmp_path: Path, name: str) -> None:
    folder = tree(tmp_path)
    (folder / name).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(UserError, match=f"holds a link: {name}; only regular files"):
        require_plain_tree(folder)
    with pytest.raises(UserError, match="is a link"):
        require_regular_file(folder / name)


def test_a_named_pipe_and_a_socket_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tree(tmp_path)
    os.mkfifo(folder / "events.jsonl")
    with pytest.raises(UserError, match=r"named pipe: events\.jsonl"):
        require_plain_tree(folder)
    (folder / "events.jsonl").unlink()
    monkeypatch.chdir(folder)  # the path of a socket is short
    with socket.socket(socket.AF_UNIX) as made:
        made.bind("events.jsonl")
        with pytest.raises(UserError, match=r"socket or device: events\.jsonl"):
            require_plain_tree(folder)


def test_the_folder_itself_may_be_a_link(tmp_path: Path) -> None:
    (tmp_path / "named").symlink_to(tree(tmp_path))
    require_plain_tree(tmp_path / "named")


def test_another_folder_of_the_same_name_is_checked_again(tmp_path: Path) -> None:
    folder = tree(tmp_path)
    require_plain_tree(folder)
    shutil.rmtree(folder)
    (tree(tmp_path) / "designs" / "2").symlink_to(tmp_path)
    with pytest.raises(UserError, match="designs/2"):
        require_plain_tree(folder)


def test_a_folder_that_is_absent_is_left_to_its_reader(tmp_path: Path) -> None:
    require_plain_tree(tmp_path / "none")
    require_regular_file(tmp_path / "none")
