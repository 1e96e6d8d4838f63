"""Set up a run: what is to be done, who designs, how much."""

from __future__ import annotations

from functools import partial
from typing import Any

from nicegui import app, events, run, ui
from pydantic import ValidationError

from aidsr.artifacts import EnvironmentSummary
from aidsr.errors import AidsrError, UserError
from aidsr.runs import Budget, Run, RunConfig
from aidsr.tasks import load_task, task_names
from aidsr.web.choosing_a_model import LIMITS, budget_from, choose_model, model_name
from aidsr.web.frame import frame
from aidsr.web.launching import Order, launch
from aidsr.web.live import say_mistake, working
from aidsr.web.parts import box, button, choice, fact, image, text
from aidsr.web.site import Site

__all__ = ["add_setup", "order_from"]

FRESH: dict[str, Any] = {
    "source": "task",
    "task": "reaching/button_pushing",
    "level": "standard",
    "objective": "",
    "environment": "",
    "environment_name": "",
    "robot": "",
    "robot_name": "",
    "kind": "builtin",
    "model": "",
    "concepts": RunConfig().concepts,
    "iterations": RunConfig().iterations,
    "max_output_tokens": RunConfig().max_output_tokens,
    "seed": RunConfig().seed,
    "human": True,
    "repairs": True,
    **dict.fromkeys(LIMITS),
}
"""The form as a new visitor finds it; what somebody filled in is kept for the next time."""
Form = dict[str, Any]


def add_setup(site: Site) -> None:
    """Answer at /new."""

    @ui.page("/new")
    def setup(task: str = "") -> None:
        form: Form = app.storage.user.setdefault("setup", {})
        for key, value in FRESH.items():
            form.setdefault(key, value)
        if task in task_names():
            form.update(source="task", task=task)
        with frame("New run"):
            with box("stack tight"):
                text("New run", tag="h1")
                text("Say what is to be done and who designs. The run goes on when this page is closed.", "soft", "p")
            _what(form)
            choose_model(site, form)
            _how_much(form)
            _start(site, form)


def order_from(site: Site, form: Form) -> Order:
    """Return what a filled-in form asks for.

    Raises:
        UserError: Something is missing or out of bounds.
    """
    whole = ("concepts", "iterations", "max_output_tokens", "seed")
    try:
        numbers = {key: int(form[key]) for key in whole}
    except (TypeError, ValueError):
        raise UserError("whole numbers were expected for concepts, iterations, tokens and seed; fill them in") from None
    name = model_name(site, form)
    budget = budget_from(form) if form["kind"] == "language" else Budget()
    try:
        config = RunConfig(model=name, human=form["human"], repairs=form["repairs"], budget=budget, **numbers)
    except ValidationError as error:
        first = error.errors()[0]
        raise UserError(f"{first['loc'][0]}: {first['msg']}, found {first['input']}; change it") from None
    if form["source"] == "task":
        return Order(config, task=form["task"], level=form["level"], robot=form["robot"])
    return Order(config, objective=form["objective"], environment=form["environment"], robot=form["robot"])


def _what(form: Form) -> None:
    with box("stack"):
        text("What is to be done", tag="h2")
        with ui.tabs().props("dense align=left no-caps") as kinds:
            ui.tab("task", "A task of the benchmark")
            ui.tab("words", "In your own words")
        kinds.on_value_change(lambda event: form.update(source=event.value))
        with ui.tab_panels(kinds, value=form["source"], animated=False).classes("full"):
            with ui.tab_panel("task"):
                _tasks(form)
            with ui.tab_panel("words"):
                _words(form)


def _tasks(form: Form) -> None:
    @ui.refreshable
    def cards() -> None:
        def take(name: str) -> None:
            form.update(task=name, level="standard")
            cards.refresh()

        with box("tasks", role="radiogroup", aria_label="task"):
            for name in task_names():
                with choice(partial(take, name), chosen=form["task"] == name):
                    image(f"/pictures/{name}.png", "", "shot task")
                    with box("words"):
                        text(name.rpartition("/")[2].replace("_", " "), tag="h3")
                        text(name.rpartition("/")[0], "small soft")
        task = load_task(form["task"])
        with box("sheet stack"):
            text(task.objective, "", "p")
            if task.hard:
                levels = ui.toggle({"standard": "Standard", "hard": "Hard"}, value=form["level"]).props(
                    "dense unelevated"
                )
                levels.on_value_change(lambda event: form.update(level=event.value))

    cards()


