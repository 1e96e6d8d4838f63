"""The log of a run, newest first: events as sentences, calls with their prompt and reply in expandable sections."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from nicegui import run as background
from nicegui import ui

from aidsr.apps.web.call_chart import ChartedCall, call_chart_svg
from aidsr.apps.web.mjcf_text import difference
from aidsr.apps.web.widgets import box, long_text, text
from aidsr.core.calls import CallRecord
from aidsr.core.errors import UserError
from aidsr.core.formatting import format_cost, format_tokens_in_thousands
from aidsr.runs import Run, read_events
from aidsr.runs.event_text import sentence
from aidsr.runs.files import JsonFile


@dataclass(frozen=True)
class Entry:
    """One line of the log."""

    time: str
    design: int
    """Number of the design; 0 for the run itself."""
    iteration: int | None
    line: str
    call: CallRecord | None = None

    def has(self, words: Sequence[str]) -> bool:
        """Whether each of the words, given in lower case, is in the line, or in the prompt or reply of its call."""
        if not words:
            return True
        texts = [self.line]
        if self.call is not None:
            texts += [self.call.reply, *(message.text for message in self.call.question.messages)]
        found = "\n".join(texts).lower()
        return all(word in found for word in words)


@dataclass
class History:
    """Reader of the new log entries of a run; call files never change and are read once."""

    run: Run
    design: int | None = None
    """Number of the design to read, 0 for the run itself; None for everything."""
    _events: dict[Path, int] = field(default_factory=dict)
    """Number of events already returned, by log file."""
    _calls: set[Path] = field(default_factory=set)

    def news(self) -> tuple[Entry, ...]:
        """Return the entries that are new since the last call, the oldest first.

        Raises:
            UserError: A file of the run is damaged.
        """
        logs = {0: self.run.events} | {one.number: one.events for one in self.run.designs}
        wanted = {number: log for number, log in logs.items() if self.design in (None, number)}
        found = [entry for number, log in wanted.items() for entry in self._new_events(number, log)]
        found += [entry for number in wanted for entry in self._new_calls(number)]
        return tuple(sorted(found, key=lambda entry: _moment(entry.time)))

    def _new_events(self, number: int, log: Path) -> Iterator[Entry]:
        events = read_events(log)
        returned = self._events.get(log, 0)
        self._events[log] = len(events)
        for event in events[returned:]:
            line = sentence(event)
            if line:
                yield Entry(event.time, number, getattr(event, "iteration", None), line)

    def _new_calls(self, number: int) -> Iterator[Entry]:
        home = self.run.design(number).path if number else self.run.path
        pattern = "[0-9]*/calls/*.json" if number else "calls/*.json"
        for path in sorted(set(home.glob(pattern)) - self._calls):
            record = JsonFile(path, CallRecord).read()
            if record is not None:
                self._calls.add(path)
                iteration = int(path.parent.parent.name) if number else None
                yield Entry(record.started, number, iteration, _summary(record), record)


def conversation(run: Run, design: int | None = None) -> None:
    """Show the log of a run or of one design, and keep it up to date."""
    history = History(run, design)
    trouble = ui.label("").classes("notice bad")
    trouble.set_visibility(False)
    wanted = ui.input(placeholder="Search: prompts, replies, events").props("outlined dense clearable debounce=300")
    wanted.props.update({"aria-label": "Search the log", "style": "max-width: 420px"})
    chart = ui.html("", sanitize=False).classes("calls full")
    with box("log") as lines:
        pass
    shown: list[tuple[Entry, ui.element]] = []
    latest: dict[tuple[int, str], CallRecord] = {}
    """The newest call of each design and role."""

    def add(entries: tuple[Entry, ...]) -> None:
        words = _words(wanted.value)
        for entry in entries:
            before = None
            if entry.call is not None:
                asked = entry.design, entry.call.question.role
                before, latest[asked] = latest.get(asked), entry.call
            with lines:
                line = _line(entry, before)
            line.move(target_index=0)
            line.set_visibility(entry.has(words))
            shown.append((entry, line))
        if any(entry.call for entry in entries):
            calls = [ChartedCall(one.call, one.line, f"#c{line.id}") for one, line in shown if one.call]
            chart.content = call_chart_svg(calls)

    def search() -> None:
        words = _words(wanted.value)
        for entry, line in shown:
            line.set_visibility(entry.has(words))

    wanted.on_value_change(search)

    def news() -> tuple[Entry, ...] | str:
        try:
            return history.news()
        except UserError as error:
            return str(error)

    async def look() -> None:
        take(await background.io_bound(news))

    def take(found: tuple[Entry, ...] | str | None) -> None:
        if found is None or lines.is_deleted:
            return
        trouble.set_visibility(isinstance(found, str))
        if isinstance(found, str):
            trouble.text = found
        else:
            add(found)

    take(news())
    ui.timer(1.0, look, immediate=False)


def _words(typed: object) -> list[str]:
    return str(typed or "").lower().split()


def _line(entry: Entry, before: CallRecord | None) -> ui.element:
    """Show an entry; `before` is the previous call of the same design and role."""
    with box("entry") as line:
        text(entry.time[11:19], "when")
        place = f"design {entry.design}" if entry.design else "run"
        text(place + (f" · {entry.iteration}" if entry.iteration else ""), "who")
        if entry.call is None:
            text(entry.line)
        else:
            with box("stack tight"):
                why = _why_again(entry.call)
                if why:
                    text(f"the previous reply was rejected: {why}", "small wait clamp", "p")
                _call(entry.line, entry.call, before)
    return line


def _call(line: str, call: CallRecord, before: CallRecord | None) -> None:
    """Show a call; its prompt and reply are long, so they are sent to the browser only when they are expanded."""
    with ui.expansion(line).props("dense dense-toggle switch-toggle-side").classes("full") as fold:
        pass

    def unfold(*, is_open: bool) -> None:
        if not is_open or fold.default_slot.children:
            return
        with fold:
            if before is not None:
                _prompt_difference(before, call)
            for message in call.question.messages:
                text(message.role, "label")
                long_text(message.text, "prompt")
            text("reply", "label")
            long_text(call.reply, "reply")
            if call.finish != "stop":
                text(f"The reply ended early: {call.finish}.", "small bad", "p")
            for attempt in call.failed_attempts:
                text(f"failed attempt: {attempt.error}", "small bad", "p")

    fold.on_value_change(lambda event: partial(unfold, is_open=bool(event.value))())


def _prompt_difference(before: CallRecord, call: CallRecord) -> None:
    """Show the differences from the previous prompt of the same role, in an expandable section."""
    with ui.expansion("Changes from the previous prompt of this role").props(
        "dense dense-toggle switch-toggle-side"
    ) as fold:
        html = difference(_prompt(before), _prompt(call))
        if not html:
            text("No changes.", "soft")
            return
        shown = ui.html(html, sanitize=False).classes("code prose full")  # safe: all text is escaped
        shown.props.update({"tabindex": "0", "role": "region", "aria-label": "changes between the prompts"})
    fold.classes("full")


def _prompt(call: CallRecord) -> str:
    return "\n".join(f"[{message.role}]\n{message.text}" for message in call.question.messages)


def _why_again(call: CallRecord) -> str:
    """Return why the previous reply of the role was rejected; empty for a first prompt."""
    messages = call.question.messages
    return messages[-1].text if len(messages) > 1 and messages[-2].role == "assistant" else ""


def _summary(record: CallRecord) -> str:
    cost = f", {format_cost(record.usage)}" if record.usage.cost_usd else ""
    ended = "" if record.finish == "stop" else f", ended early: {record.finish}"
    role = {"integrator": "Scene Integrator"}.get(record.question.role, record.question.role.capitalize())
    return (
        f"{role} called {record.model}: {format_tokens_in_thousands(record.usage)} tokens in "
        f"{record.usage.latency_s:.1f} s{cost}{ended}"
    )


def _moment(time: str) -> float:
    from datetime import datetime

    try:
        return datetime.fromisoformat(time).timestamp()
    except ValueError:
        return 0.0
