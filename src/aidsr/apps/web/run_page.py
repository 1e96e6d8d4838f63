"""Watch a run: one column for each concept, what waits for a person, the log, designs side by side."""

from __future__ import annotations

from functools import partial
from typing import Any

from nicegui import app, ui

from aidsr.apps.web.comparison import comparison_table
from aidsr.apps.web.conversation import conversation
from aidsr.apps.web.frame import frame
from aidsr.apps.web.live import as_action, live
from aidsr.apps.web.manual_panel import manual_panel
from aidsr.apps.web.model_form import budget_from, limit_fields
from aidsr.apps.web.site import DesignView, RunView, Site
from aidsr.apps.web.widgets import (
    badge,
    box,
    button,
    clock,
    fact,
    file_address,
    image,
    notice,
    strip,
    text,
    usage_facts,
)
from aidsr.core.artifacts import Concept
from aidsr.core.errors import AidsrError, UserError
from aidsr.core.formatting import format_duration
from aidsr.loop.run import replace_budget
from aidsr.runs import Run
from aidsr.runs.event_text import DOING

_TABS = {"watch": "Designs", "compare": "Side by side", "log": "Log"}


def add_run_page(site: Site) -> None:
    """Answer at /run/NAME."""

    @ui.page("/run/{name}")
    def run_page(name: str) -> None:
        try:
            run = site.library.run(name)
            view = site.view(run)
        except AidsrError as error:
            not_found(error)
            return
        with frame(view.title, ("Runs", "/")):
            live(lambda: site.view(run), partial(_head, site, run))
            live(lambda: _of_note(site, run), partial(_notes, site, run))
            manual_panel(site, run)
            opened = app.storage.user.get("run_tab", "watch")
            with ui.tabs().props("dense align=left no-caps") as tabs:
                for key, title in _TABS.items():
                    ui.tab(key, title)
            tabs.on_value_change(lambda event: app.storage.user.update(run_tab=event.value))
            with ui.tab_panels(tabs, value=opened if opened in _TABS else "watch", animated=False).classes("full"):
                with ui.tab_panel("watch"):
                    live(lambda: site.view(run), _columns)
                with ui.tab_panel("compare"):
                    comparison_table(site, run)
                with ui.tab_panel("log"):
                    conversation(run)


def not_found(error: AidsrError) -> None:
    """Show that an address leads nowhere, and a way on."""
    with frame("Not found", ("Runs", "/"), narrow=True), box("sheet empty"):
        text("There is nothing here", tag="h1")
        text(str(error), "soft", "p")
        ui.link("All runs", "/")


def _head(site: Site, run: Run, view: RunView) -> None:
    status, config = view.status, view.status.record.config
    with box("stack"):
        with box("row apart top"):
            with box("stack tight grow"):
                with box("row"):
                    text(view.title, tag="h1")
                    badge(view.shown)
                if status.record.task:
                    text(status.record.objective, "soft", "p")
            _actions(site, run, view)
        with box("facts"):
            fact("who designs", "built-in rules" if config.model == "builtin" else config.model)
            if status.record.level:
                fact("level", status.record.level)
            fact("approved", f"{status.approved} of {len(view.designs) or config.concepts}")
            fact("worked", format_duration(status.latency_s))
            usage_facts(status.usage)
            if config.model == "builtin":
                fact("seed", str(config.seed))


def _actions(site: Site, run: Run, view: RunView) -> None:
    def stop() -> None:
        if not site.processes.stop(run.path.name):
            raise UserError("this run was started elsewhere, as in a terminal; end it there with Control-C")
        ui.notify("Stopping; what is done is kept.")

    with box("row"):
        if view.shown in ("stopped", "interrupted"):
            button("Resume", as_action(partial(site.resume, run)), "primary", "play_arrow")
        elif view.shown == "waiting" and not site.is_at_work(run):
            button("Resume", as_action(partial(site.resume, run)), "quiet", "play_arrow", "No process runs this run")
        elif view.shown != "finished":
            button("Stop", as_action(stop), "danger", "stop", "Ends as Control-C does; what is done is kept")
        summary = file_address(run.path.name, "summary.html")
        button("", lambda: ui.download(summary), "bare", "download", "Download the summary page")


def _of_note(site: Site, run: Run) -> tuple[RunView, str]:
    """Return how a run stands, and the end of its process's output where it stopped without an event."""
    view = site.view(run)
    silent = view.shown == "interrupted" or (view.shown == "stopped" and not view.status.stopped)
    return view, site.processes.output_tail(run.path.name) if silent else ""


