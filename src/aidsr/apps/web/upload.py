"""Uploaded files: checked by strict rules before they are accepted, and kept in the form as text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from nicegui import events, run, ui

from aidsr.apps.web.live import clear_error, show_error
from aidsr.apps.web.widgets import box, button, fact, text
from aidsr.core.artifacts import MountSummary
from aidsr.core.errors import AidsrError, MjcfError, UserError

_STRAIGHT = 0.1
"""Horizontal component of an axis below which it counts as vertical. Our choice: 6 deg."""

Form = dict[str, Any]
Facts = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class FileField:
    """A kind of file that can be uploaded.

    Attributes:
        key: Key of the file's text in the form; with "_name" appended, the key of the file's name.
        label: Label of the field.
        suffixes: File name suffixes, separated by commas, by which a browser's file dialog filters.
        most_bytes: Maximum size.
        look: Checks the text, given the form, and returns pairs of name and value that describe it; may take seconds.
    """

    key: str
    label: str
    suffixes: str
    most_bytes: int
    look: Callable[[str, Form], Facts]


def upload(form: Form, wanted: FileField) -> None:
    """Show a field that accepts a file, checks it, and shows a description of its content or its errors."""
    key = wanted.key

    @ui.refreshable
    def found(facts: Facts = ()) -> None:
        if form[key]:
            with box("row"):
                text(f"{form[f'{key}_name']}, {len(form[key].encode()) / 1000:.1f} kB", "mono")
                button("Remove", remove, "bare", "close")
        if facts:
            with box("facts"):
                for name, value in facts:
                    fact(name, value)

    def remove() -> None:
        form.update({key: "", f"{key}_name": ""})
        found.refresh()

    async def take(event: events.UploadEventArguments) -> None:
        field.reset()
        try:
            content = (await event.file.read()).decode("utf-8-sig")
            facts = await run.io_bound(wanted.look, content, dict(form))
        except UnicodeDecodeError:
            show_error(UserError(f"{event.file.name} is not a text file; choose a file saved as UTF-8"))
        except AidsrError as error:
            show_error(UserError(f"{event.file.name} cannot be used: {_told(error)}"))
        else:
            form.update({key: content, f"{key}_name": event.file.name[:100]})
            clear_error()
            found.refresh(facts)

    # a separate box: an error is shown at its end, beside this field and not below the fields that follow
    with box("stack tight"):
        # Quasar's own control is a nested button without an accessible name, so it is hidden and used by this one
        with box("drop row") as place:
            choose = button(f"Choose: {wanted.label}", lambda: None, "quiet", "upload_file")
            text("or drop the file here", "small soft")
        field = ui.upload(label=wanted.label, max_file_size=wanted.most_bytes, auto_upload=True, on_upload=take)
        field.props(f"flat accept={wanted.suffixes}").classes("hidden")
        uploader = f"getElement({field.id}).$refs.qRef"
        choose.on("click", js_handler=f"() => {uploader}.pickFiles()")
        place.on("dragover", js_handler="(event) => event.preventDefault()")
        place.on(
            "drop",
            js_handler=f"(event) => {{ event.preventDefault(); {uploader}.addFiles(event.dataTransfer.files); }}",
        )
        kinds = wanted.suffixes.replace(",", " or ")
        refused = UserError(f"not a {kinds} file of at most {wanted.most_bytes / 1e6:g} MB; choose another file")
        field.on("rejected", lambda: show_error(refused))
        found()


def _told(error: AidsrError) -> str:
    """Return an error in words; an error in MJCF has line numbers, as in `aidsr validate`."""
    if not isinstance(error, MjcfError):
        return str(error)
    lines = (fault.line if f"line {fault.line}" not in fault.message else None for fault in error.faults)
    return "; ".join(
        f"line {line}: " * bool(line) + fault.message for line, fault in zip(lines, error.faults, strict=True)
    )


def _environment(content: str, _form: Form) -> Facts:
    from aidsr.sim.environment_summary import summarize_environment

    summary = summarize_environment(content)
    mounts = ", ".join(f"{mount.name} ({_direction(mount)})" for mount in summary.mounts) or "none (world only)"
    bodies = sum(body.name != "world" for body in summary.bodies)
    return (("mounts", mounts), ("bodies", str(bodies)), ("sensors", str(len(summary.sensors))))


def _direction(mount: MountSummary) -> str:
    """Return in words where a robot on a mount points: along the mount's +z axis, in world coordinates."""
    x, y, z = mount.z_axis
    if max(abs(x), abs(y)) < _STRAIGHT:
        return "a robot stands upright" if z > 0 else "a robot hangs down"
    return f"a robot points along {x:.2g} {y:.2g} {z:.2g}"


def _robot(content: str, _form: Form) -> Facts:
    from aidsr.mjcf.read import check_mjcf

    check_mjcf(content)
    return ()


def _goal(content: str, form: Form) -> Facts:
    from aidsr.tasks import goal_task, parse_goal

    goal = parse_goal(content)
    if form["environment"]:  # without an environment, names are checked when the run is started
        goal_task(goal, form["environment"])
    return (
        ("success", goal.kind),
        ("target", ", ".join(goal.places) or "the robot"),
        ("hold time", f"{goal.hold_s:g} s"),
        ("time limit", f"{goal.time_limit_s:g} s"),
    )


ENVIRONMENT = FileField("environment", "Environment (MJCF)", ".xml,.mjcf", 2_000_000, _environment)
ROBOT = FileField("robot", "Robot (MJCF)", ".xml,.mjcf", 2_000_000, _robot)
GOAL = FileField("goal", "Goal (goal.toml)", ".toml", 20_000, _goal)
