"""What keeps the page from being served."""

import socket
from pathlib import Path

import pytest

from aidsr.apps.web.server import serve
from aidsr.core.errors import UserError


def test_a_port_that_is_taken_is_said_in_a_sentence(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(UserError, match=rf"cannot listen on port {port} of 127\.0\.0\.1: .*--port"):
            serve(tmp_path, port=port, browser=False)


@pytest.mark.parametrize("token", ["", "short"])
def test_others_reach_the_page_only_with_a_long_token(tmp_path: Path, token: str) -> None:
    with pytest.raises(UserError, match="without a --token of at least 16 characters"):
        serve(tmp_path, host="0.0.0.0", token=token, browser=False)
