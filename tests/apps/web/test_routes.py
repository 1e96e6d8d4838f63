"""Files over HTTP: what is given, what never is."""

import io
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient
from made import made_export, made_run

from aidsr.apps.web.routes import routes
from aidsr.apps.web.site import Site
from aidsr.runs import Run


@pytest.fixture
def run(tmp_path: Path) -> Run:
    (tmp_path / "secret.json").write_text("{}")
    return made_run(tmp_path / "runs", designs=1)


@pytest.fixture
def client(run: Run) -> Iterator[TestClient]:
    application = FastAPI()
    application.include_router(routes(Site.at(run.path.parent)))
    with TestClient(application) as client:
        yield client


def test_pictures_are_shown_and_documents_downloaded(client: TestClient, run: Run) -> None:
    home = f"/files/{run.path.name}/designs/1/02"
    assert client.get(f"{home}/preview.png").headers["content-type"] == "image/png"
    document = client.get(f"{home}/scene.xml")
    assert document.headers["content-type"] == "application/octet-stream"
    assert document.headers["content-disposition"].startswith("attachment")


@pytest.mark.parametrize(
    "path",
    [
        "../../secret.json", "..%2f..%2fsecret.json", "%2e%2e/%2e%2e/secret.json", "/etc/passwd", "%2fetc%2fpasswd",
        "designs/../../../secret.json", "..\\..\\secret.json", ".hidden.json",
        "designs", "nowhere.png", "x%00.png", "notes.txt",
    ],
)  # fmt: skip
def test_nothing_outside_a_run_is_given(client: TestClient, run: Run, path: str) -> None:
    (run.path / ".hidden.json").write_text("{}")
    (run.path / "notes.txt").write_text("of no kind that is given")
    assert client.get(f"/files/{run.path.name}/{path}").status_code == 404


@pytest.mark.parametrize("name", ["..", "%2e%2e", ".web", "nowhere", "..%2fruns"])
def test_only_runs_have_files(client: TestClient, name: str) -> None:
    assert client.get(f"/files/{name}/run.json").status_code == 404
    assert client.get(f"/download/{name}/1").status_code == 404


@pytest.mark.parametrize("name", ["link.json", "designs/1/stolen.json", "designs/7"])
def test_a_run_that_holds_a_link_is_given_to_nobody(client: TestClient, run: Run, name: str) -> None:
    (run.path / name).symlink_to(run.path.parents[1] / "secret.json")
    for address in ("/files/{}/designs/1/02/preview.png", f"/files/{{}}/{name}", "/download/{}/1", "/sheet/{}/1"):
        assert client.get(address.format(run.path.name)).status_code == 404


def test_a_design_is_one_archive(client: TestClient, run: Run) -> None:
    answer = client.get(f"/download/{run.path.name}/1")
    names = zipfile.ZipFile(io.BytesIO(answer.content)).namelist()
    assert f"{run.path.name}_design1/final.xml" in names
    assert f"{run.path.name}_design1/02/scene.xml" in names
    assert client.get(f"/download/{run.path.name}/7").status_code == 404


def test_an_archive_takes_old_files_and_any_name_and_nothing_hidden(client: TestClient, run: Run) -> None:
    renamed = Run(run.path.rename(run.path.with_name("Größe (neu)")))
    os.utime(renamed.design(1).final_scene.path, (0, 0))  # before a ZIP file's time begins
    hidden = renamed.design(1).path / ".hidden" / "x.json"
    hidden.parent.mkdir()
    hidden.write_text("{}")
    answer = client.get("/download/Größe (neu)/1")
    names = zipfile.ZipFile(io.BytesIO(answer.content)).namelist()
    assert "Größe (neu)_design1/final.xml" in names
    assert not [name for name in names if "hidden" in name]
    assert quote("Größe (neu)_design1.zip") in answer.headers["content-disposition"]


def test_a_task_has_a_picture_that_is_drawn_once(client: TestClient, run: Run) -> None:
    first = client.get("/pictures/reaching/button_pushing.png")
    assert first.content.startswith(b"\x89PNG")
    (kept,) = (run.path.parent / ".web" / "pictures").iterdir()
    kept.write_bytes(first.content + b"kept")
    assert client.get("/pictures/reaching/button_pushing.png").content.endswith(b"kept")
    assert client.get("/pictures/reaching/nothing.png").status_code == 404


def test_an_export_is_given_part_by_part_and_whole(client: TestClient, run: Run) -> None:
    name = run.path.name
    for address in (f"/download/{name}/1/export", f"/sheet/{name}/1"):
        assert client.get(address).status_code == 404
    made_export(run.design(1))
    part = client.get(f"/files/{name}/designs/1/export/parts/tip_x2.stl?v=2026")
    assert part.headers["content-type"] == "application/octet-stream"
    assert len(part.content) == 84 + 4 * 50
    names = zipfile.ZipFile(io.BytesIO(client.get(f"/download/{name}/1/export").content)).namelist()
    assert f"{name}_design1_export/parts/tip_x2.stl" in names
    assert f"{name}_design1_export/sheet.html" in names


def test_a_sheet_is_shown_where_it_can_do_no_harm(client: TestClient, run: Run) -> None:
    made_export(run.design(1))
    sheet = client.get(f"/sheet/{run.path.name}/1")
    assert "How to build it" in sheet.text
    assert sheet.headers["content-security-policy"].startswith("sandbox; default-src 'none'")
