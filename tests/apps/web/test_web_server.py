"""What keeps the page from being served."""

import socket
from pathlib import Path
from urllib.request import urlopen

import pytest
from browser import Server

from aidsr.apps.web.server import _secret, serve
from aidsr.core.directory_lock import DirectoryLock
from aidsr.core.errors import UserError


def test_a_port_that_is_taken_is_said_in_a_sentence(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(UserError, match=rf"cannot listen on port {port} of 127\.0\.0\.1: .*--port"):
            serve(tmp_path, port=port, browser=False)


def test_a_folder_is_served_by_one_web_app_at_a_time(tmp_path: Path) -> None:
    pytest.importorskip("fcntl")
    own = tmp_path / ".web"
    own.mkdir()
    lock = DirectoryLock(own)
    with pytest.raises(UserError, match=r"another aidsr web serves .*; open that one"):
        serve(tmp_path, port=0, browser=False)
    lock.release()  # as the system does where the process dies
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(UserError, match="cannot listen"):
        serve(tmp_path, port=taken.getsockname()[1], browser=False)


def test_web_apps_over_different_folders_keep_their_own_sessions(tmp_path: Path) -> None:
    names = []
    for folder in ("first", "second"):
        with Server.over(tmp_path / folder) as server, urlopen(server.address()) as page:
            names.append(page.headers["set-cookie"].partition("=")[0])
    assert names[0] != names[1]
    assert all(name.startswith("aidsr_session_") for name in names)


@pytest.mark.parametrize("left", [None, ""])
def test_the_key_of_cookies_is_made_where_there_is_none(tmp_path: Path, left: str | None) -> None:
    path = tmp_path / "secret"
    if left is not None:
        path.write_text(left)
        path.chmod(0o600)
    key = _secret(path)
    assert len(key) == 64
    assert (_secret(path), path.stat().st_mode & 0o777) == (key, 0o600)


@pytest.mark.parametrize("token", ["", "short"])
def test_others_reach_the_page_only_with_a_long_token(tmp_path: Path, token: str) -> None:
    with pytest.raises(UserError, match="without a --token of at least 16 characters"):
        serve(tmp_path, host="0.0.0.0", token=token, browser=False)
