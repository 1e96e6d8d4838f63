"""The frame of every page: head line, width, colours by day and by night."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from nicegui import app, ui

ASSETS = Path(__file__).parent / "assets"
_HEAD = '<link rel="stylesheet" href="/assets/web.css"><script src="/assets/web.js" defer></script>'
_THEMES = {"auto": (None, "brightness_auto"), "light": (False, "light_mode"), "dark": (True, "dark_mode")}


@contextmanager
def frame(title: str, *way: tuple[str, str], narrow: bool = False) -> Iterator[None]:
    """Open a page.

    Args:
        title: Of this page.
        way: Text and address of the pages above it.
        narrow: Keep to a width at which text is easily read.
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
        with ui.element("nav").props('aria-label="where you are"'):
            for text, address in way:
                ui.label("/").classes("sep")
                ui.link(text, address)
            if title:
                ui.label("/").classes("sep")
                ui.label(title)
        _theme_button(dark)
        new = ui.button("New run", icon="add", color=None, on_click=lambda: ui.navigate.to("/new"))
        new.props("unelevated").classes("primary").tooltip("key n")
    main = ui.element("div").classes("page narrow" if narrow else "page")
    main.props["id"] = "content"
    with main:
        yield


def _theme_button(dark: ui.dark_mode) -> None:
    theme = app.storage.user.get("theme", "auto")
    button = ui.button(icon=_THEMES.get(theme, _THEMES["auto"])[1], color=None).props("flat").classes("bare")
    button.props["aria-label"] = "colours: as the system, light, dark"
    button.tooltip("colours: as the system, light or dark")

    def turn() -> None:
        names = list(_THEMES)
        now = app.storage.user.get("theme", "auto")
        after = names[(names.index(now) + 1) % len(names)] if now in names else "light"
        app.storage.user["theme"] = after
        dark.value, icon = _THEMES[after]
        button.props["icon"] = icon

    button.on_click(turn)
