"""The result of an export: verdict and reasons, parts on the print bed, changes, and the simulation as built."""

from __future__ import annotations

from collections.abc import Collection
from functools import partial

from nicegui import ui

from aidsr.apps.web.addresses import download_address, file_address, sheet_address
from aidsr.apps.web.view3d import PartsView, PlacedPart
from aidsr.apps.web.widgets import box, button, fact, fault_found, label_cells, text
from aidsr.core.formatting import format_share
from aidsr.fabrication.materials import materials
from aidsr.fabrication.printers import PRINTERS
from aidsr.fabrication.schema import Change, PartEntry, Retest, Verdict
from aidsr.runs import DesignFolder, Run

_BADGES = {"buildable": "yes", "buildable with changes": "waiting", "not buildable": "no"}
_COLOURS = ((0.66, 0.73, 0.80), (0.36, 0.56, 0.72), (0.93, 0.64, 0.31), (0.50, 0.69, 0.52))
"""RGB colours of the robot's parts, in the order of the assembly sheet's colours."""
_BENCH = (0.55, 0.56, 0.60)
"""RGB colour of the parts that stand beside the robot."""


def show_export(run: Run, design: DesignFolder, verdict: Verdict, parts: tuple[PartEntry, ...], made: str) -> None:
    """Show an export.

    Args:
        run: The run.
        design: The design.
        verdict: Verdict of the export.
        parts: Printed parts.
        made: Time at which the export was written, ISO 8601; also the version in the addresses of its files.
    """
    with box("row apart"):
        with box("row"):
            text(verdict.verdict, f"badge {_BADGES[verdict.verdict]}")
            text(f"for {_label(verdict)}, {made[:10]} {made[11:16]} UTC", "small soft")
        with box("row"):
            ui.link("Assembly sheet", sheet_address(run.name, design.number), new_tab=True).classes("button")
            hint = "ZIP file with 3MF and STL, sheet, bill of materials, cable lengths and control program"
            address = download_address(run.name, design.number, export=True)
            button("Download", lambda: ui.download(address), "quiet", "download", hint)
    _facts(verdict, parts)
    with box("split"):
        with box("stack wide"):
            _bed(run, design, parts, made)
        with box("stack wide"):
            _reasons(verdict)
            if verdict.retest is not None:
                _retest(verdict.retest, {fault.code for fault in verdict.reasons})
            _changes(verdict.changes)


def letters(parts: tuple[PartEntry, ...]) -> tuple[str, ...]:
    """Return the label of each part: a letter for a part of the robot, as on the sheet, a number for any other part."""
    robot = [part.file for part in parts if part.what == "robot"]
    bench = [part.file for part in parts if part.what != "robot"]
    return tuple(
        chr(65 + robot.index(part.file) % 26) if part.what == "robot" else str(1 + bench.index(part.file))
        for part in parts
    )


def _label(verdict: Verdict) -> str:
    printer = next((one.label for one in PRINTERS if one.name == verdict.printer), verdict.printer)
    return f"a {printer}, limbs of {_material(verdict.material)}"


def _material(name: str) -> str:
    return next((one.label for one in materials() if one.name == name), name)


def _facts(verdict: Verdict, parts: tuple[PartEntry, ...]) -> None:
    with box("facts"):
        fact("parts to print", f"{sum(part.copies for part in parts)} ({len(parts)} different)")
        fact("pieces that move, simulated", f"{verdict.moving_simulated_g:.0f} g")
        fact("pieces that move, built", f"{verdict.moving_built_g:.0f} g")
        fixed_g = verdict.simulated_g - verdict.moving_simulated_g, verdict.built_g - verdict.moving_built_g
        if any(fixed_g):
            fact("pieces fixed to the world", f"{fixed_g[1]:.0f} g (simulated {fixed_g[0]:.0f} g)")
        if verdict.winches_g is not None:
            fact("separate motors", f"{verdict.winches_g:.0f} g")
        more = f" + {len(verdict.unpriced)} without a price" if verdict.unpriced else ""
        fact("estimated cost", f"${verdict.cost_usd:.0f}{more}")


