"""The page of activities: what is running, studies, and what waits for a person."""

from __future__ import annotations

from functools import partial

from nicegui import ui

from aidsr.apps.web.activities import Activity
from aidsr.apps.web.frame import frame
from aidsr.apps.web.live import Rows, as_action, watch
from aidsr.apps.web.site import Site
from aidsr.apps.web.studies_panel import studies_panel
from aidsr.apps.web.widgets import box, button, clock, notice, stop_button, text
from aidsr.core.errors import AidsrError, UserError
from aidsr.core.formatting import format_duration, format_share

_COLUMNS = ("activity", "state", "progress", "time left", "since", "stop")


def add_activities_page(site: Site) -> None:
    """Add the page at /work."""

    @ui.page("/work")
    def activities_page() -> None:
        with frame("Activity", ("Runs", "/"), site=site):
            with box("row apart"):
                text("Activity", tag="h1")
                tell = button("Desktop notifications", lambda: None, "quiet", "notifications")
                tell.on("click", js_handler="() => window.askToNotify()")
                tell.tooltip("Notifies you when a design or a prompt waits for you, while a page of AID-SR is open")
            _table(site)
            studies_panel(site)
            with box("row"):
                ui.link("New study", "/studies/new").classes("strong")
                text("compares models and methods over many runs", "small soft")


def _table(site: Site) -> None:
    with box("live") as without:
        pass
    with box("sheet flush scroll") as sheet, box("list work", "table"):
        with box(tag="thead"), box(tag="tr"):
            for column in _COLUMNS:
                text(column, "unseen" if column == "stop" else "", "th")
        with box(tag="tbody"):
            rows = Rows(partial(_row, site))

    def show(found: tuple[Activity, ...] | AidsrError) -> None:
        without.clear()
        activities = found if isinstance(found, tuple) else ()
        sheet.set_visibility(bool(activities))
        with without:
            if isinstance(found, AidsrError):
                notice(str(found), "bad")
            elif not activities:
                with box("sheet empty"):
                    text("Nothing is running, and nothing waits for you.", "soft")
        rows.update((f"{each.kind} {each.address}", each) for each in activities)

    watch(site.activities.current, show)


def _row(site: Site, activity: Activity) -> None:
    def stop() -> None:
        if not site.processes.stop(activity.process):
            raise UserError("this process was not started in the web app; stop it with Control-C where it was started")

    with box("what", "td"):
        ui.link(activity.title, activity.address)
    text(activity.doing, "wait" if activity.waits else "", "td")
    with box(tag="td"):
        if activity.share is not None:
            done = f"{format_share(activity.share)} done"
            with box(tag="progress", value=f"{activity.share:.3f}", max="1", aria_label=done):
                pass
    text("" if activity.left_s is None else f"about {format_duration(activity.left_s)}", "numbers", "td")
    with box("numbers", "td"):
        if activity.since:
            clock(activity.since)
    with box("stop", "td"):
        if activity.process:
            stop_button(as_action(stop), is_stopping=activity.is_stopping)
