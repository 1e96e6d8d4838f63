"""Probe a design (how far it gets on its task without learning), and replay the motions that were found."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from nicegui import app

from aidsr.apps.web.addresses import file_address
from aidsr.apps.web.form_values import limit, limit_field
from aidsr.apps.web.live import as_action, live, show_error, working
from aidsr.apps.web.measure_form import measure_arguments, measure_field
from aidsr.apps.web.recorded_episodes import Stage, record_probed
from aidsr.apps.web.site import Site
from aidsr.apps.web.study_runs import left_to_study
from aidsr.apps.web.view3d import Episode
from aidsr.apps.web.widgets import box, button, fact, image, long_text, stop_button, text
from aidsr.core.ends import ends_in_words
from aidsr.core.errors import UserError
from aidsr.runs import DesignFolder, Run
from aidsr.runs.files import JsonFile

if TYPE_CHECKING:
    from aidsr.learn.openloop import ProbeReport


_MAX_STEPS: dict[str, Any] = {"title": "Maximum physics steps", "whole": True, "empty": "the default"}
"""What the field for the physics steps takes."""


@dataclass(frozen=True)
class _State:
    approved: bool
    alive: bool
    doing: str
    """Progress of the running probe in words; empty where none is running or before its first motions."""
    written: int
    """Time at which the report was written [ns]; 0 while there is none."""
    output_tail: str
    """Last output of a probe that ended without a report; empty otherwise."""
    is_stopping: bool


def probe_panel(site: Site, run: Run, design: DesignFolder, stage: Stage) -> None:
    """Show the probe result of an approved design, and a button that starts a probe.

    Args:
        site: The site.
        run: The run of the design.
        design: The design.
        stage: View that plays its motions.
    """
    with box("stack wide"):
        live(partial(_state, site, run, design), partial(_draw, site, run, design))
        live(lambda: _state(site, run, design).written, lambda _written: _report(site, run, design, stage))


def _state(site: Site, run: Run, design: DesignFolder) -> _State:
    name, file = site.probe_name(run, design.number), design.probe
    written = file.stat().st_mtime_ns if file.exists() else 0
    alive = site.processes.is_alive(name)
    failed = not alive and written < 1e9 * site.processes.started_s(name)
    output_tail = site.processes.output_tail(name) if failed else ""
    told = site.processes.progress(name) if alive else None
    doing, is_stopping = told.doing if told else "", site.processes.is_stopping(name)
    return _State(design.final_scene.path.exists(), alive, doing, written, output_tail, is_stopping)


def _draw(site: Site, run: Run, design: DesignFolder, state: _State) -> None:
    if not state.approved:
        text("A design can be probed once it is approved.", "soft")
        return
    name = site.probe_name(run, design.number)
    choices: dict[str, Any] = app.storage.user.setdefault("probe", {"task": "", "max_steps": None})

    def start() -> None:
        steps = limit(value=choices.get("max_steps"), **_MAX_STEPS)
        bound = [] if steps is None else ["--max-steps", str(int(steps))]
        site.processes.start(name, ["probe", str(design.path), *measure_arguments(site, run, choices, name), *bound])

    if state.alive:
        with box("notice", role="status"), box("row apart"):
            text(state.doing or "Trying open-loop motions. This takes seconds to minutes.")
            stop_button(as_action(lambda: site.processes.stop(name)), is_stopping=state.is_stopping)
        return
    if left_to_study(site, run, "Its designs are probed by the plan of the study."):
        return
    with box("sheet stack"):
        text("Probe this design", tag="h2")
        text(
            "Tries up to 128 open-loop motions, or 256 with a goal, for each of two variations, and shows how far the "
            "robot gets without learning. This takes seconds to minutes.",
            "soft",
            "p",
        )
        measure_field(run, choices)
        with box("form"):
            most = limit_field(**_MAX_STEPS, step=100_000).props("stack-label").bind_value(choices, "max_steps")
            most.props["placeholder"] = "at least 300,000, with a goal 1,000,000"
        with box("row"):
            again = "Probe again" if state.written else "Start the probe"
            button(again, as_action(start), "quiet" if state.written else "primary", "play_arrow")
    if state.output_tail:
        text("Output of the last probe:", "label")
        long_text(state.output_tail, "last output", "last")


def _report(site: Site, run: Run, design: DesignFolder, stage: Stage) -> None:
    from aidsr.learn.openloop import ProbeReport

    report = JsonFile(design.probe, ProbeReport).read()
    if report is None:
        return
    with box("sheet stack", "article"):
        text("Probe result", tag="h2")
        count = len(report.variations)
        with box("facts"):
            fact("variations solved", f"{report.won} of {count}")
            fact("by the same motion", f"{round(report.same_motion_share * count)} of {count}")
            fact("mean best progress", f"{report.progress:.2f}")
            fact("motions tried", f"{report.motions} of {report.candidates} for each variation")
        for line in ends_in_words([one.episode for one in report.variations], report.hold_s):
            text(line, "small", "p")
        text(f"{report.why_ended.capitalize()}.", "", "p")
        if design.probe_picture.exists():
            name = f"designs/{design.number}/{design.probe_picture.name}"
            picture = file_address(run.name, name, version=str(_version(design)))
            image(picture, "snapshots of the best motion", "wide")
        _variations(site, run, design, stage, report)


def _version(design: DesignFolder) -> int:
    return design.probe_picture.stat().st_mtime_ns


def _variations(site: Site, run: Run, design: DesignFolder, stage: Stage, report: ProbeReport) -> None:
    with box("scroll", tabindex="0", role="region", aria_label="variations of the probe"), box("list plain", "table"):
        with box(tag="thead"), box(tag="tr"):
            for title in ("variation", "result of the best motion", "best progress", "final progress", "replay"):
                numbers = dict.fromkeys(("best progress", "final progress"), "num")
                text(title, (numbers | {"replay": "unseen"}).get(title, ""), "th")
        with box(tag="tbody"):
            for index, one in enumerate(report.variations):
                episode = one.episode
                with box(tag="tr"):
                    text(str(episode.variation), "", "td")
                    with box(tag="td"):
                        ended = f"{episode.ended.replace('_', ' ')} after {episode.time_s:.2f} s"
                        text(ended, "good" if episode.ended == "succeeded" else "")
                        text(one.motion.summary, "small soft", "p")
                    text(f"{episode.best_progress:.2f}", "num", "td")
                    text(f"{episode.progress:.2f}", "num", "td")
                    with box(tag="td"):
                        _replay(site, run, design, stage, index, episode.variation)


def _replay(site: Site, run: Run, design: DesignFolder, stage: Stage, index: int, variation: int) -> None:
    def then(episode: Episode) -> None:
        try:
            stage.play(episode)
        except UserError as error:
            show_error(error)

    def play() -> None:
        working(pressed, partial(record_probed, site, run, design, index), then)

    pressed = button("", play, "bare", "play_arrow", f"Replay motion of variation {variation}")
