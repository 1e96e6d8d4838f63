"""Two to four designs side by side: views with linked cameras, the same episode, concepts, curves, and differences."""

from __future__ import annotations

from dataclasses import dataclass

from fastapi import Query
from nicegui import run as background
from nicegui import ui

from aidsr.apps.web.addresses import design_address, file_address
from aidsr.apps.web.comparison import compare_measured
from aidsr.apps.web.curve import CURVE_COLOURS, curves_svg
from aidsr.apps.web.designs_page import MOST_COMPARED, designs_to_pick
from aidsr.apps.web.form_values import whole_number_field
from aidsr.apps.web.frame import frame
from aidsr.apps.web.live import as_action, show_error
from aidsr.apps.web.mjcf_text import difference
from aidsr.apps.web.recorded_episodes import record
from aidsr.apps.web.run_page import concept_in_words, not_found
from aidsr.apps.web.scene_panel import show_scene, target_of
from aidsr.apps.web.site import Site
from aidsr.apps.web.view3d import Model, SceneView
from aidsr.apps.web.widgets import box, button, fault_found, text
from aidsr.core.artifacts import Robot
from aidsr.core.config import VERDICT_EPISODES
from aidsr.core.errors import AidsrError, UserError
from aidsr.runs import DesignFolder, Run
from aidsr.runs.compare import attempted
from aidsr.runs.status import newest
from aidsr.runs.trainings import Training, best_training, read_curve, without_tests


@dataclass(frozen=True)
class _Compared:
    """A design to compare, at the iteration it stands at."""

    site: Site
    run: Run
    folder: DesignFolder

    @property
    def name(self) -> str:
        status = self.site.view(self.run).design(self.folder.number).status
        return f"{status.number}. {status.concept}"

    @property
    def stands_at(self) -> int:
        return self.site.view(self.run).design(self.folder.number).status.stands_at

    @property
    def robot(self) -> Robot | None:
        """Its robot; None before there is one."""
        return newest(it.robot.read() for it in self.folder.leading_to(self.stands_at))

    @property
    def mjcf(self) -> str:
        """MJCF of its robot; empty before there is one."""
        return self.robot.mjcf if self.robot else ""

    @property
    def training(self) -> Training | None:
        """The training of its best policy, to which the measured table refers too; None before there is one."""
        return best_training(self.folder)


def add_compare_page(site: Site) -> None:
    """Add the page at /compare, for designs named as RUN/NUMBER."""

    @ui.page("/compare")
    def compare_page(design: list[str] = Query(default=[])) -> None:  # noqa: B008  # as FastAPI requires
        try:
            compared = [_found(site, each) for each in design[:MOST_COMPARED]]
        except AidsrError as error:
            not_found(error)
            return
        if len(compared) < 2:
            _nothing_picked(site, compared)
            return
        with frame("Compare", ("Runs", "/"), ("Designs", "/designs"), site=site):
            text("Compare designs", tag="h1")
            with box("columns views"):
                views = [_view(one) for one in compared]
            _same_episode(compared, views)
            compare_measured(site, [(one.run, one.folder.number) for one in compared])
            _curves(compared)
            with box("columns"):
                for one in compared:
                    with box("sheet stack", "section", aria_label=f"concept of {one.name}"):
                        text(one.name, tag="h2")
                        concept_in_words(attempted(one.folder, one.stands_at).concept if one.stands_at else None)
                        _faults(one)
            _mjcf(compared)


def _nothing_picked(site: Site, picked: list[_Compared]) -> None:
    """Explain what a comparison needs, and offer all designs for selection."""
    with frame("Compare", ("Runs", "/"), ("Designs", "/designs"), site=site):
        text("Compare designs", tag="h1")
        told = (
            "Select two to four designs of any runs. Their 3-D views turn together, and their measurements, learning "
            "curves, concepts, faults and MJCF are shown side by side."
        )
        text(told, "soft", "p")
        designs_to_pick(site, tuple(f"{one.run.name}/{one.folder.number}" for one in picked))


def _found(site: Site, named: str) -> _Compared:
    name, _, number = named.rpartition("/")
    if not number.isdecimal():
        raise UserError(f'"{named[:80]}" is not a design; expected RUN/NUMBER')
    run, folder = site.design(name, int(number))
    site.view(run).design(folder.number)
    return _Compared(site, run, folder)


def _view(one: _Compared) -> SceneView | None:
    iteration = one.folder.iteration(one.stands_at)
    scene = iteration.scene.read()
    picture = f"designs/{one.folder.number}/{one.stands_at:02d}/preview.png" if iteration.preview.path.exists() else ""
    model = Model(
        scene.mjcf if scene else one.mjcf,
        environment="" if scene else one.run.brief().environment,
        groups=one.robot.actuator_groups if one.robot else (),
        target=target_of(one.run),
    )
    with box("stack tight"):
        ui.link(one.name, design_address(one.run.name, one.folder.number)).classes("strong")
        return show_scene(model, one.name, file_address(one.run.name, picture), together=True)


def _same_episode(compared: list[_Compared], views: list[SceneView | None]) -> None:
    ready = [(one.training, view) for one, view in zip(compared, views, strict=True) if one.training and view]
    if not ready:
        return

    async def play() -> None:
        if not field.validate():
            return  # the field, beside the button, says what is allowed
        go.props["loading"] = True
        try:
            for training, view in ready:
                episode = await background.io_bound(record, compared[0].site, training, int(field.value))
                if episode is not None:
                    view.play(episode, scroll=False)
        except AidsrError as error:
            show_error(error)
        finally:
            go.props["loading"] = False

    with box("row"):
        field = whole_number_field("Held-out variation", least=0, most=VERDICT_EPISODES - 1)
        field.style("min-width: 170px").value = 0
        go = button("Play in all views", play, "primary", "play_arrow")
        if len(ready) < len(compared):
            text("Designs without a policy do not move.", "small soft")


def _curves(compared: list[_Compared]) -> None:
    curves = [(one.name, without_tests(one.training, read_curve(one.training))[0]) for one in compared if one.training]
    if not curves:
        return
    with box("sheet stack", "section", aria_label="learning curves"):
        text("Training success", tag="h2")
        ui.html(curves_svg(curves), sanitize=False).classes("full")
        with box("row small"):
            for (name, _), colour in zip(curves, CURVE_COLOURS, strict=False):
                with box("row"):
                    with box("swatch", style=f"background: {colour}"):
                        pass
                    text(name)


def _faults(one: _Compared) -> None:
    iteration = one.folder.iteration(one.stands_at)
    report = iteration.scene_report.read() or iteration.robot_report.read()
    for fault in (*report.errors, *report.warnings) if report else ():
        fault_found(fault)


def _mjcf(compared: list[_Compared]) -> None:
    names = {index: one.name for index, one in enumerate(compared)}
    with box("sheet stack", "section", aria_label="differences in MJCF"):
        text("Differences in the MJCF of the robots", tag="h2")
        with box("row"):
            first = ui.select(names, value=0, label="from").props("outlined dense")
            second = ui.select(names, value=1, label="to").props("outlined dense")
        with box() as place:
            pass

        def draw() -> None:
            place.clear()
            with place:
                html = difference(compared[int(first.value)].mjcf, compared[int(second.value)].mjcf)
                if html:
                    shown = ui.html(html, sanitize=False).classes("code full")
                    shown.props.update({"tabindex": "0", "role": "region", "aria-label": "differences"})
                else:
                    text("No differences.", "soft")

        for field in (first, second):
            field.on_value_change(as_action(draw))
        draw()
