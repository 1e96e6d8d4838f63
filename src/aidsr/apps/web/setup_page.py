"""Set up a run: what is to be done, who designs, how much."""

from __future__ import annotations

from functools import partial
from typing import Any

from nicegui import app, ui
from pydantic import ValidationError

from aidsr.apps.web.frame import frame
from aidsr.apps.web.launch import RunRequest, launch
from aidsr.apps.web.live import working
from aidsr.apps.web.model_form import LIMITS, budget_from, choose_model, model_name
from aidsr.apps.web.site import Site
from aidsr.apps.web.upload import ENVIRONMENT, GOAL, ROBOT, upload
from aidsr.apps.web.widgets import box, button, choice, image, text
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import UserError
from aidsr.runs import Run
from aidsr.tasks import load_task, task_names

FRESH: dict[str, Any] = {
    "source": "task",
    "task": "reaching/button_pushing",
    "level": "standard",
    "objective": "",
    "environment": "",
    "environment_name": "",
    "goal": "",
    "goal_name": "",
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
    "task_feedback": False,
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
        if form["task"] not in task_names():  # of a package that was taken away since
            form.update(task=FRESH["task"], level=FRESH["level"])
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


def request_from(site: Site, form: Form) -> RunRequest:
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
    switches = {key: form[key] for key in ("human", "repairs", "task_feedback")}
    try:
        config = RunConfig(model=name, budget=budget, **switches, **numbers)
    except ValidationError as error:
        first = error.errors()[0]
        raise UserError(f"{first['loc'][0]}: {first['msg']}, found {first['input']}; change it") from None
    if form["source"] == "task":
        return RunRequest(config, task=form["task"], level=form["level"], robot=form["robot"])
    return RunRequest(
        config,
        objective=form["objective"],
        environment=form["environment"],
        goal=form["goal"],
        robot=form["robot"],
    )


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
        upload(form, ENVIRONMENT)
        text(
            "A goal, a short TOML file, says when the robot has done it: reach, lift, travel or touch. Only training "
            "needs it.",
            "small soft",
        )
        upload(form, GOAL)


def _how_much(form: Form) -> None:
    with box("stack"):
        text("How much", tag="h2")
        with box("sheet stack"):
            with box("form"):
                _number(form, "concepts", "Concepts, side by side", 1, 20)
                _number(form, "iterations", "Repairs allowed for each", 0, 100)
            ui.switch("Ask me about each design that the Judge passed").bind_value(form, "human")
            tried = ui.switch("Try each design that the Judge passed on its task, and send back what falls short")
            tried.bind_value(form, "task_feedback")
            with ui.expansion("More").props("dense dense-toggle").classes("full"), box("stack"):
                with box("form"):
                    _number(form, "max_output_tokens", "Output tokens of one call, at most", 256, 200_000)
                    _number(form, "seed", "Seed of the built-in rules", 0, 2**31)
                ui.switch("Put plain slips of a robot right by code").bind_value(form, "repairs")
                text("A robot to start from, if you have one", "label")
                upload(form, ROBOT)


def _number(form: Form, key: str, label: str, least: int, most: int) -> None:
    field = ui.number(label, min=least, max=most, step=1, precision=0, format="%d").props("outlined dense")
    field.bind_value(form, key)


def _start(site: Site, form: Form) -> None:
    def request() -> Run:
        return launch(site, request_from(site, form))

    def opened(made: Run) -> None:
        ui.navigate.to(f"/run/{made.path.name}")

    with box("row"):
        go = button("Start the run", lambda: working(go, request, opened), "primary", "play_arrow")
