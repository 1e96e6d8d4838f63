"""Parts of a page that follow changes, and button actions that may raise a user error."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterable
from typing import Any, Generic, TypeVar
from weakref import WeakKeyDictionary

from nicegui import Client, background_tasks, run, ui

from aidsr.core.errors import AidsrError

Facts = TypeVar("Facts")
_REFRESHERS: WeakKeyDictionary[Client, list[Callable[[], Coroutine[Any, Any, None]]]] = WeakKeyDictionary()
"""Functions that refresh the live parts of each open page."""


def watch(
    read: Callable[[], Facts],
    show: Callable[[Facts | AidsrError], None],
    *,
    every_s: float = 1.0,
    first: Callable[[], Facts] | None = None,
) -> Callable[[], Coroutine[Any, Any, None]]:
    """Call `read` periodically, and `show` with its result whenever that has changed.

    Args:
        read: Returns values that can be compared; runs in a thread, so that a slow disk does not block the server.
        show: Called with the values, or with the error raised while reading.
        every_s: Interval between reads [s].
        first: Returns initial values at once, where `read` may be slow; they are shown until the first read, `every_s`
            later. None to call `read`.

    Returns:
        A function that refreshes at once, for use after an action.
    """
    known: list[Facts | AidsrError] = []

    def read_facts() -> Facts | AidsrError:
        try:
            return read()
        except AidsrError as error:
            return error

    async def refresh() -> None:
        facts = await run.io_bound(read_facts)
        if facts is None or timer.is_deleted:  # the server, or this part of a page, is closing
            return
        same = str(facts) == str(known[0]) if isinstance(facts, AidsrError) else facts == known[0]
        if not same:
            known[:] = [facts]
            show(facts)

    known.append(read_facts() if first is None else first())
    show(known[0])
    timer = ui.timer(every_s, refresh, immediate=False)
    _REFRESHERS.setdefault(ui.context.client, []).append(refresh)
    return refresh


def live(
    read: Callable[[], Facts],
    draw: Callable[[Facts], None],
    *,
    every_s: float = 1.0,
    first: Callable[[], Facts] | None = None,
) -> Callable[[], Coroutine[Any, Any, None]]:
    """Draw the values that were read, and redraw them whenever they change; see `watch`.

    Put buttons in a part whose values seldom change: a redrawn button loses the focus, and a click in progress.

    Args:
        read: See `watch`.
        draw: Creates elements from the values. A redraw discards typed text and opened elements unless they are stored
            elsewhere. An error that it raises is shown as a sentence, like one raised while reading.
        every_s: See `watch`.
        first: See `watch`.
    """
    place = ui.element("div").classes("live")

    def show(facts: Facts | AidsrError) -> None:
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

    return watch(read, show, every_s=every_s, first=first)


class Rows(Generic[Facts]):
    """Rows of the element that is open when this object is created; only rows that changed are redrawn.

    Args:
        draw: Fills a row from its values.
        tag: HTML tag of a row.
        classes: CSS classes of a row.
    """

    def __init__(self, draw: Callable[[Facts], None], tag: str = "tr", classes: str = "") -> None:
        self._home = ui.context.slot.parent
        self._draw, self._tag, self._classes = draw, tag, classes
        self._shown: dict[str, tuple[ui.element, Facts]] = {}

    def update(self, rows: Iterable[tuple[str, Facts]]) -> None:
        """Show these rows, each a key and its values, in this order."""
        wanted = dict(rows)
        for key in [key for key in self._shown if key not in wanted]:
            self._shown.pop(key)[0].delete()
        before = list(self._shown)
        for key, facts in wanted.items():
            known = self._shown.get(key)
            if known is not None and known[1] == facts:
                continue
            if known is None:
                with self._home:
                    row = ui.element(self._tag).classes(self._classes)
            else:
                row = known[0]
                row.clear()
            self._shown[key] = row, facts
            with row:
                self._draw(facts)
        if list(wanted) != [*(key for key in before if key in wanted), *(key for key in wanted if key not in before)]:
            for index, key in enumerate(wanted):
                self._shown[key][0].move(target_index=index)
        self._shown = {key: self._shown[key] for key in wanted}


def as_action(do: Callable[[], object]) -> Callable[[], None]:
    """Return a button's action that calls `do`, shows its error as a sentence, and refreshes the page at once."""

    def act() -> None:
        try:
            do()
        except AidsrError as error:
            show_error(error)
        else:
            clear_error()
        for refresh in _REFRESHERS.get(ui.context.client, ()):
            background_tasks.create(refresh())

    return act


def working(element: ui.button, do: Callable[[], Facts], then: Callable[[Facts], None]) -> None:
    """Call `do`, which takes seconds, in a thread, then `then` with its result.

    Until `do` has ended, the button shows that it is loading and ignores clicks. An error is shown beside the button.
    """
    if element.props.get("loading"):
        return
    element.props["loading"] = True

    async def act() -> None:
        try:
            made = await run.io_bound(do)
        except AidsrError as error:
            if not element.is_deleted and element.parent_slot is not None:
                with element.parent_slot:
                    show_error(error)
        else:
            if made is not None and not element.is_deleted and element.parent_slot is not None:
                with element.parent_slot:
                    clear_error()
                with element:
                    then(made)
        finally:
            element.props["loading"] = False

    background_tasks.create(act())


def show_error(error: AidsrError) -> None:
    """Show an error beside the clicked element until it is closed; it replaces the previous one."""
    clear_error()
    with ui.element("div").classes("notice bad trouble").props('role="alert"') as shown:
        ui.label(str(error))
        close = ui.button(icon="close", color=None, on_click=shown.delete).props("flat dense round size=sm")
        close.classes("bare").props["aria-label"] = "Close this message"


def clear_error() -> None:
    """Remove the error beside the clicked element."""
    for child in list(ui.context.slot.children):
        if "trouble" in child.classes:
            child.delete()
