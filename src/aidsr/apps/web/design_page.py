"""The page of a design: view it, review it, inspect each iteration, probe and train it, export it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from nicegui import app, ui

from aidsr.apps.web.addresses import design_address, download_address, export_address, file_address, run_address
from aidsr.apps.web.comparison import measured_in_words
from aidsr.apps.web.conversation import conversation
from aidsr.apps.web.frame import frame
from aidsr.apps.web.live import live
from aidsr.apps.web.mjcf_panel import mjcf_panel
from aidsr.apps.web.probe_panel import probe_panel
from aidsr.apps.web.recorded_episodes import Motion, Stage, list_motions
from aidsr.apps.web.review_panel import Draft, part_names, review_panel
from aidsr.apps.web.run_page import cannot_open, concept_in_words
from aidsr.apps.web.scene_panel import show_scene, target_of
from aidsr.apps.web.site import DesignView, Shown, Site, state_of
from aidsr.apps.web.training_panel import training_panel
from aidsr.apps.web.view3d import Episode, Model
from aidsr.apps.web.widgets import (
    badge,
    box,
    button,
    clock,
    fact,
    fault_found,
    image,
    notice,
    points,
    strip,
    text,
    usage_facts,
)
from aidsr.core.artifacts import Critique, Outcome
from aidsr.core.errors import AidsrError
from aidsr.core.formatting import counted, format_duration
from aidsr.runs import DesignFolder, Run
from aidsr.runs.compare import Comparison, attempted, compare
from aidsr.runs.event_text import DOING
from aidsr.runs.status import newest

_TABS = {
    "found": "Findings",
    "concept": "Concept",
    "mjcf": "MJCF",
    "log": "Log",
    "probe": "Probe",
    "training": "Training",
}


@dataclass(frozen=True)
class _Page:
    """A design, and which of its iterations is selected."""

    site: Site
    run: Run
    folder: DesignFolder
    chosen: int
    """Number of the selected iteration; 0 for the one that the design currently stands at."""
    stage: Stage

    def read(self) -> tuple[DesignView, Shown, int]:
        """Return the design, the state of its run, and the number of the selected iteration."""
        view = self.site.view(self.run)
        design = view.design(self.folder.number)
        numbers = [iteration.number for iteration in design.iterations]
        return design, view.shown, self.chosen if self.chosen in numbers else design.status.stands_at

    def number(self) -> int:
        """Return the number of the selected iteration."""
        return self.read()[2]

    def titled(self) -> tuple[str, str, int, int, int]:
        """Return title, state, selected iteration, iteration that the design stands at, and warnings at the latter."""
        design, shown, number = self.read()
        return self.title(), state_of(shown, design), number, design.status.stands_at, design.warnings

    def title(self) -> str:
        """Return the number of the design and the name of its concept at the selected iteration."""
        design, _, number = self.read()
        concept = newest(iteration.concept.read() for iteration in self.folder.leading_to(number))
        return f"{self.folder.number}. {concept.name if concept else design.status.concept}"

    def awaited(self) -> tuple[int, int]:
        """Return the selected iteration, and the one that waits for a decision; 0 for none."""
        design, _, number = self.read()
        return number, design.status.stands_at if design.status.state == "waiting" else 0

    def seen(self) -> tuple[int, bool, bool, tuple[Motion, ...]]:
        """Return the selected iteration, whether its scene is validated and has a picture, and the recorded motions."""
        number = self.number()
        iteration = self.folder.iteration(number)
        validated, pictured = iteration.scene_report.path.exists(), iteration.preview.path.exists()
        return number, validated, pictured, list_motions(self.folder)


def add_design_page(site: Site) -> None:
    """Add the page at /run/NAME/NUMBER."""

    @ui.page("/run/{name}/{number}")
    def design_page(name: str, number: int, iteration: int = 0, tab: str = "") -> None:
        try:
            run, folder = site.design(name, number)
            page = _Page(site, run, folder, iteration, Stage())
            name_now, task = page.title(), site.view(run).title
        except AidsrError as error:
            cannot_open(site, name, error, number=number)
            return
        with frame(name_now, *site.way_to(name), (task, run_address(name)), site=site):
            with box("stack"):
                with box("row apart top"):
                    live(page.titled, _title)
                    live(lambda: page.read()[0].status.outcome, partial(_actions, page))
                text(f"Task: {task}", "soft", "p")
                live(page.read, _head)
            with box("split beside"):
                with box("stack wide"):
                    live(page.seen, partial(_scene, page))
                    with box("stack wide iterations"):
                        live(page.read, partial(_iterations, page))
                with box("stack wide"):
                    live(page.awaited, partial(_review, page))
                    with box("stack wide tabs"):
                        _tabs(page, tab)


def _title(facts: tuple[str, str, int, int, int]) -> None:
    title, state, number, newest_number, warnings = facts
    with box("row grow"):
        text(title, tag="h1")
        if number in (0, newest_number):
            badge(state, warnings)
        else:
            text(f"iteration {number} (not the current one)", "badge waiting")
            ui.link(f"Go to the current iteration, {newest_number}", "?")


def _actions(page: _Page, outcome: Outcome | None) -> None:
    run, number = page.run.name, page.folder.number
    with box("row"):
        if outcome and outcome.outcome == "approved":
            hint = "Parts to print, motors, cables and an assembly sheet"
            button("Export", lambda: ui.navigate.to(export_address(run, number)), "quiet", "construction", hint)
        hint = "Folder of this design as a ZIP file"
        button("Download", lambda: ui.download(download_address(run, number)), "quiet", "download", hint)


def _head(facts: tuple[DesignView, str, int]) -> None:
    design, shown, _ = facts
    status = design.status
    with box("stack"):
        with box("facts"):
            if design.held_out:
                won, episodes = design.held_out
                fact("held-out success", f"{won} of {episodes}")
                fact("policy", "successful" if design.successful else "valid" if design.valid else "not valid")
            fact("family", status.family)
            fact("iterations", str(status.iteration))
            fact("time", format_duration(status.latency_s))
            usage_facts(status.usage)
            if status.mechanical_repairs:
                fact("automatic fixes", str(status.mechanical_repairs))
        if status.outcome:
            notice(status.outcome.reason, "good" if status.outcome.outcome == "approved" else "bad")
        elif status.stopped:
            notice(f"Stopped: {status.stopped.message}", "bad")
        elif status.doing and shown == "running":
            with box("row small"):
                text(f"{DOING[status.doing][0].upper()}{DOING[status.doing][1:]}", "accent")
                clock(design.since)


def _scene(page: _Page, seen: tuple[int, bool, bool, tuple[Motion, ...]]) -> None:
    number, _, _, motions = seen
    iteration = page.folder.iteration(number)
    scene = iteration.scene.read()
    state = attempted(page.folder, number)
    report = (iteration.scene_report if scene else iteration.robot_report).read()
    robot = newest(it.robot.read() for it in page.folder.leading_to(number))
    model = Model(
        scene.mjcf if scene else state.robot,
        environment="" if scene else page.run.brief().environment,
        groups=robot.actuator_groups if robot else (),
        episodes=tuple(Episode.read(motion.path, motion.name) for motion in motions),
        before=_before(page, number, whole=scene is not None),
        target=target_of(page.run),
    )
    page.stage.view = show_scene(
        model,
        f"{page.run.name} design {page.folder.number} iteration {number}",
        _picture(page, number),
        faults=report.errors if report else (),
        on_pick=Draft(page.run, iteration).pin,
    )


def _before(page: _Page, number: int, *, whole: bool) -> str:
    """Return the MJCF of the newest earlier scene, or robot unless `whole`; empty where there is none."""
    earlier = [it for it in page.folder.leading_to(number) if it.number < number]
    if whole:
        scene = newest(it.scene.read() for it in earlier)
        return scene.mjcf if scene else ""
    robot = newest(it.robot.read() for it in earlier)
    return robot.mjcf if robot else ""


def _iterations(page: _Page, facts: tuple[DesignView, str, int]) -> None:
    design, shown, number = facts
    address = partial(design_address, page.run.name, page.folder.number)
    if page.folder.iteration(number).motion.path.exists():
        with box("sheet flush", "figure"):
            motion = f"designs/{page.folder.number}/{number:02d}/motion.png"
            image(file_address(page.run.name, motion), "motion while the actuators sweep their ranges", "wide")
    with box("sheet stack", "section", aria_label="iterations"):
        text("Iterations", tag="h2")
        if len(design.iterations) > 1:
            with box("film"):
                for iteration in design.iterations:
                    at = iteration.number
                    _frame(page, at, address(iteration=at), current=at == number)
        working = shown not in ("interrupted", "stopped")
        strip(design.iterations, lambda each: address(iteration=each), at_work=working)


def _frame(page: _Page, number: int, address: str, *, current: bool) -> None:
    with ui.link(target=address) as link:
        image(_picture(page, number), f"iteration {number}", "thumb")
        text(str(number))
    link.props["aria-current"] = "true" if current else "false"


def _picture(page: _Page, number: int) -> str:
    """Return the address of an iteration's picture; empty where there is none."""
    exists = page.folder.iteration(number).preview.path.exists()
    picture = f"designs/{page.folder.number}/{number:02d}/preview.png" if exists else ""
    return file_address(page.run.name, picture)


