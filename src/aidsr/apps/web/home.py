"""Home: all runs at a glance, searched, opened, thrown away and taken back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from nicegui import app, ui

from aidsr.apps.web.frame import frame
from aidsr.apps.web.launch import DEMO, launch
from aidsr.apps.web.live import as_action, live, working
from aidsr.apps.web.site import RunView, Site
from aidsr.apps.web.studies_panel import studies_panel
from aidsr.apps.web.widgets import badge, box, button, file_address, image, text
from aidsr.core.errors import UserError
from aidsr.core.formatting import format_cost
from aidsr.runs import Run

_COLUMNS = ("", "run", "model", "state", "designs", "stable", "valid", "successful", "cost", "started", "")
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
    of: int
    search: str
    trashed: str


def add_home(site: Site) -> None:
    """Answer at /."""

    @ui.page("/")
    def home() -> None:
        kept = app.storage.user
        with frame(""):
            with box("row apart"):
                text("Runs", tag="h1")
                field = ui.input(placeholder="Search: task, words, model, state").props("outlined dense clearable")
                field.bind_value(kept, "search")
                field.props.update({"data-search": "yes", "aria-label": "Search runs", "style": "width: 320px"})
                with field.add_slot("append"):
                    text("/", tag="kbd")
            look = live(
                lambda: _read(site, str(kept.get("search") or ""), str(kept.get("trashed") or "")),
                lambda shown: _table(site, shown),
            )
            field.on_value_change(look)
            studies_panel(site)


def _read(site: Site, search: str, trashed: str) -> _Shown:
    rows = []
    for one in site.library.runs():
        try:
            rows.append(_Row(one.path.name, site.view(one)))
        except UserError as error:
            rows.append(_Row(one.path.name, None, str(error)))
    words = search.lower().split()
    matching = tuple(row for row in rows if all(word in _searched(row) for word in words))
    return _Shown(matching, len(rows), search, trashed)


def _searched(row: _Row) -> str:
    if row.view is None:
        return row.name.lower()
    record = row.view.status.record
    names = " ".join(design.status.concept for design in row.view.designs)
    return " ".join((row.name, record.task, record.objective, record.config.model, row.view.shown, names)).lower()


def _table(site: Site, shown: _Shown) -> None:
    if shown.trashed:
        _undo(site, shown.trashed)
    if not shown.of:
        _nothing_yet(site)
        return
    if not shown.rows:
        with box("sheet empty"):
            text(f"None of {shown.of} runs matches “{shown.search}”.", "soft")
        return
    with box("sheet flush scroll"), box("list open", "table"):
        with box(tag="thead"), box(tag="tr"):
            for column in _COLUMNS:
                text(column, "num" if column in _NUMBERS else "", "th")
        with box(tag="tbody"):
            for row in shown.rows:
                with box(tag="tr"):
                    _cells(site, row)


def _cells(site: Site, row: _Row) -> None:
    if row.view is None:
        text("", tag="td")
        with box(tag="td", colspan="9"), box("stack tight"):
            text(row.name, "mono")
            text(row.complaint, "small bad")
        _delete(site, row.name)
        return
    view, record = row.view, row.view.status.record
    with box(tag="td"):
        picture = next((design.picture for design in view.designs if design.picture), "")
        image(file_address(row.name, picture), "", "thumb")
    with box(tag="td", style="min-width: 220px"), box("stack tight"):
        ui.link(view.title, f"/run/{row.name}").classes("cover")
        text(record.objective if record.task else row.name, "small soft clamp")
    text(record.config.model, "mono", "td")
    with box(tag="td"):
        badge(view.shown)
    total = len(view.designs)
    text(f"{view.status.approved} of {total or record.config.concepts} approved", "num", "td")
    text(str(sum(bool(design.status.stable) for design in view.designs)) if total else "–", "num", "td")
    trained = any(design.trained for design in view.designs)
    for count in (sum(one.valid for one in view.designs), sum(one.successful for one in view.designs)):
        text(str(count) if trained else "–", "num", "td")
    text(format_cost(view.status.usage), "num", "td")
    with box(tag="td"), box("stack tight small soft numbers"):
        text(record.started[:10], "line")
        text(record.started[11:16])
    _delete(site, row.name)


def _delete(site: Site, name: str) -> None:
    def trash() -> None:
        site.trash(name)
        app.storage.user["trashed"] = name

    with box(tag="td"):
        button("", as_action(trash), "bare", "delete_outline", f"Delete {name}").classes("above")


def _undo(site: Site, name: str) -> None:
    def restore() -> None:
        site.library.restore(name)
        app.storage.user["trashed"] = ""

    def leave() -> None:
        app.storage.user["trashed"] = ""

    with box("notice", role="status"), box("row apart"):
        text(f"{name} was moved to the trash.")
        with box("row"):
            button("Undo", as_action(restore), "quiet", "undo")
            button("", as_action(leave), "bare", "close", "Leave it there")


def _nothing_yet(site: Site) -> None:
    with box("sheet empty"):
        text("No runs yet", tag="h2")
        text(
            "Say what a robot should do and where. A team of four roles designs tendon-driven continuum robots for it; "
            "every robot is driven in simulation, what is physically wrong is measured and repaired, and you decide "
            "what is worth training. Everything is kept in one folder for each run.",
            "soft",
            "p",
        )
        with box("row"):
            demo = button(
                "Try it: three robots that push a button", lambda: working(demo, _demo(site), _open), "primary"
            )
            button("Set up a run", lambda: ui.navigate.to("/new"))
        text("The demonstration is done by built-in rules in about half a minute: no key, nothing paid.", "small soft")


def _demo(site: Site) -> Callable[[], Run]:
    return lambda: launch(site, DEMO)


def _open(run: Run) -> None:
    ui.navigate.to(f"/run/{run.path.name}")
