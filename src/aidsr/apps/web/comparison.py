"""Designs side by side, compared by their measurements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from nicegui import ui

from aidsr.apps.web.addresses import design_address, file_address
from aidsr.apps.web.live import live
from aidsr.apps.web.site import DesignView, Site
from aidsr.apps.web.widgets import badge, box, image, text
from aidsr.core.formatting import format_cost, format_duration, format_number, format_share
from aidsr.runs import DesignFolder, Run
from aidsr.runs.compare import attempted
from aidsr.runs.trainings import best_verdict, verdicts_of

_MEASURED = (
    ("limb length", "characteristic_length_m", 1000.0, "mm"),
    ("moving mass", "moving_mass_kg", 1000.0, "g"),
    ("tendons", "tendons", 1.0, ""),
    ("actuators", "actuators", 1.0, ""),
    ("degrees of freedom", "degrees_of_freedom", 1.0, ""),
    ("largest displacement / length", "largest_effect_over_length", 1.0, ""),
    ("fastest body", "fastest_body_m_s", 1.0, "m/s"),
)
"""Measurements of the validator as shown to a person: title, key, factor and unit; lengths in mm and masses in g, as in
faults and parts."""


@dataclass(frozen=True)
class Column:
    """A design as a column of the table."""

    run: str
    design: DesignView
    rows: tuple[tuple[str, str], ...]
    motion: str


def comparison_table(site: Site, run: Run) -> None:
    """Show all designs of a run as columns of one table."""
    live(lambda: _read(site, run), _table)


def compare_measured(site: Site, designs: Sequence[tuple[Run, int]]) -> None:
    """Show some designs, from any runs, as columns of one table."""
    columns = (
        comparison_column(run.name, run.design(number), site.view(run).design(number)) for run, number in designs
    )
    _table(tuple(columns), pictures=False)


def measured_in_words(measurements: dict[str, Any]) -> tuple[tuple[str, str], ...]:
    """Return the measurements that describe a robot as pairs of name and value."""
    return tuple(
        (name, f"{format_number(factor * float(measurements[key]))} {unit}".rstrip())
        for name, key, factor, unit in _MEASURED
        if measurements.get(key) is not None
    )


def _read(site: Site, run: Run) -> tuple[Column, ...]:
    view = site.view(run)
    return tuple(comparison_column(view.name, run.design(design.status.number), design) for design in view.designs)


def comparison_column(run: str, folder: DesignFolder, design: DesignView) -> Column:
    """Return the properties and measurements of a design as a column of the table."""
    status = design.status
    state = attempted(folder, status.stands_at) if status.stands_at else None
    concept, report = (state.concept, state.report) if state else (None, None)
    found = sum(stage.mark == "bad" for iteration in design.iterations for stage in iteration.stages)
    rows = [
        ("family", status.family),
        ("morphology", concept.morphology if concept else ""),
        ("actuation", concept.actuation if concept else ""),
        *measured_in_words(report.measurements if report else {}),
        ("iterations", str(status.iteration)),
        ("rejected", f"{found} times" if found != 1 else "once"),
        ("time", format_duration(status.latency_s)),
        ("cost", format_cost(status.usage)),
        *_trained(folder),
    ]
    return Column(run, design, tuple((name, value) for name, value in rows if value), design.motion)


def _trained(folder: DesignFolder) -> list[tuple[str, str]]:
    best = best_verdict(verdicts_of(folder))
    if best is None:
        return []
    return [
        ("held-out success", f"{format_share(best.success_share)} of {len(best.episodes)}"),
        ("valid", "yes" if best.valid else "no"),
        ("successful", "yes" if best.successful else "no"),
    ]


def _table(columns: tuple[Column, ...], *, pictures: bool = True) -> None:
    if not columns:
        with box("sheet empty"):
            text("There are no designs to compare yet.", "soft")
        return
    names = list(dict.fromkeys(name for column in columns for name, _ in column.rows))
    with box("sheet flush scroll"), box("list compare", "table"), box(tag="tbody"):
        with box(tag="tr"):
            text("measured", "unseen", "th")
            for column in columns:
                _title(column, pictures=pictures)
        for name in names:
            with box(tag="tr"):
                text(name, tag="th")
                for column in columns:
                    text(dict(column.rows).get(name, "–"), "numbers", "td")


def _title(column: Column, *, pictures: bool) -> None:
    status = column.design.status
    with box(tag="td"), box("stack tight"):
        if pictures:
            image(file_address(column.run, column.design.picture), f"design {status.number}")
            if column.motion:
                image(file_address(column.run, column.motion), "its motion", "wide")
        with box("row apart"):
            ui.link(f"{status.number}. {status.concept}", design_address(column.run, status.number))
            badge(status.outcome.outcome if status.outcome else status.state, column.design.warnings)
