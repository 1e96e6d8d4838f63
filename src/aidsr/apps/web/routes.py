"""Files over HTTP: pictures and videos of runs, downloads, archives, assembly sheets, reports, pictures of tasks."""

from __future__ import annotations

import hashlib
import io
import threading
import zipfile
from functools import lru_cache
from pathlib import Path
from urllib.parse import quote

from fastapi import APIRouter, HTTPException
from fastapi.responses import FileResponse, Response

from aidsr.apps.web.site import Site
from aidsr.core.errors import AidsrError, UserError
from aidsr.fabrication.schema import MARK

_SHOWN = {".png": "image/png", ".mp4": "video/mp4"}
_DOWNLOADED = frozenset({".xml", ".json", ".jsonl", ".csv", ".html", ".zip", ".stl", ".3mf"})
"""File types that are downloaded and never rendered in the browser: an HTML or XML file of a run could carry a
script."""
_ALONE = {
    "content-security-policy": "sandbox; default-src 'none'; img-src data:; style-src 'unsafe-inline'",
    "cache-control": "no-cache",
}
"""Headers for a whole HTML page from a folder: it is displayed, but can neither run scripts nor send requests."""
_PICTURE_PX = (480, 320)
_THUMBNAIL_PX = (184, 138)
"""Twice the size shown in a list, for high-resolution screens."""


def routes(site: Site) -> APIRouter:
    """Return the routes that serve files."""
    router = APIRouter()
    _to_look_at(router, site)
    _to_keep(router, site)
    return router


def _to_look_at(router: APIRouter, site: Site) -> None:
    """Add the routes of files that a browser displays."""
    drawing = threading.Lock()

    @router.get("/files/{name}/{path:path}")
    def file(name: str, path: str) -> FileResponse:
        found = _inside(site, name, path)
        if found.suffix in _SHOWN:
            # a picture of a run never changes; videos of a training may be replaced
            kept = "private, max-age=3600" if found.suffix == ".png" else "no-cache"
            return FileResponse(found, media_type=_SHOWN[found.suffix], headers={"cache-control": kept})
        if found.suffix in _DOWNLOADED:
            return FileResponse(found, media_type="application/octet-stream", filename=found.name)
        raise HTTPException(404)

    @router.get("/thumbnails/{name}/{path:path}")
    def thumbnail(name: str, path: str) -> Response:
        found = _inside(site, name, path)
        if found.suffix != ".png":
            raise HTTPException(404)
        small = _thumbnail(str(found), found.stat().st_mtime_ns)
        return Response(small, media_type="image/webp", headers={"cache-control": "private, max-age=3600"})

    @router.get("/sheet/{name}/{number}")
    def sheet(name: str, number: int) -> FileResponse:
        page = _inside(site, name, f"designs/{number}/export/sheet.html")
        return FileResponse(page, media_type="text/html", headers=_ALONE)

    @router.get("/studies/{key}/report")
    def report(key: str) -> FileResponse:
        try:
            page = site.studies.report(key)
        except UserError as error:
            raise HTTPException(404, str(error)) from None
        return FileResponse(page, media_type="text/html", headers=_ALONE)

    @router.get("/pictures/{category}/{task}.png")
    def task_picture(category: str, task: str) -> FileResponse:
        try:
            place = _picture_of(site, f"{category}/{task}", drawing)
        except AidsrError as error:
            raise HTTPException(404, str(error)) from None
        return FileResponse(place, media_type="image/png", headers={"cache-control": "max-age=3600"})


def _to_keep(router: APIRouter, site: Site) -> None:
    """Add the routes of archives to download."""

    @router.get("/download/{name}/{number}")
    def design(name: str, number: int) -> Response:
        try:
            run, folder = site.design(name, number)
        except UserError as error:
            raise HTTPException(404, str(error)) from None
        if not folder.path.resolve().is_relative_to(run.path.resolve()):
            raise HTTPException(404)
        return _archive(folder.path, f"{name}_design{number}")

    @router.get("/download/{name}/{number}/export")
    def export(name: str, number: int) -> Response:
        mark = _inside(site, name, f"designs/{number}/export/{MARK}")
        return _archive(mark.parent, f"{name}_design{number}_export")


@lru_cache(maxsize=1000)
def _thumbnail(path: str, _changed_ns: int) -> bytes:
    """Return a small copy of a PNG file as WebP; `_changed_ns` is only a part of the cache key."""
    from PIL import Image, UnidentifiedImageError

    buffer = io.BytesIO()
    try:
        with Image.open(path, formats=("PNG",)) as picture:
            picture.thumbnail(_THUMBNAIL_PX)
            picture.convert("RGB").save(buffer, "WEBP", quality=80)
    except (UnidentifiedImageError, OSError, Image.DecompressionBombError):
        raise HTTPException(404, "not a PNG picture") from None
    return buffer.getvalue()


def _picture_of(site: Site, task: str, drawing: threading.Lock) -> Path:
    """Return the picture of a task's environment, rendered on the first request.

    Raises:
        AidsrError: There is no such task, or it cannot be rendered.
    """
    from aidsr.render.pictures import picture
    from aidsr.render.view import View
    from aidsr.tasks import load_task

    environment = load_task(task).environment
    digest = hashlib.sha256(environment.encode()).hexdigest()[:16]
    place = site.own / "pictures" / f"{digest}_authored.png"
    with drawing:  # the page of a new run requests fourteen pictures at once
        if not place.exists():
            place.parent.mkdir(parents=True, exist_ok=True)
            drawn = picture(environment, width=_PICTURE_PX[0], height=_PICTURE_PX[1], view=View(authored=True))
            place.with_suffix(".tmp").write_bytes(drawn)
            place.with_suffix(".tmp").replace(place)
    return place


def _inside(site: Site, name: str, path: str) -> Path:
    """Return a file of a run, links followed; respond 404 if it is no file or lies outside the run."""
    try:
        run = site.run(name)
    except UserError as error:
        raise HTTPException(404, str(error)) from None
    if "\0" in path:
        raise HTTPException(404)
    found = (run.path / path).resolve()
    if _hidden(Path(path)) or not found.is_relative_to(run.path.resolve()) or not found.is_file():
        raise HTTPException(404)
    return found


def _hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)


def _archive(folder: Path, name: str) -> Response:
    """Return a folder as a ZIP file, without hidden files and without links to files outside the folder."""
    home, buffer = folder.resolve(), io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, strict_timestamps=False) as archive:
        for path in sorted(folder.rglob("*")):
            within = path.relative_to(folder)
            if path.is_file() and path.resolve().is_relative_to(home) and not _hidden(within):
                archive.write(path, Path(name) / within)
    headers = {"content-disposition": f"attachment; filename*=utf-8''{quote(name)}.zip"}
    return Response(buffer.getvalue(), media_type="application/zip", headers=headers)
