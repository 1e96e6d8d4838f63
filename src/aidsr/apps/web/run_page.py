"""The page of a run: a column for each concept, what waits for a person, the log, and the designs side by side."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from nicegui import app, ui

from aidsr.apps.web.addresses import design_address, file_address, job_address
from aidsr.apps.web.comparison import comparison_table
from aidsr.apps.web.conversation import conversation
from aidsr.apps.web.frame import frame
from aidsr.apps.web.live import Rows, as_action, live, watch
from aidsr.apps.web.manual_panel import manual_panel
from aidsr.apps.web.model_form import budget_from, limit_fields
from aidsr.apps.web.site import DesignView, Job, RunView, Shown, Site, model_in_words, state_of
from aidsr.apps.web.study_runs import left_to_study
from aidsr.apps.web.widgets import (
    badge,
    box,
    button,
    clock,
    fact,
    image,
    long_text,
    notice,
    stop_button,
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
_DOES = {"training": "is being trained", "export": "is being exported as parts", "probe": "is being probed"}


def add_run_page(site: Site) -> None:
    """Add the page at /run/NAME."""

    @ui.page("/run/{name}")
    def run_page(name: str) -> None:
        try:
            run = site.run(name)
            view = site.view(run)
        except AidsrError as error:
            cannot_open(site, name, error)
            return
        with frame(view.title, *site.way_to(name), site=site):
            with box("stack"):
                with box("row apart top"):
                    with box("stack tight grow"):
                        live(lambda: site.view(run).shown, partial(_title, view))
                    live(partial(_working, site, run), partial(_actions, site, run))
                live(lambda: site.view(run), _facts)
            live(lambda: _of_note(site, run), partial(_notes, site, run))
            manual_panel(site, run)
            # a run that waits for a person opens on its designs, not on the tab opened last
            opened = "watch" if view.awaited else app.storage.user.get("run_tab", "watch")
            with ui.tabs().props("dense align=left no-caps") as tabs:
                for key, title in _TABS.items():
                    ui.tab(key, title)
            with ui.tab_panels(tabs, value=opened if opened in _TABS else "watch", animated=False).classes("full"):
                with ui.tab_panel("watch"):
                    _columns(site, run)
                with ui.tab_panel("compare"):
                    comparison_table(site, run)
                with ui.tab_panel("log"):
                    conversation(run)
            # connected only now, so that only a tab that a person opens is stored
            tabs.on_value_change(lambda event: app.storage.user.update(run_tab=event.value))


def cannot_open(site: Site, name: str, error: AidsrError, *, number: int | None = None) -> None:
    """Show why the page of a run, or of a design if `number` is given, cannot be opened."""
    try:
        run = site.run(name)
    except AidsrError:
        not_found(error)
        return
    missing = number is not None and not run.design(number).path.is_dir()
    not_found(error, f"No design {number}" if missing else "This run cannot be read")


def not_found(error: AidsrError, title: str = "Page not found") -> None:
    """Show an error under a title, and a link to all runs; by default that an address does not exist."""
    with frame(title, ("Runs", "/"), narrow=True), box("sheet empty"):
        text(title, tag="h1")
        text(str(error), "soft", "p")
        ui.link("All runs", "/")


def _title(view: RunView, shown: Shown) -> None:
    record = view.status.record
    with box("row"):
        text(view.title, tag="h1")
        badge(shown)
    if record.objective != view.title:
        text(record.objective, "soft", "p")


def _facts(view: RunView) -> None:
    status, config = view.status, view.status.record.config
    with box("facts"):
        fact("designer", "built-in rules" if config.model == "builtin" else model_in_words(config.model))
        if status.record.level:
            fact("level", status.record.level)
        fact("approved", f"{status.approved} of {len(view.designs) or config.concepts}")
        fact("time", format_duration(status.latency_s))
        usage_facts(status.usage)
        if config.model == "builtin":
            fact("seed", str(config.seed))


def _working(site: Site, run: Run) -> tuple[Shown, bool, bool]:
    return site.view(run).shown, site.is_running(run), site.processes.is_stopping(run.name)


def _actions(site: Site, run: Run, state: tuple[Shown, bool, bool]) -> None:
    shown, working, is_stopping = state

    def stop() -> None:
        if not site.processes.stop(run.name):
            raise UserError("this run was not started in the web app; stop it with Control-C where it was started")
        ui.notify("Stopping. Finished work is kept.")

    with box("row"):
        if shown in ("stopped", "interrupted"):
            button("Resume", as_action(partial(site.resume, run)), "primary", "play_arrow")
        elif shown == "waiting" and not working:
            button(
                "Resume", as_action(partial(site.resume, run)), "quiet", "play_arrow", "No process is running this run"
            )
        elif shown != "finished":
            hint = "Stops the run like Control-C; finished work is kept"
            stop_button(as_action(stop), is_stopping=is_stopping, hint=hint)
        summary = file_address(run.name, "summary.html")
        button("", lambda: ui.download(summary), "bare", "download", "Download the summary page")


@dataclass(frozen=True)
class _Noted:
    """Notices for a person; a separate part of the page, so that its buttons are not redrawn while a run progresses."""

    stopped: str
    interrupted: bool
    used_up: bool
    at_work: tuple[tuple[Job, str], ...]
    """Running jobs, with the names of their designs."""
    waiting: tuple[tuple[int, str], ...]
    """Numbers and names of designs that wait for a decision."""
    output_tail: str
    """Last output of the run's process, where it ended without recording why."""