def _words(form: Form) -> None:
    with box("stack"):
        said = ui.textarea("Objective").props("outlined autogrow").bind_value(form, "objective")
        said.props.update({"placeholder": "Turn the knob at the end of the shaft by a quarter.", "maxlength": 4000})
        text(
            "The environment is MJCF without a robot. A site named mount or mount_… says where one may be attached.",
            "small soft",
        )
        _upload(form, "environment", "Environment (MJCF)")


def _upload(form: Form, key: str, what: str) -> None:
    """Take a file, look at it by strict rules in a limited process, and say what is in it."""

    @ui.refreshable
    def found(summary: EnvironmentSummary | None = None) -> None:
        if form[key]:
            with box("row"):
                text(f"{form[f'{key}_name']}, {len(form[key].encode()) / 1000:.1f} kB", "mono")
                button("Remove", remove, "bare", "close")
        if summary is not None:
            with box("facts"):
                fact("mounts", ", ".join(mount.name for mount in summary.mounts) or "none, only the world")
                fact("bodies", str(len(summary.bodies)))
                fact("sensors", str(len(summary.sensors)))

    def remove() -> None:
        form.update({key: "", f"{key}_name": ""})
        found.refresh()

    async def take(event: events.UploadEventArguments) -> None:
        upload.reset()
        try:
            mjcf = (await event.file.read()).decode("utf-8-sig")
            summary = await run.io_bound(_looked_at, key, mjcf)
        except UnicodeDecodeError:
            say_mistake(UserError(f"{event.file.name} is no text; give an MJCF file saved as UTF-8"))
        except AidsrError as error:
            say_mistake(UserError(f"{event.file.name} cannot be used: {error}"))
        else:
            form.update({key: mjcf, f"{key}_name": event.file.name[:100]})
            found.refresh(summary)

    upload = ui.upload(label=what, max_file_size=2_000_000, auto_upload=True, on_upload=take).props(
        "flat accept=.xml,.mjcf"
    )
    upload.on("rejected", lambda: say_mistake(UserError("an MJCF file of at most 2 MB was expected; make it smaller")))
    found()


def _looked_at(key: str, mjcf: str) -> EnvironmentSummary | None:
    from aidsr.sim.mjcf import read_mjcf
    from aidsr.sim.summary import summarize_environment

    if key == "environment":
        return summarize_environment(mjcf)
    read_mjcf(mjcf)
    return None


def _how_much(form: Form) -> None:
    with box("stack"):
        text("How much", tag="h2")
        with box("sheet stack"):
            with box("form"):
                _number(form, "concepts", "Concepts, side by side", 1, 20)
                _number(form, "iterations", "Repairs allowed for each", 0, 100)
            ui.switch("Ask me about each design that the Judge passed").bind_value(form, "human")
            with ui.expansion("More").props("dense dense-toggle").classes("full"), box("stack"):
                with box("form"):
                    _number(form, "max_output_tokens", "Output tokens of one call, at most", 256, 200_000)
                    _number(form, "seed", "Seed of the built-in rules", 0, 2**31)
                ui.switch("Put plain slips of a robot right by code").bind_value(form, "repairs")
                text("A robot to start from, if you have one", "label")
                _upload(form, "robot", "Robot (MJCF)")


def _number(form: Form, key: str, label: str, least: int, most: int) -> None:
    field = ui.number(label, min=least, max=most, step=1, precision=0, format="%d").props("outlined dense")
    field.bind_value(form, key)


def _start(site: Site, form: Form) -> None:
    def order() -> Run:
        return launch(site, order_from(site, form))

    def opened(made: Run) -> None:
        ui.navigate.to(f"/run/{made.path.name}")

    with box("row"):
        go = button("Start the run", lambda: working(go, order, opened), "primary", "play_arrow")
