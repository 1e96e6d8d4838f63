"""What the tests in a browser share."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from browser import Server, chromium


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """Folder of the runs; the test is skipped where there is no browser."""
    chromium()
    return tmp_path / "runs"


@pytest.fixture
def server(runs: Path) -> Iterator[Server]:
    """`aidsr web` over that folder."""
    server = Server.start(runs)
    yield server
    server.stop()
