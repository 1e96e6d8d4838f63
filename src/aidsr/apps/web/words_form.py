"""An objective in one's own words: its environment with a picture, and its goal, checked as it is typed."""

from __future__ import annotations

import base64
from typing import Any

from nicegui import run as background
from nicegui import ui

from aidsr.apps.web.upload import ENVIRONMENT, GOAL, upload
from aidsr.apps.web.widgets import box, fact, notice, text
from aidsr.core.errors import AidsrError
from aidsr.examples import examples

Form = dict[str, Any]


def take_template(form: Form, name: str) -> None:
    """Fill a form with a template."""
    template = examples()[name]
    form.update(
        source="words",
        objective=template.objective,
        environment=template.environment,
        environment_name=f"{name}.xml",
        goal=template.goal,
        goal_name=f"{name}.toml",
    )


def words_form(form: Form) -> None:
    """Ask what is to be done, where, and what counts as success."""

    def take(name: object) -> None:
        if name in examples():
            take_template(form, str(name))
            ui.navigate.to(f"/new?template={name}")

    with box("stack"):
        offered = ui.select({name: each.title for name, each in examples().items()}, label="Start from a template")
        offered.props("outlined dense").on_value_change(lambda event: take(event.value))
        objective = ui.textarea("Objective").props("outlined autogrow").bind_value(form, "objective")
        objective.props.update(
            {"placeholder": "Turn the knob at the end of the shaft by a quarter.", "maxlength": 4000}
        )
        text(
            "The environment is MJCF without a robot. A robot may be attached at a site named mount or mount_…",
            "small soft",
        )
        upload(form, ENVIRONMENT)
        _preview(form)
        _goal(form)


def _preview(form: Form) -> None:
    """Show the environment as soon as there is one."""
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


def _goal(form: Form) -> None:
    with box("stack tight"):
        field = ui.textarea("Goal (TOML)").props("outlined autogrow debounce=500").classes("mono")
        field.bind_value(form, "goal")
        field.props.update({"maxlength": GOAL.most_bytes, "placeholder": 'kind = "touch"\ntarget = "bell"'})
        text(
            "It defines success: kind is reach, lift, travel or touch; then target, hold_s, time_limit_s, base, "
            "vary_m, and within_m, by_m, distance_m and direction, or force_n and at_most_n. Only training needs it.",
            "small soft",
        )
        with box("live") as said:
            pass

        async def check() -> None:
            goal = str(form["goal"] or "")
            found: Any = ()
            if goal.strip():
                try:
                    found = await background.io_bound(GOAL.look, goal, dict(form))
                except AidsrError as error:
                    found = str(error)
            if said.is_deleted or goal != str(form["goal"] or ""):
                return
            said.clear()
            with said:
                if isinstance(found, str):
                    notice(found, "bad")
                elif found:
                    with box("facts"):
                        for name, value in found:
                            fact(name, value)

        field.on_value_change(check)
        ui.timer(0.1, check, once=True)
        upload(form, GOAL)
