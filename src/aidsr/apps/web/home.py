"""The home page: list, search, open, delete and restore runs."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from functools import partial
from typing import Any

from nicegui import app, ui

from aidsr.apps.web.addresses import run_address, thumbnail_address
from aidsr.apps.web.frame import frame
from aidsr.apps.web.live import Rows, as_action, live, watch
from aidsr.apps.web.site import RunView, Site, model_in_words
from aidsr.apps.web.studies_panel import studies_panel
from aidsr.apps.web.welcome import welcome
from aidsr.apps.web.widgets import badge, box, button, image, notice, text
from aidsr.core.errors import AidsrError, UserError
from aidsr.core.formatting import format_cost
from aidsr.runs import Run
from aidsr.runs.library import refuse_link

_COLUMNS = ("picture", "run", "model", "state", "designs", "stable", "valid", "successful", "cost", "started", "delete")
_UNNAMED = frozenset({"picture", "delete"})
"""Columns whose heading is for screen readers only."""
_AT_FIRST = 40
"""Rows shown at first. Our choice: two screens; a browser takes a second for two hundred rows."""
_NUMBERS = frozenset({"designs", "stable", "valid", "successful", "cost"})


@dataclass(frozen=True)
class _Row:
    """A run in the table, or a folder that cannot be read."""

    name: str
    view: RunView | None
    complaint: str = ""


@dataclass(frozen=True)
class _Shown:
    rows: tuple[_Row, ...]
    matching: int
    of: int
    search: str


@dataclass
class _Filters:
    """Search text and maximum number of rows, as set by a person."""

    words: str | None
    most: int = _AT_FIRST


def add_home(site: Site) -> None:
    """Add the page at /."""

    @ui.page("/")
    def home(search: str = "") -> None:
        filters, kept = _Filters(search), app.storage.user
        with frame("", site=site):
            with box("row apart"):
                text("Runs", tag="h1")
                ui.link("Designs", "/designs").classes("only-narrow")
                field = ui.input(placeholder="Search task, objective, model, state").props("outlined dense clearable")
                field.bind_value(filters, "words")
                field.props.update({"data-search": "yes", "aria-label": "Search runs", "style": "width: 320px"})
                with field.add_slot("append"):
                    text("/", tag="kbd")
            live(lambda: str(kept.get("trashed") or ""), partial(_undo, site))
            look = _runs(site, filters)
            field.on_value_change(look)
            studies_panel(site)


def _runs(site: Site, filters: _Filters) -> Callable[[], Coroutine[Any, Any, None]]:
    """Show the runs that match the search, and return a function that refreshes them at once."""
    with box("live") as without:
        pass
    with box("sheet flush scroll") as sheet, box("list open runs", "table"):
        with box(tag="thead"), box(tag="tr"):
            for column in _COLUMNS:
                text(column, "unseen" if column in _UNNAMED else "num" if column in _NUMBERS else "", "th")
        with box(tag="tbody"):
            rows = Rows(partial(_cells, site))
    with box("row") as rest:
        said = ui.label().classes("small soft")
        more = button("Show more", lambda: None, "quiet", "expand_more")

    def show(found: _Shown | AidsrError) -> None:
        without.clear()
        there = found.rows if isinstance(found, _Shown) else ()
        sheet.set_visibility(bool(there))
        with without:
            if isinstance(found, AidsrError):
                notice(str(found), "bad")
            elif not found.of:
                welcome(site)
            elif not there:
                with box("sheet empty"):
                    text(f"None of {found.of} runs matches “{found.search}”.", "soft")
        rows.update((row.name, row) for row in there)
        if isinstance(found, _Shown):
            said.text = f"Showing the newest {len(there)} of {found.matching} runs"
            rest.set_visibility(len(there) < found.matching)

    look = watch(lambda: _read(site, filters), show)

    async def show_more() -> None:
        filters.most += 4 * _AT_FIRST
        await look()

    more.on_click(show_more)
    return look


def _read(site: Site, filters: _Filters) -> _Shown:
    """Return the newest runs that match; runs that are not shown are read only for a search."""
    runs, words = site.library.runs(), (filters.words or "").lower().split()
    if not words:
        return _Shown(tuple(_row(site, run) for run in runs[: filters.most]), len(runs), len(runs), "")
    rows = (_row(site, run) for run in runs)
    matching = [row for row in rows if all(word in _searched(row) for word in words)]
    return _Shown(tuple(matching[: filters.most]), len(matching), len(runs), filters.words or "")


def _row(site: Site, run: Run) -> _Row:
    try:
        refuse_link(run.path)
        return _Row(run.name, site.view(run))
    except UserError as error:
        return _Row(run.name, None, str(error))


def _searched(row: _Row) -> str:
    if row.view is None:
        return row.name.lower()
    record = row.view.status.record
    names = " ".join(design.status.concept for design in row.view.designs)
    return " ".join((row.name, record.task, record.objective, record.config.model, row.view.shown, names)).lower()


def _cells(site: Site, row: _Row) -> None:
    if row.view is None:
        text("", "picture", "td")
        with box("what", "td", colspan="9"), box("stack tight"):
            text(row.name, "mono")
            text(row.complaint, "small bad")
        _delete(site, row.name)
        return
    view, record = row.view, row.view.status.record
    with box("picture", "td"):
        picture = next((design.picture for design in view.designs if design.picture), "")
        image(thumbnail_address(row.name, picture), "", "thumb")
    with box("what", "td"), box("stack tight"):
        ui.link(view.title, run_address(row.name)).classes("cover")
        text(record.objective if record.task else row.name, "small soft clamp")
    text(model_in_words(record.config.model), "mono model", "td")
    with box("state", "td"), box("row"):
        badge(view.shown)
        for kind in sorted({job.kind for job in view.jobs}):
            badge(kind)
    total = len(view.designs)
    text(f"{view.status.approved} of {total or record.config.concepts} approved", "num", "td")
    text(str(sum(bool(design.status.stable) for design in view.designs)) if total else "–", "num", "td")
    evaluated = any(design.evaluated for design in view.designs)
    for count in (sum(one.valid for one in view.designs), sum(one.successful for one in view.designs)):
        text(str(count) if evaluated else "–", "num", "td")
    text(format_cost(view.status.usage), "num cost", "td")
    with box("when", "td"), box("stack tight small soft numbers"):
        text(record.started[:10], "line")
        text(record.started[11:16])
    _delete(site, row.name)


def _delete(site: Site, name: str) -> None:
    def trash() -> None:
        site.trash(name)
        app.storage.user["trashed"] = name

    with box("delete", "td"):
        button("", as_action(trash), "bare", "delete_outline", f"Delete {name}").classes("above")


def _undo(site: Site, name: str) -> None:
    if not name:
        return

    def restore() -> None:
        site.library.restore(name)
        app.storage.user["trashed"] = ""

    def leave() -> None:
        app.storage.user["trashed"] = ""

    with box("notice", role="status"), box("row apart"):
        text(f"{name} was moved to the trash.")
        with box("row"):
            button("Undo", as_action(restore), "quiet", "undo")
            button("", as_action(leave), "bare", "close", "Dismiss")
