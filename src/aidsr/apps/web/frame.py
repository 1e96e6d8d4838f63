"""The frame of every page: header, width, light and dark colours."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from nicegui import app, ui

from aidsr.apps.web.activities import Activity
from aidsr.apps.web.live import live
from aidsr.apps.web.site import Site
from aidsr.apps.web.widgets import box, text

ASSETS = Path(__file__).parent / "assets"
_HEAD = '<link rel="stylesheet" href="/assets/web.css"><script src="/assets/web.js" defer></script>'
_THEMES = {"auto": (None, "brightness_auto"), "light": (False, "light_mode"), "dark": (True, "dark_mode")}


@contextmanager
def frame(title: str, *way: tuple[str, str], site: Site | None = None, narrow: bool = False) -> Iterator[None]:
    """Open a page: add its header, and enter the element of its content.

    Args:
        title: Title of the page.
        way: Text and address of each page above it, for the breadcrumb.
        site: Site whose activities the header counts; None to leave the count out.
        narrow: Whether to limit the width so that text is easy to read.
    """
    ui.page_title(f"{title} · AID-SR" if title else "AID-SR")
    ui.add_head_html(_HEAD)
    ui.colors(primary="#1c6770", negative="#a23a2c", positive="#27704a", warning="#80590a")
    theme = app.storage.user.get("theme", "auto")
    dark = ui.dark_mode(_THEMES[theme][0] if theme in _THEMES else None)
    skip = ui.link("Skip to the content", "#content").classes("skip")
    skip.props["tabindex"] = "0"
    with ui.element("header").classes("top"):
        ui.link("AID-SR", "/").classes("brand")
        with ui.element("nav").props('aria-label="breadcrumb"'):
            for text, address in way:
                ui.label("/").classes("sep")
                ui.link(text, address)
            if title:
                ui.label("/").classes("sep")
                ui.label(title)
        if site is not None:
            ui.link("Designs", "/designs").classes("hide-narrow")
            live(site.activities.current, _activity_link, every_s=2.0, first=site.activities.latest)
        _theme_button(dark)
        new = ui.button("New run", icon="add", color=None, on_click=lambda: ui.navigate.to("/new"))
        new.props("unelevated").classes("primary").tooltip("shortcut: n")
    main = ui.element("div").classes("page narrow" if narrow else "page")
    main.props["id"] = "content"
    with main:
        yield


def _activity_link(activities: tuple[Activity, ...]) -> None:
    """Show how many activities run and wait; web.js also shows those that wait in the page's title and icon."""
    awaited = [each for each in activities if each.waits]
    waiting = len(awaited)
    link = ui.link("" if awaited else "Activity", "/work").classes("work-link")
    link.props["data-awaited"] = str(waiting)
    if awaited:
        link.props["title"] = "\n".join(f"{each.title}: {each.doing}" for each in awaited)
        with link, box(tag="span"):  # a phone shows only the middle; a screen reader reads all
            text("Activity: ", "unseen-narrow")
            text(f"{waiting} waiting")
            text(" for you", "unseen-narrow")
    running = len(activities) - waiting
    if running:
        with link:
            text(str(running), "badge running").props["aria-label"] = f"{running} running"


def _theme_button(dark: ui.dark_mode) -> None:
    theme = app.storage.user.get("theme", "auto")
    button = ui.button(icon=_THEMES.get(theme, _THEMES["auto"])[1], color=None).props("flat").classes("bare")
    button.props["aria-label"] = "theme: system, light or dark"
    button.tooltip("theme: system, light or dark")

    def turn() -> None:
        names = list(_THEMES)
        now = app.storage.user.get("theme", "auto")
        after = names[(names.index(now) + 1) % len(names)] if now in names else "light"
        app.storage.user["theme"] = after
        dark.value, icon = _THEMES[after]
        button.props["icon"] = icon

    button.on_click(turn)
