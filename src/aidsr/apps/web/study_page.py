"""The page of a study: progress, runs by task and arm, failures, and the process that works on it."""

from __future__ import annotations

from functools import partial

from nicegui import ui

from aidsr.apps.web.addresses import report_address, run_address
from aidsr.apps.web.frame import frame
from aidsr.apps.web.live import as_action, live
from aidsr.apps.web.run_page import not_found
from aidsr.apps.web.site import Site
from aidsr.apps.web.studies import RunOfStudy, StudyView
from aidsr.apps.web.studies_panel import spending_of
from aidsr.apps.web.widgets import badge, box, button, fact, notice, points, stop_button, text
from aidsr.core.errors import AidsrError
from aidsr.core.formatting import task_title


def add_study_page(site: Site) -> None:
    """Add the page at /study/NAME."""

    @ui.page("/study/{key}")
    def study_page(key: str) -> None:
        try:
            view = site.studies.view(key)
        except AidsrError as error:
            not_found(error)
            return
        with frame(view.name, ("Runs", "/"), ("Activity", "/work"), site=site):
            with box("row apart top"):
                with box("stack tight grow"):
                    text(view.name, tag="h1")
                    live(lambda: site.studies.view(key).asks, _asks)
                live(lambda: _state(site, key), partial(_actions, site, key))
            live(lambda: _output(site, key), _notes)
            live(lambda: site.studies.view(key), _facts)
            live(lambda: site.studies.view(key).cells, _runs)
            live(lambda: site.studies.view(key).failures, _failures)


def _asks(words: str) -> None:
    text(words, "soft", "p")


def _state(site: Site, key: str) -> tuple[bool, bool, int, bool]:
    view, is_stopping = site.studies.view(key), site.processes.is_stopping(site.studies.process(key))
    return site.studies.is_running(key), is_stopping, view.jobs_left, view.report


def _actions(site: Site, key: str, state: tuple[bool, bool, int, bool]) -> None:
    working, is_stopping, left, report = state
    with box("row"):
        if working:
            badge("running")
            stop = as_action(partial(site.studies.stop, key))
            hint = "Stops the study like Control-C; finished work is kept"
            stop_button(stop, is_stopping=is_stopping, hint=hint)
        elif left:
            button("Resume", as_action(partial(site.studies.resume, key)), "primary", "play_arrow")
        if report:
            ui.link("Report", report_address(key), new_tab=True)


def _output(site: Site, key: str) -> str:
    """Return the last output of a process that ended before all jobs were done; empty otherwise."""
    view = site.studies.view(key)
    return site.studies.output_tail(key) if view.jobs_left and not site.studies.is_running(key) else ""


def _notes(output: str) -> None:
    if output:
        with ui.expansion("Last output of the study process").props("dense").classes("full"):
            text(output, "mono small pre")


def _facts(view: StudyView) -> None:
    if view.complaint:
        notice(view.complaint, "bad")
        return
    with box("facts"):
        fact("runs finished", f"{view.runs_done} of {view.runs}")
        fact("policies evaluated", str(view.policies))
        fact("jobs remaining", str(view.jobs_left))
        if view.jobs_left:
            fact("core hours remaining", f"{view.core_hours_left:.1f}")
        fact("jobs failed", str(view.failed))
        fact("cost", spending_of(view))
        for left in view.left:
            fact("limit", left)


def _runs(cells: tuple[RunOfStudy, ...]) -> None:
    """Show a row for each task and a column for each arm, with every run as a link."""
    arms = tuple(dict.fromkeys(cell.arm for cell in cells))
    with box("sheet flush scroll"), box("list study", "table"):
        with box(tag="thead"), box(tag="tr"):
            for column in ("task", *arms):
                text(column, "mono" if column in arms else "", "th")
        with box(tag="tbody"):
            for task in dict.fromkeys(cell.task for cell in cells):
                with box(tag="tr"):
                    text(task_title(task), "", "th").props["scope"] = "row"
                    for arm in arms:
                        with box(tag="td"), box("stack tight"):
                            _cell([cell for cell in cells if (cell.task, cell.arm) == (task, arm)])


def _cell(runs: list[RunOfStudy]) -> None:
    with box("row tight"):
        for one in sorted(runs, key=lambda run: run.number):
            if one.name:
                link = ui.link(str(one.number), run_address(one.name)).classes(f"badge {one.state}")
                link.props["aria-label"] = f"run {one.number}, {one.state}"
            else:
                text(str(one.number), "badge").props["title"] = "not started"
    begun = [one for one in runs if one.name]
    if not begun:
        return
    designs, approved, judged, won = (
        sum(getattr(one, name) for one in begun) for name in ("designs", "approved", "judged", "successful")
    )
    said = f"{approved} of {designs} approved" + (f", {won} of {judged} successful" if judged else "")
    text(said, "small soft")
    reached = [one.progress for one in begun if one.progress is not None]
    if reached:
        text(f"best probe progress {max(reached):.2f}", "small soft")


def _failures(failures: tuple[str, ...]) -> None:
    if failures:
        with box("stack", "section", aria_label="failed attempts"):
            text("Failed attempts", tag="h2")
            points(failures, "small")
