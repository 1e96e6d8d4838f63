"""The form for a new run: task or objective, model, settings."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from nicegui import app, ui

from aidsr.apps.web.addresses import run_address
from aidsr.apps.web.form_values import whole_number, whole_number_field
from aidsr.apps.web.frame import frame
from aidsr.apps.web.launch import RunRequest, launch
from aidsr.apps.web.live import working
from aidsr.apps.web.model_form import budget_from, choose_model, model_name
from aidsr.apps.web.site import Site
from aidsr.apps.web.upload import ROBOT, upload
from aidsr.apps.web.widgets import box, button, choice, image, notice, text
from aidsr.apps.web.words_form import is_template, take_template, words_form
from aidsr.core.config import Budget, bounds, checked_config, run_settings
from aidsr.core.formatting import task_title
from aidsr.examples import examples
from aidsr.runs import Run
from aidsr.tasks import load_task, task_names

_NOT_HERE = ("model", "budget", "team", "tool_calls", "tool_minutes", "text_tools", "memory")
"""Settings of `RunConfig` that are left out below: the model and the budget have fields of their own; the measuring
team, its settings and a memory are not offered."""
SETTINGS = {name: field for name, field in run_settings().items() if name not in _NOT_HERE}
"""Fields of the form that come from `RunConfig`."""
_AT_FIRST_SIGHT = ("concepts", "iterations", "human", "task_feedback")
"""Settings shown at once; the others are under "More settings"."""
_ONLY_FOR = {
    "seed": ("builtin",),
    "max_output_tokens": ("language", "manual"),
    "judge_pictures": ("language", "manual"),
}
"""Designers to which a setting applies; a setting that is not named here applies to all."""

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
    **{name: field.default for name, field in SETTINGS.items()},
    "human": True,
    **dict.fromkeys(Budget.model_fields),
}
"""Default values of the form; a visitor's input is kept for the next visit."""
Form = dict[str, Any]


def add_setup(site: Site) -> None:
    """Add the page at /new."""

    @ui.page("/new")
    def setup(task: str = "", template: str = "") -> None:
        form: Form = app.storage.user.setdefault("setup", {})
        for key, value in FRESH.items():
            form.setdefault(key, value)
        if form["task"] not in task_names():  # its package was uninstalled since
            form.update(task=FRESH["task"], level=FRESH["level"])
        if task in task_names():
            form.update(source="task", task=task)
        kept = template in examples() and not is_template(form)
        if template in examples() and not kept:
            take_template(form, template)
        if template:
            form["source"] = "words"
        with frame("New run", site=site):
            with box("stack tight"):
                text("New run", tag="h1")
                text("Choose the task and the designer. The run continues if you close this page.", "soft", "p")
                ui.link("Compare models or methods over many runs: start a study", "/studies/new").classes("small")
            if kept:
                notice(
                    f'Your own words are kept. To replace them by "{examples()[template].title}", start from it below.'
                )
            objective = _what(form)
            choose_model(site, form)
            _how_much(form)
            _start(site, form, objective)


def request_from(site: Site, form: Form) -> RunRequest:
    """Return the run that a filled-in form describes.

    Raises:
        UserError: An entry is missing or out of bounds.
    """
    budget = budget_from(form) if form["kind"] == "language" else Budget()
    settings = {
        name: whole_number(field.title or name, form[name], **_bounds(name)) if field.annotation is int else form[name]
        for name, field in SETTINGS.items()
        if _applies(name, form["kind"])
    }
    config = checked_config({"model": model_name(site, form), "budget": budget, **settings})
    if form["source"] == "task":
        return RunRequest(config, task=form["task"], level=form["level"], robot=form["robot"])
    return RunRequest(
        config,
        objective=form["objective"],
        environment=form["environment"],
        goal=form["goal"],
        robot=form["robot"],
    )


def _what(form: Form) -> ui.textarea:
    """Ask for a task or an objective; return the field of the objective."""
    with box("stack"):
        text("Task", tag="h2")
        with ui.tabs().props("dense align=left no-caps") as kinds:
            ui.tab("task", "Benchmark task")
            ui.tab("words", "Custom task")
        kinds.on_value_change(lambda event: form.update(source=event.value))
        with ui.tab_panels(kinds, value=form["source"], animated=False).classes("full"):
            with ui.tab_panel("task"):
                _tasks(form)
            with ui.tab_panel("words"):
                return words_form(form)


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
                        text(task_title(name), tag="h3")
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


def _how_much(form: Form) -> None:
    with box("stack"):
        text("Settings", tag="h2")
        with box("sheet stack"):
            _settings(form, _AT_FIRST_SIGHT)
            with ui.expansion("More settings").props("dense dense-toggle").classes("full"), box("stack full"):
                _settings(form, [name for name in SETTINGS if name not in _AT_FIRST_SIGHT])
                text("Initial robot (optional)", "label")
                upload(form, ROBOT)


def _settings(form: Form, names: Sequence[str]) -> None:
    """Show a number field or a switch for each setting that applies to the designer, with its label and bounds."""
    with box("form"):
        for name in names:
            if SETTINGS[name].annotation is int:
                field = whole_number_field(SETTINGS[name].title or name, **_bounds(name)).bind_value(form, name)
                field.bind_visibility_from(form, "kind", partial(_applies, name))
    for name in names:
        if SETTINGS[name].annotation is bool:
            switch = ui.switch(SETTINGS[name].title or name).bind_value(form, name)
            switch.bind_visibility_from(form, "kind", partial(_applies, name))


def _applies(name: str, kind: str) -> bool:
    """Return whether a setting applies to a kind of designer."""
    return kind in _ONLY_FOR.get(name, (kind,))


def _bounds(name: str) -> dict[str, int]:
    """Return the bounds of a whole-number setting, as arguments of `whole_number`."""
    within = bounds(SETTINGS[name])
    return {"least": int(within["ge"]), **({"most": int(within["le"])} if "le" in within else {})}


def _start(site: Site, form: Form, objective: ui.textarea) -> None:
    def request() -> Run:
        return launch(site, request_from(site, form))

    def opened(made: Run) -> None:
        form.update(robot="", robot_name="")  # an initial robot is for one run only
        ui.navigate.to(run_address(made.name))

    def begin() -> None:
        if form["source"] == "words" and not str(form["objective"] or "").strip():
            objective.error = "Describe what the robot should do."
            objective.run_method("focus")  # this also scrolls to the field
            return
        working(go, request, opened)

    def leave_out() -> None:
        form.update(robot="", robot_name="")
        ui.navigate.reload()

    with box("notice row", role="status") as begins:
        said = ui.label().classes("grow")
        said.bind_text_from(form, "robot_name", lambda name: f"The run starts from your robot: {name}")
        button("Remove robot", leave_out, "quiet", "close")
    begins.bind_visibility_from(form, "robot", bool)
    with box("row"):
        go = button("Start the run", begin, "primary", "play_arrow")