def _notes(site: Site, run: Run, facts: tuple[RunView, str]) -> None:
    view, output_tail = facts
    if view.status.stopped is not None:
        notice(f"Stopped: {view.status.stopped.message}", "bad")
    if view.shown == "interrupted":
        with box("notice wait stack tight", role="status"):
            text("No process is running this run: it ended, or the folder comes from another machine.")
            text("“Resume” continues it from its files; no answered call is repeated.", "small soft")
            if output_tail:
                text(output_tail, "text last", "pre")
    if any(one.status.outcome and one.status.outcome.outcome == "out_of_budget" for one in view.designs):
        _larger_budget(site, run)
    for design in view.designs:
        if design.status.state == "waiting":
            with box("notice wait", role="status"), box("row apart"):
                text(f"Design {design.status.number}, {design.status.concept}, waits for your decision.")
                address = f"/run/{run.path.name}/{design.status.number}"
                button("Review", partial(ui.navigate.to, address), "primary")


def _larger_budget(site: Site, run: Run) -> None:
    """Offer to resume a run that used up its budget with a larger one."""
    form: dict[str, Any] = dict(run.budget())

    def resume() -> None:
        site.refuse_at_work(run)
        replace_budget(run, budget_from(form))
        site.resume(run)

    with box("notice wait stack", role="status"):
        text("The budget of this run is used up. Set a larger one, what was spent before included, to resume.")
        limit_fields(form)
        with box("row"):
            button("Resume with this budget", as_action(resume), "primary", "play_arrow")


def _columns(view: RunView) -> None:
    if not view.designs:
        with box("sheet empty"):
            if view.shown == "running":
                text(f"{DOING['concepts'][0].upper()}{DOING['concepts'][1:]}", tag="h2")
                if view.since:
                    clock(view.since)
                text("A language model may take minutes. This page can be closed meanwhile.", "soft", "p")
            else:
                text("There are no concepts yet", tag="h2")
        return
    with box("columns"):
        for design in view.designs:
            _column(view, design)


def _column(view: RunView, design: DesignView) -> None:
    status = design.status
    address = f"/run/{view.name}/{status.number}"
    with box("sheet flush", "article"):
        with ui.link(target=address).props("tabindex=-1 aria-hidden=true"):
            image(file_address(view.name, design.picture), f"design {status.number}")
        with box("stack inside"):
            with box("row apart top"):
                with box("stack tight grow"):
                    with box(tag="h3"):
                        ui.link(f"{status.number}. {status.concept or 'concept'}", address)
                    text(status.family, "small soft")
                badge(status.outcome.outcome if status.outcome else _shown(view, design))
            _doing(view, design)
            strip(design.attempts, lambda number: f"{address}?iteration={number}")
            if status.stopped:
                notice(status.stopped.message, "bad")
            if status.faults and not status.outcome:
                with box("row"):
                    for code in status.faults[:6]:
                        text(code, "chip")
            with box("facts small"):
                fact("worked", format_duration(status.latency_s))
                usage_facts(status.usage)
                if status.mechanical_repairs:
                    fact("fixed by code", str(status.mechanical_repairs))
                if design.trained:
                    fact("trained", "successful" if design.successful else "valid" if design.valid else "not valid")


def _shown(view: RunView, design: DesignView) -> str:
    state = design.status.state
    return "interrupted" if state == "running" and view.shown == "interrupted" else state


def _doing(view: RunView, design: DesignView) -> None:
    status = design.status
    if status.outcome:
        text(status.outcome.reason, "small", "p")
    elif status.doing and view.shown == "running":
        with box("row small"):
            text(DOING[status.doing], "accent")
            clock(design.since)


def concept_in_words(concept: Concept | None) -> None:
    """Show what the Designer thought."""
    if concept is None:
        text("There is no concept yet.", "soft")
        return
    with box("stack"):
        for title, label in (
            ("what the task demands", concept.interpretation),
            ("body", concept.morphology),
            ("actuation", concept.actuation),
            ("the part that does the work", concept.functional_part),
            ("why", concept.rationale),
        ):
            if label:
                with box("stack tight"):
                    text(title, "label")
                    text(label, "", "p")
        if concept.parameters:
            with box("row"):
                for key, value in concept.parameters.items():
                    text(f"{key} {value:.4g}", "chip")