def _bed(run: Run, design: DesignFolder, parts: tuple[PartEntry, ...], made: str) -> None:
    def address(part: PartEntry, ending: str) -> str:
        return file_address(run.name, f"designs/{design.number}/export/parts/{part.file}{ending}", version=made)

    marks = letters(parts)
    pieces = [part.file for part in parts if part.what == "robot"]
    lying = [
        PlacedPart(
            part.file,
            mark,
            _about(part),
            address(part, ".stl"),
            _COLOURS[pieces.index(part.file) % len(_COLOURS)] if part.what == "robot" else _BENCH,
        )
        for part, mark in zip(parts, marks, strict=True)
    ]
    with box("sheet flush view"):
        view = PartsView(lying, title=f"{run.name} design {design.number} parts")
    with box("sheet flush scroll"), box("list fold", "table"):
        with box(tag="thead"), box(tag="tr"):
            for title in ("letter", "part", "copies", "material", "mass", "size", "checks", "files"):
                text(title, {"letter": "unseen", "copies": "num", "mass": "num", "size": "num"}.get(title, ""), "th")
        with box(tag="tbody"):
            for part, mark in zip(parts, marks, strict=True):
                with box(tag="tr") as row:
                    with box(tag="td"):
                        button(mark, partial(view.choose, part.file), "bare", hint=f"Show {part.in_words}")
                    text(part.in_words, "small name", "td")
                    text(str(part.copies), "num", "td")
                    text(_material(part.material), "small line", "td")
                    text(f"{part.mass_g:.1f} g", "num", "td")
                    text(_size(part), "num small", "td")
                    found = _found(part)
                    text(", ".join(found) or "passed", f"small {'bad' if found else 'good'}", "td")
                    with box(tag="td"), box("row small together"):
                        for ending in (".3mf", ".stl"):
                            ui.link(ending[1:].upper(), address(part, ending))
                label_cells(row, ("", "", "copies", "material", "mass", "size", "checks", "files"))


def _about(part: PartEntry) -> str:
    copies = f"{part.copies} × " if part.copies > 1 else ""
    return f"{copies}{part.in_words}, {part.mass_g:.0f} g, {_size(part)}"


def _size(part: PartEntry) -> str:
    return " × ".join(f"{side:.0f}" for side in part.size_mm) + " mm"


def _found(part: PartEntry) -> list[str]:
    """Return the defects of a part as it lies on the print bed."""
    return [
        label
        for bad, label in ((not part.watertight, "not watertight"), (not part.fits_bed, "larger than the bed"))
        if bad
    ]


def _reasons(verdict: Verdict) -> None:
    with box("sheet stack", "section", aria_label="verdict"):
        text("Can it be built?", tag="h2")
        text(f"It {verdict.answer}.", "", "p")
        if verdict.verdict == "not buildable":
            text("The files are provided anyway, to show what is wrong.", "soft", "p")
        for fault in verdict.reasons:
            fault_found(fault)


def _retest(retest: Retest, told: Collection[str]) -> None:
    """Show the test of the robot as built, without the faults of building whose codes were told with the verdict."""
    with box("sheet stack", "section", aria_label="simulation as built"):
        text("Simulation as built", tag="h2")
        with box("facts small"):
            fact("motion", retest.motion)
            fact("largest displacement, built", f"{1000 * retest.reach_m:.0f} mm")
            fact("largest displacement, designed", f"{1000 * retest.designed_reach_m:.0f} mm")
            if retest.success_share is not None:
                fact("policy success, built", format_share(retest.success_share))
            if retest.designed_success_share is not None:
                fact("policy success, designed", format_share(retest.designed_success_share))
        for fault in retest.motion_faults:
            fault_found(fault)
        building = [fault for fault in retest.building_faults if fault.code not in told]
        if building:
            text("Limits of cables, winches and parts", "label")
            for fault in building:
                fault_found(fault)


def _changes(changes: tuple[Change, ...]) -> None:
    if not changes:
        return
    with box("sheet stack", "section", aria_label="changes"):
        text("Differences from the simulation", tag="h2")
        for change in changes:
            with box("stack tight"):
                text(change.what, "label")
                text(f"Simulated: {change.simulated}", "small soft", "p")
                text(f"Built: {change.built}", "small", "p")