def _review(page: _Page, numbers: tuple[int, int]) -> None:
    number, waiting = numbers
    if not waiting:
        return
    if number != waiting:
        with box("notice wait", role="status"), box("row apart"):
            text(f"Iteration {waiting} waits for your decision.")
            ui.link(f"Go to iteration {waiting}", "?")
        return
    scene = page.folder.iteration(number).scene.xml.read_text()
    review_panel(page.site, page.run, page.folder, number, part_names(scene) if scene else [])


def _tabs(page: _Page, wanted: str) -> None:
    opened = wanted or app.storage.user.get("design_tab", "found")
    with ui.tabs().props("dense align=left no-caps") as tabs:
        for key, title in _TABS.items():
            ui.tab(key, title)
    tabs.on_value_change(lambda event: app.storage.user.update(design_tab=event.value))
    with ui.tab_panels(tabs, value=opened if opened in _TABS else "found", animated=False).classes("full"):
        with ui.tab_panel("found"):
            live(page.read, partial(_found, page))
        with ui.tab_panel("concept"):
            live(
                page.number, lambda number: concept_in_words(attempted(page.folder, number).concept if number else None)
            )
        with ui.tab_panel("mjcf"):
            live(page.number, partial(mjcf_panel, page.run, page.folder))
        with ui.tab_panel("log"):
            conversation(page.run, page.folder.number)
        with ui.tab_panel("probe"):
            probe_panel(page.site, page.run, page.folder, page.stage)
        with ui.tab_panel("training"):
            training_panel(page.site, page.run, page.folder, page.stage)


