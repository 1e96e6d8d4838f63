"""Building blocks of pages. Text written by models and people is only shown as text, never as HTML."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal

from nicegui import ui
from nicegui.elements.mixins.text_element import TextElement

from aidsr.core.artifacts import Fault
from aidsr.core.calls import Usage
from aidsr.core.formatting import counted, format_cost, format_fault, format_tokens_in_thousands
from aidsr.runs.stages import IterationStages

Look = Literal["primary", "quiet", "bare", "danger"]
_SHORT = {"robot": "robot", "robot stable": "stable?", "scene": "scene", "scene stable": "stable?", "judged": "judged"}


@contextmanager
def box(classes: str = "", tag: str = "div", **attributes: str) -> Iterator[ui.element]:
    """Open an element; an underscore in the name of an attribute stands for a hyphen."""
    element = ui.element(tag).classes(classes)
    for name, value in attributes.items():
        element.props[name.replace("_", "-")] = value
    with element:
        yield element


def text(content: str, classes: str = "", tag: str = "span") -> ui.element:
    """Show text literally, whatever it contains."""
    return TextElement(tag=tag, text=content).classes(classes)


def long_text(content: str, name: str, classes: str = "") -> None:
    """Show lines literally in an element that scrolls, also by keyboard; `name` is its label for screen readers."""
    shown = text(content, f"text {classes}", "pre")
    shown.props.update({"tabindex": "0", "role": "group", "aria-label": name})


def button(
    content: str, act: Callable[..., Any], look: Look = "quiet", icon: str | None = None, hint: str = ""
) -> ui.button:
    """Show a button; if it has no text, the hint is also its accessible name."""
    element = ui.button(content, icon=icon, color=None, on_click=act).props("unelevated").classes(look)
    if hint:
        with element:
            shown = ui.tooltip(hint)
        # hidden by a click, since it would cover an error below the button
        element.on("click", js_handler=f"() => getElement({shown.id})?.hide()")
    if hint and not content:
        element.props["aria-label"] = hint
    return element


def stop_button(act: Callable[..., Any], *, is_stopping: bool, hint: str = "") -> None:
    """Show the button that stops a process, or that it is stopping; see `Processes.is_stopping`."""
    if is_stopping:
        text("Stopping…", "soft")
    else:
        button("Stop", act, "danger", "stop", hint)


def image(address: str, what: str, classes: str = "shot") -> None:
    """Show a picture, or a placeholder if the address is empty."""
    if not address:
        text("no picture yet" if "shot" in classes else "", f"{classes} none")
        return
    with box(classes, "img", src=address, alt=what, loading="lazy"):
        pass


def fault_found(fault: Fault) -> None:
    """Show a fault: its code, the elements it names, its description, its likely cause and its cure."""
    with box(f"fault {fault.severity}"):
        with box("row"):
            text(fault.code.replace("_", " "), tag="h3")
            for name in fault.names[:6]:
                text(name, "chip")
            if len(fault.names) > 6:
                text(f"and {len(fault.names) - 6} more", "small soft")
        text(format_fault(fault) + (f", line {fault.line}" if fault.line else ""), "", "p")
        if fault.likely_cause or fault.cure:
            content = (content.rstrip(".") for content in (fault.likely_cause, fault.cure) if content)
            text(" ".join(f"{one[0].upper()}{one[1:]}." for one in content), "small soft", "p")


def badge(state: str, warnings: int = 0) -> None:
    """Show a state; for an approved design also the number of warnings of the validator."""
    words = state.replace("_", " ")
    if state == "approved" and warnings:
        text(f"{words}, {counted(warnings, 'warning')}", "badge warned")
    else:
        text(words, f"badge {state}")


def notice(content: str, kind: Literal["", "bad", "wait", "good"] = "") -> None:
    """Show a prominent message."""
    with box(f"notice {kind}", role="alert" if kind == "bad" else "status"):
        text(content, "pre")


def fact(key: str, value: str) -> None:
    """Show one value with its name."""
    with box():
        text(key, "key")
        text(value, "value")


def points(sentences: Iterable[str], classes: str = "") -> None:
    """Show sentences as a list."""
    with box(f"plain {classes}", "ul"):
        for sentence in sentences:
            text(sentence, tag="li")


def clock(since: str) -> None:
    """Show the time since a moment, given in ISO 8601; it counts up in the browser."""
    with box("numbers", data_since=since, tag="time"):
        pass


def choice(act: Callable[[], Any], *, chosen: bool) -> ui.element:
    """Return one option of a radio group, to be filled by the caller."""
    element = ui.element("button").classes("choice").on("click", act)
    element.props.update({"type": "button", "role": "radio", "aria-checked": "true" if chosen else "false"})
    return element


def usage_facts(usage: Usage) -> None:
    """Show the cost, calls and tokens of a run or a design."""
    fact("cost", format_cost(usage))
    if usage.calls:
        fact("calls", str(usage.calls))
        fact("tokens", format_tokens_in_thousands(usage))


def label_cells(row: ui.element, columns: Sequence[str]) -> None:
    """Label the cells of a row with their columns, for narrow screens; a cell with an empty column gets no label."""
    for cell, column in zip(row.default_slot.children, columns, strict=False):
        if column:
            cell.props["data-label"] = column


def strip(iterations: Iterable[IterationStages], open_at: Callable[[int], str], *, at_work: bool = True) -> None:
    """Show iterations as rows of stages: robot, stable?, scene, stable?, judged, and perhaps tried and decision.

    Args:
        iterations: The iterations.
        open_at: Returns the address of an iteration, by its number.
        at_work: Whether a process works on the design; if not, a stage that its files call running is shown as stopped.
    """
    with box("strip"):
        before = 1
        for iteration in iterations:
            if iteration.round != before:
                before = iteration.round
                text(f"round {iteration.round}, your request: {iteration.asked}", "round")
            with box("attempt", style=f"--stages: {len(iteration.stages)}"):
                ui.link(str(iteration.number), open_at(iteration.number)).classes("n").props["aria-label"] = (
                    f"iteration {iteration.number}"
                )
                for stage in iteration.stages:
                    left = stage.mark == "doing" and not at_work
                    said, mark = ("stopped", "done") if left else (stage.text, stage.mark)
                    shown = text(said or _SHORT.get(stage.name, stage.name), f"stage {mark}")
                    shown.props["title"] = f"{stage.name}: {said or 'not yet'}"
