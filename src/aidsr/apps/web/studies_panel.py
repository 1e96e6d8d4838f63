"""A list of studies with the progress and the report of each."""

from __future__ import annotations

from nicegui import ui

from aidsr.apps.web.addresses import report_address, study_address
from aidsr.apps.web.live import live
from aidsr.apps.web.site import Site
from aidsr.apps.web.studies import StudyView
from aidsr.apps.web.widgets import badge, box, label_cells, text
from aidsr.core.formatting import format_cost

_COLUMNS = (
    "study",
    "state",
    "runs finished",
    "started",
    "policies evaluated",
    "failed",
    "jobs remaining",
    "core hours remaining",
    "cost",
    "report",
)


def studies_panel(site: Site) -> None:
    """List the studies; show nothing where there are none."""
    live(site.studies.views, _table)


def _table(views: tuple[StudyView, ...]) -> None:
    if not views:
        return
    with box("stack", "section", aria_label="studies"):
        text("Studies", tag="h2")
        with box("sheet flush scroll"), box("list fold", "table"):
            with box(tag="thead"), box(tag="tr"):
                for column in _COLUMNS:
                    text(column, "" if column in ("study", "state", "report") else "num", "th")
            with box(tag="tbody"):
                for view in views:
                    with box(tag="tr") as row:
                        _cells(view)
                    if not view.complaint:
                        label_cells(row, ("", *_COLUMNS[1:]))


def _cells(view: StudyView) -> None:
    with box("mono name", "td"):
        ui.link(view.name, study_address(view.key))
    if view.complaint:
        with box(tag="td", colspan=str(len(_COLUMNS) - 1)):
            text(view.complaint, "small bad")
        return
    with box(tag="td"):
        badge("running" if view.at_work else "finished" if not view.jobs_left else "stopped")
    text(f"{view.runs_done} of {view.runs}", "num", "td")
    for count, look in ((view.started, ""), (view.policies, ""), (view.failed, "bad"), (view.jobs_left, "")):
        text(str(count), f"num {look if count else ''}", "td")
    text(f"{view.core_hours_left:.1f}" if view.jobs_left else "–", "num", "td")
    with box("num", "td"):
        text(spending_of(view))
        for left in view.left:
            text(left, "small soft", "div")
    with box(tag="td"):
        if view.report:
            ui.link("Report", report_address(view.key), new_tab=True)


def spending_of(view: StudyView) -> str:
    """Return what a study has cost and is expected to cost, in words."""
    paid = format_cost(view.usage)
    return f"{paid}, about ${view.to_spend_usd:.2f} more expected" if view.to_spend_usd else paid
