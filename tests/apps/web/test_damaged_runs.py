"""Runs in which one file is damaged: pages and `aidsr show` end in a sentence or in what is left, never in a bug."""

import shutil
from collections.abc import Iterator
from itertools import cycle
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest
from browser import Server
from made import made_run

from aidsr.apps.cli import main

DAMAGES = {"halved": lambda content: content[: len(content) // 2], "empty": lambda _: b"", "list": lambda _: b"[]",
           "object": lambda _: b"{}", "binary": lambda _: bytes(range(256))}  # fmt: skip
GONE = "gone"


@pytest.fixture(scope="module")
def damaged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of runs, three for each file, named by it and what was done: damaged in two ways, by turns, and gone."""
    made = made_run(tmp_path_factory.mktemp("whole"), designs=1).path
    runs = tmp_path_factory.mktemp("damaged") / "runs"
    files = sorted(each for each in made.rglob("*") if each.is_file())
    ways = cycle(DAMAGES)
    for file in files:
        place = file.relative_to(made)
        for damage in (next(ways), next(ways), GONE):
            copy = Path(shutil.copytree(made, runs / f"{'-'.join(place.parts)}_{damage}"))
            if damage == GONE:
                (copy / place).unlink()
            else:
                (copy / place).write_bytes(DAMAGES[damage](file.read_bytes()))
    return runs


@pytest.fixture
def server(damaged: Path) -> Iterator[Server]:
    with Server.over(damaged) as server:
        yield server


def test_every_page_of_a_damaged_run_answers(damaged: Path, server: Server) -> None:
    pages = ["/", "/designs", *(f"/run/{run.name}{tail}" for run in damaged.iterdir() for tail in ("", "/1"))]
    assert len(pages) > 100
    faults = {}
    for page in pages:
        try:
            with urlopen(server.address(page), timeout=60) as answer:
                answer.read()
        except HTTPError as error:
            faults[page] = error.code
    assert not {page: code for page, code in faults.items() if code >= 500}


def test_a_damaged_run_is_shown_or_refused_in_a_sentence(damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for run in sorted(damaged.iterdir()):
        with pytest.raises(SystemExit) as ended:
            main(["show", str(run)])
        said = capsys.readouterr().err
        assert ended.value.code in (0, 2), run.name
        assert "Traceback" not in said, run.name
        assert ended.value.code == 0 or said.count("aidsr: ") == 1, run.name
