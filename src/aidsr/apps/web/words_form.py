"""The form for an objective in words: its environment with a picture, and its goal, checked while it is typed."""

from __future__ import annotations

import base64

from nicegui import run as background
from nicegui import ui

from aidsr.apps.web.goal_form import goal_form
from aidsr.apps.web.upload import ENVIRONMENT, Form, upload
from aidsr.apps.web.widgets import box, button, notice, text
from aidsr.core.errors import AidsrError
from aidsr.examples import examples

_WORDS = ("objective", "environment", "environment_name", "goal", "goal_name")
"""Entries of the form that a template replaces."""


def take_template(form: Form, name: str) -> None:
    """Fill a form with a template; a person's own words are kept, see `take_back`."""
    if not is_template(form):
        form["replaced"] = {key: form[key] for key in _WORDS}
    template = examples()[name]
    form.update(
        source="words",
        objective=template.objective,
        environment=template.environment,
        environment_name=f"{name}.xml",
        goal=template.goal,
        goal_name=f"{name}.toml",
    )


def take_back(form: Form) -> None:
    """Put a person's own words back in the place of the template that replaced them."""
    form.update(form.pop("replaced", None) or {})


def is_template(form: Form) -> bool:
    """Whether the form's words are empty or those of a template, so that nothing is lost if another one is taken."""
    words = (form["objective"], form["environment"], form["goal"])
    return not any(words) or any(words == (each.objective, each.environment, each.goal) for each in examples().values())


def words_form(form: Form) -> ui.textarea:
    """Ask for the objective, the environment and the goal; return the field of the objective."""

    def take(name: object) -> None:
        if name in examples():
            take_template(form, str(name))
            ui.navigate.to("/new")  # without the template, which would be taken again whenever the page is loaded

    def undo() -> None:
        take_back(form)
        ui.navigate.to("/new")

    with box("stack"):
        if form.get("replaced"):
            with box("notice", role="status"), box("row apart"):
                text("The template replaced your own words.")
                button("Undo", undo, "quiet", "undo")
        offered = ui.select({name: each.title for name, each in examples().items()}, label="Start from a template")
        offered.props("outlined dense").on_value_change(lambda event: take(event.value))
        objective = ui.textarea("Objective").props("outlined autogrow").bind_value(form, "objective")
        objective.on_value_change(lambda: setattr(objective, "error", None))
        objective.props.update(
            {"placeholder": "Turn the knob at the end of the shaft by a quarter.", "maxlength": 4000}
        )
        text(
            "The environment is MJCF without a robot. A robot can be attached at sites named mount or mount_…",
            "small soft",
        )
        upload(form, ENVIRONMENT)
        _preview(form)
        goal_form(form)
    return objective


def _preview(form: Form) -> None:
    """Show a picture of the environment as soon as there is one."""
    shown: dict[str, str] = {"environment": ""}
    with box("preview") as place:
        pass

    async def draw() -> None:
        if form["environment"] == shown["environment"]:
            return
        shown["environment"] = form["environment"]
        place.clear()
        if not form["environment"]:
            return
        drawn: bytes | str | None
        try:
            drawn = await background.io_bound(_picture, form["environment"])
        except AidsrError as error:
            drawn = str(error)
        if drawn is None or place.is_deleted:
            return
        with place:
            if isinstance(drawn, str):
                notice(drawn, "bad")
            else:
                data = f"data:image/png;base64,{base64.b64encode(drawn).decode()}"
                with box("environment", "img", src=data, alt="the environment, without a robot"):
                    pass

    ui.timer(1.0, draw)


def _picture(environment: str) -> bytes:
    from aidsr.render.pictures import picture
    from aidsr.render.view import View

    return picture(environment, width=480, height=320, view=View(authored=True))
