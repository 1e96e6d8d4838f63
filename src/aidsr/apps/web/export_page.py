"""The export page of a design: start the export process, and show the verdict, the parts and the assembly sheet."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from nicegui import app, ui

from aidsr.apps.web.addresses import design_address, run_address
from aidsr.apps.web.export_result import show_export
from aidsr.apps.web.frame import frame
from aidsr.apps.web.live import as_action, live
from aidsr.apps.web.run_page import cannot_open
from aidsr.apps.web.site import Site
from aidsr.apps.web.widgets import box, button, clock, long_text, notice, stop_button, text
from aidsr.core.errors import AidsrError
from aidsr.core.extras import missing_extra
from aidsr.core.formatting import iso_time
from aidsr.fabrication.materials import materials
from aidsr.fabrication.printers import PRINTERS
from aidsr.fabrication.schema import MARK, PartEntry, Verdict
from aidsr.runs import DesignFolder, Run
from aidsr.runs.files import JsonFile
from aidsr.runs.trainings import trainings_of

_DEFAULTS: dict[str, Any] = {"printer": "fdm", "material": "", "policy": False}
"""Defaults of `aidsr export`."""
_ANY = "First suitable material"


@dataclass(frozen=True)
class State:
    """State of the export of a design."""

    missing: str
    """What must be installed first, in words; empty where nothing is missing."""
    approved: bool
    trained: bool
    since: str = ""
    """Start time of the running process, ISO 8601; empty where none is running."""
    is_stopping: bool = False
    output_tail: str = ""
    """Last output of a process that ended without an export."""
    verdict: Verdict | None = None
    parts: tuple[PartEntry, ...] = ()
    made: str = ""
    """Time at which the export was written, ISO 8601."""


def add_export_page(site: Site) -> None:
    """Add the page at /run/NAME/NUMBER/export."""

    @ui.page("/run/{name}/{number}/export")
    def export_page(name: str, number: int) -> None:
        try:
            run, design = site.design(name, number)
            view = site.view(run)
            concept = f"{number}. {view.design(number).status.concept}"
        except AidsrError as error:
            cannot_open(site, name, error, number=number)
            return
        way = (*site.way_to(name), (view.title, run_address(name)), (concept, design_address(name, number)))
        with frame("Export", *way, site=site):
            with box("stack tight"):
                text(f"{concept}: parts", tag="h1")
                text(
                    "Parts to print, motors and cables to buy, an assembly sheet, and what cannot be built.",
                    "soft",
                    "p",
                )
            live(partial(read_export, site, run, design), partial(draw_export, site, run, design))


def read_export(site: Site, run: Run, design: DesignFolder) -> State:
    """Return the state of the export of a design.

    Raises:
        UserError: An export exists but cannot be read.
    """
    name = site.export_name(run, design.number)
    missing = missing_extra("fabrication", "making parts")
    trained = any(one.result.path.exists() for one in trainings_of(design))
    approved, started_s = design.final_robot.path.exists(), site.processes.started_s(name)
    if site.processes.is_alive(name):
        is_stopping = site.processes.is_stopping(name)
        return State(missing, approved, trained, since=iso_time(started_s), is_stopping=is_stopping)
    folder = design.path / "export"
    mark = folder / MARK
    written_s = mark.stat().st_mtime if mark.exists() else 0.0
    if written_s < started_s:
        return State(missing, approved, trained, output_tail=site.processes.output_tail(name) or "no output")
    if not written_s:
        return State(missing, approved, trained)
    verdict = JsonFile(mark, Verdict).read()
    parts = JsonFile(folder / "parts.json", tuple[PartEntry, ...]).read() or ()
    return State(missing, approved, trained, verdict=verdict, parts=parts, made=iso_time(written_s))


def draw_export(site: Site, run: Run, design: DesignFolder, state: State) -> None:
    """Show the running export, or the result of the last one and the form that starts another."""
    if not state.approved:
        with box("sheet empty"):
            text("A design can be exported once it is approved.", "soft", "p")
        return
    if state.since:
        name = site.export_name(run, design.number)
        with box("notice", role="status"), box("row apart"):
            with box("row"):
                text("Creating parts, checking them, and simulating the built robot. This takes about 20 seconds.")
                clock(state.since)
            stop_button(as_action(lambda: site.processes.stop(name)), is_stopping=state.is_stopping)
        return
    if state.output_tail:
        notice("The last export made no parts. Its output:", "bad")
        long_text(state.output_tail, "last output", "last")
    if state.verdict is not None:
        show_export(run, design, state.verdict, state.parts, state.made)
    if state.missing:
        notice(f"Export is not available on this machine: {state.missing}", "wait")
    else:
        _start(site, run, design, state)


def _start(site: Site, run: Run, design: DesignFolder, state: State) -> None:
    choices: dict[str, Any] = app.storage.user.setdefault("export", dict(_DEFAULTS))

    def start() -> None:
        words = ["export", str(design.path), "--printer", str(choices["printer"])]
        words += ["--material", str(choices["material"])] if choices["material"] else []
        words += ["--policy"] if state.trained and choices["policy"] else []
        site.processes.start(site.export_name(run, design.number), words)

    def fitting(printer: object) -> dict[str, str]:
        return {"": _ANY} | {one.name: one.label for one in materials() if printer in one.printers}

    def turn(printer: object) -> None:
        offered = fitting(printer)
        material.set_options(offered, value=choices["material"] if choices["material"] in offered else "")

    with box("sheet stack", "section", aria_label="export this design"):
        text("Export parts again" if state.verdict else "Export parts", tag="h2")
        with box("form"):
            labels = {one.name: one.label[0].upper() + one.label[1:] for one in PRINTERS}
            printer = ui.select(labels, label="Printer").props("outlined dense").bind_value(choices, "printer")
            material = ui.select(fitting(choices["printer"]), label="Limb material").props("outlined dense")
            material.bind_value(choices, "material")
            printer.on_value_change(lambda event: turn(event.value))
        if state.trained:
            ui.switch("Test the trained policy on the robot as built (half a minute more)").bind_value(
                choices, "policy"
            )
        with box("row"):
            if state.verdict:
                button("Export again", as_action(start), "quiet", "construction")
            else:
                button("Export", as_action(start), "primary", "construction")
