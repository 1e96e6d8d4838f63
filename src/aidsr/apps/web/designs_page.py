"""All designs of all runs: sorted, filtered, grouped, plotted, and selected for comparison."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import Any
from urllib.parse import urlencode

from nicegui import ui

from aidsr.apps.web.addresses import design_address, thumbnail_address
from aidsr.apps.web.curve import scatter_svg
from aidsr.apps.web.frame import frame
from aidsr.apps.web.live import as_action, live
from aidsr.apps.web.site import DesignView, RunView, Site, model_in_words, state_of
from aidsr.apps.web.widgets import badge, box, button, image, label_cells, text
from aidsr.core.artifacts import Evaluation
from aidsr.core.errors import UserError
from aidsr.core.formatting import format_share, task_title
from aidsr.fabrication.schema import PartEntry
from aidsr.runs import DesignFolder
from aidsr.runs.compare import attempted
from aidsr.runs.files import JsonFile
from aidsr.runs.trainings import best_verdict, verdicts_of

MOST_COMPARED = 4
"""Maximum number of designs side by side. Our choice: as many views as fit a screen."""
_FILTERS = ("task", "family", "model", "state")
_COLUMNS: dict[str, Callable[[DesignRow], Any]] = {
    "design": lambda row: row.concept.lower(),
    "task": lambda row: row.task,
    "family": lambda row: row.family,
    "model": lambda row: row.model,
    "state": lambda row: row.state,
    "iterations": lambda row: row.iterations,
    "tokens": lambda row: row.tokens,
    "held-out success": lambda row: -1.0 if row.success is None else row.success,
    "started": lambda row: row.started,
}
_NUMBERS = frozenset({"iterations", "tokens", "held-out success"})


@dataclass(frozen=True)
class DesignRow:
    """A design in the table."""

    run: str
    number: int
    concept: str
    task: str
    family: str
    model: str
    state: str
    iterations: int
    tokens: int
    success: float | None
    """Share of held-out episodes in which its best policy succeeds; None where no policy was evaluated."""
    started: str
    picture: str
    warnings: int = 0
    """Number of warnings of the validator at the iteration that the design stands at."""
    amounts: tuple[tuple[str, float], ...] = ()
    """Names and values of quantities to plot its success against; empty for a design without an evaluated policy."""

    @property
    def key(self) -> str:
        """Its name in addresses, RUN/NUMBER."""
        return f"{self.run}/{self.number}"


@dataclass
class _Filters:
    """Filters, order and selection that a person chose."""

    task: str = ""
    family: str = ""
    model: str = ""
    state: str = ""
    group: str = ""
    against: str = ""
    """Quantity on the horizontal axis of the plot; empty for the first one available."""
    by: str = "started"
    falling: bool = True
    picked: tuple[str, ...] = ()
    refused: bool = False
    """Whether the last selection was refused because the maximum was reached."""


def add_designs_page(site: Site) -> None:
    """Add the page at /designs."""

    @ui.page("/designs")
    def designs_page() -> None:
        with frame("Designs", ("Runs", "/"), site=site):
            text("Designs", tag="h1")
            designs_to_pick(site)


def designs_to_pick(site: Site, picked: tuple[str, ...] = ()) -> None:
    """Show all designs of all runs, to be sorted, filtered, grouped and selected; `picked` are selected at first."""
    filters = _Filters(picked=picked)

    def act(**changes: Any) -> None:
        for name, value in changes.items():
            setattr(filters, name, value)

    choices = ui.element("div").classes("form")
    live(
        lambda: (bool(site.library.runs()), filters.picked, filters.refused),
        lambda facts: _compare_bar(*facts[1:], act) if facts[0] else None,
    )
    # the filters are part of the values read, so that a change of them redraws the table; the selection is left out
    look = live(
        lambda: (_read(site), replace(filters, picked=(), refused=False)), lambda facts: _draw(facts[0], filters, act)
    )

    with choices:
        for name in _FILTERS:
            offered = sorted({str(getattr(row, name)) for row in _read(site)} - {""})
            field = ui.select({"": "all", **{one: one for one in offered}}, value="", label=name)
            field.props("outlined dense").on_value_change(partial(_choose, act, name)).on_value_change(look)
        group = ui.select({"": "none", **{one: one for one in _FILTERS}}, value="", label="group by")
        group.props("outlined dense").on_value_change(partial(_choose, act, "group")).on_value_change(look)


def _choose(act: Callable[..., None], name: str, event: Any) -> None:
    act(**{name: event.value})


def _read(site: Site) -> tuple[DesignRow, ...]:
    rows = []
    for run in site.library.runs():
        try:
            view = site.view(run)
        except UserError:
            continue
        rows += [design_row(view, design, run.design(design.status.number)) for design in view.designs]
    return tuple(rows)


def design_row(view: RunView, design: DesignView, folder: DesignFolder) -> DesignRow:
    """Return a design as a row of the table."""
    status, record = design.status, view.status.record
    best: Evaluation | None = None
    amounts: tuple[tuple[str, float], ...] = ()
    if design.evaluated:
        best = best_verdict(verdicts_of(folder))
        amounts = tuple(_amounts(design, folder))
    return DesignRow(
        run=view.name,
        number=status.number,
        concept=status.concept,
        task=task_title(record.task) or view.title,
        family=status.family,
        model=record.config.model,
        state=state_of(view.shown, design),
        iterations=status.iteration,
        tokens=status.usage.input_tokens + status.usage.output_tokens,
        success=best.success_share if best else None,
        started=record.started,
        picture=design.picture,
        warnings=design.warnings,
        amounts=amounts,
    )


def _amounts(design: DesignView, folder: DesignFolder) -> Iterator[tuple[str, float]]:
    """Yield the known quantities of a design: tokens, actuators, moving mass and printed parts."""
    usage = design.status.usage
    if usage.calls:
        yield "tokens", usage.input_tokens + usage.output_tokens
    report = attempted(folder, design.status.stands_at).report if design.status.stands_at else None
    measured = report.measurements if report else {}
    for name, key, factor in (("actuators", "actuators", 1.0), ("moving mass [g]", "moving_mass_kg", 1000.0)):
        if measured.get(key) is not None:
            yield name, factor * float(measured[key])
    parts = JsonFile(folder.path / "export" / "parts.json", tuple[PartEntry, ...]).read()
    if parts:
        yield "printed parts", sum(part.copies for part in parts)


def _draw(rows: tuple[DesignRow, ...], filters: _Filters, act: Callable[..., None]) -> None:
    shown = [row for row in rows if all(getattr(filters, name) in ("", getattr(row, name)) for name in _FILTERS)]
    if not shown:
        with box("sheet empty"):
            text("No design matches." if rows else "There are no designs yet.", "soft")
        return
    shown.sort(key=_COLUMNS[filters.by], reverse=filters.falling)
    if filters.group:
        shown.sort(key=lambda row: str(getattr(row, filters.group)))
    grouped = groupby(shown, key=lambda row: str(getattr(row, filters.group)) if filters.group else "")
    with box("sheet flush scroll"), box("list designs fold", "table"):
        with box(tag="thead"), box(tag="tr"):
            text("compare", "unseen", "th")
            text("picture", "unseen", "th")
            for column in _COLUMNS:
                _heading(column, filters, act)
        for name, members in grouped:
            each = list(members)
            with box(tag="tbody"):
                if filters.group:
                    with box(tag="tr"), box("group", "th", colspan=str(len(_COLUMNS) + 2), scope="rowgroup"):
                        text(f"{name or 'none'}, {len(each)}")
                for row in each:
                    with box(tag="tr") as line:
                        _cells(row, filters, act)
                    label_cells(line, ("", "", "", *list(_COLUMNS)[1:]))
    _plot([row for row in shown if row.success is not None], filters, act)


def _plot(evaluated: list[DesignRow], filters: _Filters, act: Callable[..., None]) -> None:
    """Plot held-out success against a quantity that at least two designs have."""
    amounts = [dict(row.amounts) for row in evaluated]
    offered = [
        name
        for name in dict.fromkeys(name for each in amounts for name in each)
        if sum(name in each for each in amounts) > 1
    ]
    if not offered:
        return
    against = filters.against if filters.against in offered else offered[0]
    with box("sheet stack", "section", aria_label=f"success against {against}"):
        with box("row apart"):
            text("Held-out success against", tag="h2")
            choice = ui.toggle(offered, value=against).props("dense unelevated")
            choice.on_value_change(lambda event: as_action(partial(act, against=str(event.value)))())
        points = [
            (each[against], row.success or 0.0, f"{row.concept} ({row.task})")
            for row, each in zip(evaluated, amounts, strict=True)
            if against in each
        ]
        ui.html(scatter_svg(points, against), sanitize=False).classes("full")


def _heading(column: str, filters: _Filters, act: Callable[..., None]) -> None:
    def sort() -> None:
        act(by=column, falling=not filters.falling if filters.by == column else column in _NUMBERS)

    order = ("descending" if filters.falling else "ascending") if filters.by == column else "none"
    with box("num" if column in _NUMBERS else "", "th", aria_sort=order):
        arrow = {"descending": " ↓", "ascending": " ↑", "none": ""}[order]
        button(column + arrow, as_action(sort), "bare").classes("sort")


def _cells(row: DesignRow, filters: _Filters, act: Callable[..., None]) -> None:
    def pick(*, on: bool) -> None:
        others = tuple(one for one in filters.picked if one != row.key)
        full = on and len(others) == MOST_COMPARED
        if full:
            check.value = False
        act(picked=(*others, row.key) if on and not full else others, refused=full)

    with box(tag="td"):
        check = ui.checkbox(value=row.key in filters.picked)
        check.props["aria-label"] = f"compare {row.concept} of {row.task}"
        check.on_value_change(lambda event: as_action(partial(pick, on=bool(event.value)))())
    with box(tag="td"):
        image(thumbnail_address(row.run, row.picture), "", "thumb")
    with box("name", "td"):
        ui.link(f"{row.number}. {row.concept}", design_address(row.run, row.number))
    with box(tag="td"):
        text(row.task, "clamp", "div")
    text(row.family, "", "td")
    text(model_in_words(row.model), "mono", "td")
    with box(tag="td"):
        badge(row.state, row.warnings)
    text(str(row.iterations), "num", "td")
    text(f"{row.tokens:,}", "num", "td")
    text("–" if row.success is None else format_share(row.success), "num", "td")
    text(row.started[:10], "line numbers", "td")


def _compare_bar(picked: tuple[str, ...], refused: bool, act: Callable[..., None]) -> None:
    def none() -> None:
        act(picked=(), refused=False)
        ui.navigate.reload()

    address = "/compare?" + urlencode([("design", key) for key in picked])
    told = f"{len(picked)} of {MOST_COMPARED} selected"
    if refused:
        told += "; deselect one before you select another"
    elif len(picked) < 2:
        told += "; select at least 2 to compare them"
    with box(f"notice row {'wait' if refused else ''}", role="status"):
        text(f"{told}.", "grow")
        if len(picked) > 1:
            button("Compare", partial(ui.navigate.to, address), "primary", "compare")
        if picked:
            button("Clear selection", none, "quiet")
