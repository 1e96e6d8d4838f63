"""The form for a goal, which defines success: begun from a template of its kind, and checked while it is typed."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from typing import Any

from nicegui import run as background
from nicegui import ui

from aidsr.apps.web.docs_page import docs_address
from aidsr.apps.web.upload import GOAL, Form, upload
from aidsr.apps.web.widgets import box, button, fact, notice, text
from aidsr.core.artifacts import EnvironmentSummary
from aidsr.core.errors import AidsrError

_FIRST_LINES = {
    "reach": 'target = "{place}"   # site or body',
    "pose": 'target = "{place}"   # site or body\n'
    "direction = [0, 0, -1]   # required direction of the functional part's axis",
    "lift": 'target = "{body}"   # movable body',
    "travel": 'distance_m = 0.1\n# target = "{body}"   # movable body; default: the robot itself',
    "turn": 'joint = "{joint}"   # hinge\nby_deg = 90   # about its axis, by the right-hand rule',
    "touch": 'target = "{body}"   # body',
    "bring": 'targets = ["{body}"]   # bodies; "pellet_*" matches all names with this prefix\n'
    "region = {{ center_m = [0, 0, 0.1], size_m = [0.1, 0.1, 0.1] }}   # or radius_m; or at = site or body",
    "follow": "path_m = [[0, 0, 0.1], [0.1, 0, 0.1]]   # waypoints; or sites = their names",
    "stages": '[[stages]]\nkind = "touch"\ntarget = "{body}"\n\n[[stages]]\nkind = "lift"\ntarget = "{body}"',
}
"""Required keys of each kind of goal, with placeholders for names of the environment."""
_LEFT_OUT = frozenset({"kind", "by_s", "mount", "limits", "stages"})
"""Keys left out of templates, because they are tables or belong to a stage; docs/goals.md explains them."""


def skeleton(kind: str, environment: EnvironmentSummary | None = None) -> str:
    """Return a template for a goal: its required keys, then every other key with its default, as a comment.

    Args:
        kind: Name of the kind of goal.
        environment: Environment whose names are filled in; None for "…" in their place.
    """
    from aidsr.tasks.goals.reading import KINDS

    needed = _FIRST_LINES[kind].format(**_names(environment))
    given = {line.lstrip("# ").partition(" ")[0] for line in needed.splitlines()}
    rest = [
        f"# {name} = {_toml(field.default)}"
        for name, field in KINDS[kind].model_fields.items()
        if name not in given | _LEFT_OUT and not field.is_required() and field.default not in (None, "", ())
    ]
    first, then = (rest, [needed]) if kind == "stages" else ([needed], rest)
    return "\n".join([f'kind = "{kind}"', *first, *then]) + "\n"


def _names(environment: EnvironmentSummary | None) -> dict[str, str]:
    """Return a place (site or body), a body and a hinge joint of an environment; movable bodies are preferred."""
    bodies = [body for body in environment.bodies if body.name != "world"] if environment else []
    moving = [body.name for body in bodies if body.movable] + [body.name for body in bodies]
    hinges = [joint.partition(": ")[0] for body in bodies for joint in body.joints if ": hinge" in joint]
    sites = [site.name for site in environment.sites if not site.name.startswith("mount")] if environment else []
    return {
        "place": next(iter([*sites, *moving]), "…"),
        "body": next(iter(moving), "…"),
        "joint": next(iter(hinges), "…"),
    }


def _toml(value: object) -> str:
    return json.dumps(list(value) if isinstance(value, tuple) else value)


def goal_form(form: Form) -> None:
    """Ask for the goal of an objective in words, and check it while it is typed."""
    kept = {"before": ""}

    async def begin() -> None:
        environment = await background.io_bound(_summary, form["environment"])
        kept["before"] = str(form["goal"] or "")
        form["goal"] = skeleton(str(kinds.value), environment)
        back.set_visibility(bool(kept["before"].strip()))

    def take_back() -> None:
        form["goal"] = kept["before"]
        back.set_visibility(False)

    with box("stack tight"):
        with box("row"):
            kinds = ui.select(list(_FIRST_LINES), label="Kind of goal", value="reach").props("outlined dense")
            kinds.style("min-width: 160px")
            button("Insert template", begin, "quiet", "edit", "Replaces the text below")
            back = button("Undo", take_back, "bare", "undo")
            back.set_visibility(False)
        field = ui.textarea("Goal (TOML)").props("outlined autogrow debounce=500").classes("mono")
        field.bind_value(form, "goal")
        field.props.update({"maxlength": GOAL.most_bytes, "placeholder": 'kind = "touch"\ntarget = "bell"'})
        _explained()
        with box("live") as names:
            pass
        with box("live") as said:
            pass
        _keep_checked(form, field, said)
        _keep_kind(form, field, kinds)
        _keep_named(form, names)
        upload(form, GOAL)


def _explained() -> None:
    """Say what a goal is for, and where its kinds and keys are explained."""
    with box("small soft", "p"):
        text("The goal defines success. Only probing and training need it. ")
        if address := docs_address("goals"):
            ui.link("Kinds and keys of goals", address, new_tab=True)
        else:
            text("docs/goals.md in the sources explains kinds and keys.")


def _keep_checked(form: Form, field: ui.textarea, said: ui.element) -> None:
    """Show, below a field, what is wrong with its goal, or a summary of the goal, whenever it changes."""

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


def _keep_kind(form: Form, field: ui.textarea, kinds: ui.select) -> None:
    """Update the selected kind whenever the goal in a field changes; a template may bring another kind."""

    def follow() -> None:
        try:
            kind = tomllib.loads(str(form["goal"] or "")).get("kind")
        except tomllib.TOMLDecodeError:
            return  # the error is shown below the field
        if kind in _FIRST_LINES:
            kinds.value = kind

    field.on_value_change(follow)
    follow()


def _keep_named(form: Form, place: ui.element) -> None:
    """List the names that a goal can use, whenever the environment changes."""
    shown: dict[str, str] = {"environment": ""}

    async def name() -> None:
        if form["environment"] == shown["environment"]:
            return
        shown["environment"] = form["environment"]
        found = await background.io_bound(_summary, form["environment"])
        if place.is_deleted:
            return
        place.clear()
        if found is None:
            return
        with place:
            _chips("sites", [site.name for site in found.sites])
            _chips("bodies", [body.name for body in found.bodies if body.name != "world"])
            _chips("joints", named_joints(form["environment"], found))

    ui.timer(1.0, name)


def named_joints(environment: str, summary: EnvironmentSummary) -> list[str]:
    """Return the joints that a goal can name, in words; the summary calls a joint without a name "joint"."""
    from aidsr.mjcf.read import read_mjcf

    names = {node.get("name") for node in read_mjcf(environment).root.iter("joint", "freejoint")}
    joints = (joint for body in summary.bodies for joint in body.joints)
    return [joint for joint in joints if joint.partition(": ")[0] in names]


def _chips(what: str, names: Sequence[str]) -> None:
    named = [name for name in names if name]
    if named:
        with box("row small"):
            text(what, "soft")
            for name in named[:24]:
                text(name, "chip")
            if len(named) > 24:
                text(f"and {len(named) - 24} more", "soft")


def _summary(environment: str) -> EnvironmentSummary | None:
    """Return the summary of an environment; None where there is none, or where it is invalid, which its field shows."""
    from aidsr.sim.environment_summary import summarize_environment

    try:
        return summarize_environment(environment) if environment else None
    except AidsrError:
        return None