def _of_note(site: Site, run: Run) -> _Noted:
    view = site.view(run)
    return _Noted(
        stopped=view.status.stopped.message if view.status.stopped else "",
        interrupted=view.shown == "interrupted",
        used_up=any(d.status.outcome and d.status.outcome.outcome == "out_of_budget" for d in view.designs),
        at_work=tuple((job, view.design(job.number).status.concept) for job in view.jobs),
        waiting=tuple((d.status.number, d.status.concept) for d in view.designs if d.status.state == "waiting"),
        output_tail=site.unexplained_output(run, view),
    )


def _notes(site: Site, run: Run, noted: _Noted) -> None:
    if noted.stopped:
        notice(f"Stopped: {noted.stopped}", "bad")
    if noted.interrupted:
        with box("notice wait stack tight", role="status"):
            text("No process is running this run: it ended, or the folder comes from another machine.")
            text("“Resume” continues it from its files. Answered calls are not repeated.", "small soft")
    if noted.output_tail:
        text("Output of the last process of this run:", "label")
        long_text(noted.output_tail, "last output", "last")
    if noted.used_up:
        _larger_budget(site, run)
    for job, concept in noted.at_work:
        with box("notice", role="status"), box("row apart"):
            text(f"Design {job.number}, {concept}, {_DOES[job.kind]}.")
            button("Watch", partial(ui.navigate.to, job_address(run.name, job.number, job.kind)), "quiet")
    for number, concept in noted.waiting:
        with box("notice wait", role="status"), box("row apart"):
            text(f"Design {number}, {concept}, waits for your decision.")
            button("Review", partial(ui.navigate.to, design_address(run.name, number)), "primary")


def _larger_budget(site: Site, run: Run) -> None:
    """Offer to resume a run that used up its budget with a larger budget, unless its study sets it."""
    used_up = "The budget of this run is used up. To continue, resume the study in a terminal with a larger limit."
    if left_to_study(site, run, used_up):
        return
    form: dict[str, Any] = dict(run.budget())

    def resume() -> None:
        site.refuse_running(run)
        replace_budget(run, budget_from(form))
        site.resume(run)

    with box("notice wait stack", role="status"):
        text("The budget of this run is used up. To resume, set a larger one that includes what was spent so far.")
        limit_fields(form)
        with box("row"):
            button("Resume with this budget", as_action(resume), "primary", "play_arrow")


def _columns(site: Site, run: Run) -> None:
    with box("live") as without:
        pass
    with box("columns"):
        columns = Rows(_column, "article", "sheet flush")

    def show(found: RunView | AidsrError) -> None:
        without.clear()
        designs = found.designs if isinstance(found, RunView) else ()
        with without:
            if isinstance(found, AidsrError):
                notice(str(found), "bad")
            elif not designs:
                _no_concepts(found)
        shown = found.shown if isinstance(found, RunView) else "stopped"
        columns.update((str(one.status.number), (run.name, shown, one)) for one in designs)

    watch(lambda: site.view(run), show)


def _no_concepts(view: RunView) -> None:
    with box("sheet empty"):
        if view.shown == "running":
            text(f"{DOING['concepts'][0].upper()}{DOING['concepts'][1:]}", tag="h2")
            if view.since:
                clock(view.since)
            slow = "" if view.status.record.config.model == "builtin" else "A language model may take minutes. "
            text(f"{slow}You can close this page.", "soft", "p")
        elif view.prompts:
            text("The Designer waits for your reply", tag="h2")
        else:
            text("There are no concepts yet", tag="h2")


def _column(facts: tuple[str, Shown, DesignView]) -> None:
    run, shown, design = facts
    status = design.status
    address = partial(design_address, run, status.number)
    with ui.link(target=address()).props("tabindex=-1 aria-hidden=true"):
        image(file_address(run, design.picture), "")
    with box("stack inside"):
        with box("row apart top"):
            with box("stack tight grow"):
                with box(tag="h2"):
                    ui.link(f"{status.number}. {status.concept or 'concept'}", address())
                text(status.family, "small soft")
            badge(state_of(shown, design), design.warnings)
        _doing(shown, design)
        working = shown not in ("interrupted", "stopped")
        strip(design.iterations, lambda number: address(iteration=number), at_work=working)
        if status.stopped:
            notice(status.stopped.message, "bad")
        if status.faults and not status.outcome:
            with box("row"):
                for code in status.faults[:6]:
                    text(code, "chip")
        with box("facts small"):
            if design.held_out:
                won, episodes = design.held_out
                fact("held-out success", f"{won} of {episodes}")
                fact("policy", "successful" if design.successful else "valid" if design.valid else "not valid")
            fact("time", format_duration(status.latency_s))
            usage_facts(status.usage)
            if status.mechanical_repairs:
                fact("automatic fixes", str(status.mechanical_repairs))


def _doing(shown: Shown, design: DesignView) -> None:
    status = design.status
    if status.outcome:
        text(status.outcome.reason, "small", "p")
    elif status.doing and shown == "running":
        with box("row small"):
            text(DOING[status.doing], "accent")
            clock(design.since)


def concept_in_words(concept: Concept | None) -> None:
    """Show the Designer's concept in words."""
    if concept is None:
        text("There is no concept yet.", "soft")
        return
    with box("stack"):
        for title, label in (
            ("task requirements", concept.interpretation),
            ("morphology", concept.morphology),
            ("actuation", concept.actuation),
            ("functional part", concept.functional_part),
            ("rationale", concept.rationale),
        ):
            if label:
                with box("stack tight"):
                    text(title, "label")
                    text(label, "", "p")
        if concept.parameters:
            with box("row"):
                for key, value in concept.parameters.items():
                    text(f"{key} {value:.4g}", "chip")
