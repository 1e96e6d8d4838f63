"""What the tests in a browser share."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from browser import Server, chromium, close_browsers
from made import made_run
from robots import arm

from aidsr.runs import Run


@pytest.fixture(scope="session", autouse=True)
def _browsers() -> Iterator[None]:
    """The browsers stay open from test to test."""
    yield
    close_browsers()


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """Folder of the runs; the test is skipped where there is no browser."""
    chromium()
    return tmp_path / "runs"


@pytest.fixture
def server(runs: Path) -> Iterator[Server]:
    """`aidsr web` over that folder."""
    with Server.over(runs) as server:
        yield server


@pytest.fixture
def arm_run(runs: Path) -> Run:
    """A run with one design, whose scene is an arm that can be seen and moved."""
    run = made_run(runs, designs=1)
    run.design(1).iteration(2).scene.xml.path.write_text(arm())
    return run