def _found(page: _Page, facts: tuple[DesignView, str, int]) -> None:
    number = facts[2]
    if not number:
        text("There are no findings yet.", "soft")
        return
    iteration = page.folder.iteration(number)
    with box("stack wide"):
        if number > 1:
            _change(compare(attempted(page.folder, number - 1), attempted(page.folder, number)), number - 1)
        critique = iteration.critique.read()
        if critique:
            with box("stack"):
                text("Judge", tag="h2")
                _critique(critique)
        tried = iteration.task_report.read()
        if tried:
            with box("stack"):
                text(f"Tried on its task: {tried.phase.replace('_', ' ')}, progress {tried.progress:.2f}", tag="h2")
                before = newest(it.task_report.read() for it in page.folder.leading_to(number) if it.number < number)
                if before:
                    phase = before.phase.replace("_", " ")
                    text(f"Previous iteration: {phase}, progress {before.progress:.2f}.", "small soft", "p")
                _critique(tried.critique)
        report = iteration.scene_report.read() or iteration.robot_report.read()
        if report is None:
            text("This iteration has not been validated yet.", "soft")
            return
        with box("stack"):
            what = "the scene" if iteration.scene_report.path.exists() else "the robot alone"
            many = counted(len(report.errors), "fault")
            stable = many if report.errors else "stable, with warnings" if report.warnings else "stable, no faults"
            text(f"Validation of {what}: {stable}", tag="h2")
            for fault in (*report.errors, *report.warnings):
                fault_found(fault)
        measured = measured_in_words(report.measurements)
        if measured:
            with box("facts"):
                for name, value in measured:
                    fact(name, value)
        repairs = iteration.repairs.read()
        if repairs:
            with box("stack tight"):
                text("Automatic fixes", "label")
                points(repairs.notes)


def _critique(critique: Critique) -> None:
    text(critique.summary, "pre", "p")
    points(f"{one.component} ({one.blame}): {one.problem} {one.suggestion}" for one in critique.issues)


def _change(change: Comparison, before: int) -> None:
    with box("sheet stack"):
        text(f"Changes since iteration {before}", tag="h2")
        if not (change.changed or change.better or change.worse):
            text("No changes.", "soft")
        for title, sentences, kind in (
            ("changed", change.changed, ""),
            ("better", change.better, "better"),
            ("worse", change.worse, "worse"),
        ):
            if sentences:
                with box("stack tight"):
                    text(title, "label")
                    points(sentences, kind)
