"""Folders that the user of the web app may not read: the others are still listed, and each says what is wrong."""

from pathlib import Path

import pytest
from made import made_run
from nicegui.testing import User
from test_pages import visiting
from test_studies_panel import made_study, read

from aidsr.apps.web.site import Site
from aidsr.core.storage_errors import StorageError
from aidsr.runs import Library


@pytest.fixture
def closed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody may look into a folder lost+found; the tests may run as a user who may read everything."""
    look = Path.stat

    def stat(path: Path, *, follow_symlinks: bool = True) -> object:
        if path.parent.name == "lost+found":
            raise PermissionError(13, "Permission denied", str(path))
        return look(path, follow_symlinks=follow_symlinks)

    monkeypatch.setattr(Path, "stat", stat)


@pytest.mark.usefixtures("closed")
def test_a_folder_that_may_not_be_read_is_no_run_and_no_study(tmp_path: Path) -> None:
    run = made_run(tmp_path)
    made_study(tmp_path / "first")
    (tmp_path / "lost+found").mkdir()
    assert [one.name for one in Library(tmp_path).runs()] == [run.name]
    assert [view.key for view in read(Site.at(tmp_path).studies)] == ["first"]


@visiting
async def test_a_run_with_a_file_that_cannot_be_read_says_so_in_its_row(user: User, site: Site) -> None:
    made_run(site.library.path, name="Arm")
    for name in ("events.jsonl", "concepts.json", "designs/1/events.jsonl"):
        file = made_run(site.library.path, objective="Turn the knob.", task="").path / name
        file.unlink()
        file.mkdir()  # as unreadable for root as for anyone
    await user.open("/")
    await user.should_see("button pushing")
    await user.should_see("concepts.json: a folder stands where a file is needed")
    await user.should_see("events.jsonl: a folder stands where a file is needed")


def test_a_log_that_cannot_be_read_is_an_error_with_a_cure(tmp_path: Path) -> None:
    run = made_run(tmp_path)
    run.events.unlink()
    run.events.mkdir()
    with pytest.raises(StorageError, match=r"events\.jsonl: a folder stands where a file is needed; name a file"):
        Site.at(tmp_path).view(run)
