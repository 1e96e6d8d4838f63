"""Parts of a page that keep up with what happens, and actions that may raise a user error."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from nicegui import Client, background_tasks, run, ui

from aidsr.core.errors import AidsrError

Facts = TypeVar("Facts")
_REFRESHERS: WeakKeyDictionary[Client, list[Callable[[], Coroutine[Any, Any, None]]]] = WeakKeyDictionary()
"""Functions that refresh the live parts of each open page."""


def live(
    read: Callable[[], Facts], draw: Callable[[Facts], None], *, every_s: float = 1.0
) -> Callable[[], Coroutine[Any, Any, None]]:
    """Draw what was read, and redraw it whenever it changes.

    Args:
        read: Returns values that can be compared; runs in a thread, so that a slow disk does not block the server.
        draw: Makes elements of them; what a person opens or types must be remembered elsewhere. An error that it raises
            is shown as a sentence, like one raised while reading.
        every_s: Interval between reads [s].

    Returns:
        A function that refreshes at once, for after an action.
    """
    place = ui.element("div").classes("live")
    shown: list[Facts | AidsrError] = []

    def show(facts: Facts | AidsrError) -> None:
        shown[:] = [facts]
        place.clear()
        with place:
            try:
                if isinstance(facts, AidsrError):
                    raise facts
                draw(facts)
            except AidsrError as error:
                place.clear()
                with ui.element("div").classes("notice bad").props('role="alert"'):
                    ui.label(str(error))

    def read_facts() -> Facts | AidsrError:
        try:
            return read()
        except AidsrError as error:
            return error

    async def refresh() -> None:
        facts = await run.io_bound(read_facts)
        if facts is None or place.is_deleted:  # the server, or this page, is closing
            return
        same = str(facts) == str(shown[0]) if isinstance(facts, AidsrError) else facts == shown[0]
        if not same:
            show(facts)

    show(read_facts())
    ui.timer(every_s, refresh, immediate=False)
    _REFRESHERS.setdefault(ui.context.client, []).append(refresh)
    return refresh


def as_action(do: Callable[[], object]) -> Callable[[], None]:
    """Return the action of a button: an error is shown as a sentence, and the page is redrawn at once."""

    def act() -> None:
        try:
            do()
        except AidsrError as error:
            show_error(error)
        for refresh in _REFRESHERS.get(ui.context.client, ()):
            background_tasks.create(refresh())

    return act


def working(element: ui.button, do: Callable[[], Facts], then: Callable[[Facts], None]) -> None:
    """Do something that takes seconds in a thread; until it is done the button shows so, and ignores further clicks."""
    if element.props.get("loading"):
        return
    element.props["loading"] = True

    async def act() -> None:
        try:
            made = await run.io_bound(do)
        except AidsrError as error:
            with element:
                show_error(error)
        else:
            if made is not None and not element.is_deleted:
                with element:
                    then(made)
        finally:
            element.props["loading"] = False

    background_tasks.create(act())


def show_error(error: AidsrError) -> None:
    """Show a sentence until it is closed."""
    ui.notify(str(error), type="negative", multi_line=True, close_button="OK", timeout=0)
