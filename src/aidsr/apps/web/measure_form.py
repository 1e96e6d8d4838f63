"""What measures success, in the forms of trainings and probes: a goal or a task, if the run has neither."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nicegui import app, ui

from aidsr.apps.web.goal_form import goal_form
from aidsr.apps.web.site import Site
from aidsr.apps.web.upload import GOAL, Form
from aidsr.apps.web.widgets import box, text
from aidsr.core.errors import UserError
from aidsr.runs import Run
from aidsr.runs.files import BytesFile, replace_file
from aidsr.tasks import task_names

_NO_TASK = ""
_LEAST_WIDTH = "min-width: 280px"  # so that the label is not cut off


def measure_field(run: Run, choices: dict[str, Any]) -> None:
    """Show the fields for a goal or a task that measures success, if the run has neither."""
    if _is_measured(run):
        return
    with box("stack"):
        text("Success", "label")
        text("This run has no goal, so success is not defined. Write or upload a goal.", "small", "p")
        goal_form(_form(run))
        offered = {_NO_TASK: "none", **{name: name for name in task_names()}}
        task = ui.select(offered, label="Or the benchmark task of this environment").props("outlined dense")
        task.style(_LEAST_WIDTH).bind_value(choices, "task")


def measure_arguments(site: Site, run: Run, choices: dict[str, Any], process: str) -> list[str]:
    """Return the command-line arguments for the goal or the task; empty where the run has its own.

    Args:
        site: The site, in whose folder the goal is written.
        run: The run.
        choices: The entries of the form.
        process: Name of the process that gets the arguments.

    Raises:
        UserError: There is neither a goal nor a task, there are both, or the goal cannot be used in the environment.
    """
    if _is_measured(run):
        return []
    form, task = _form(run), str(choices["task"] or "")
    goal = str(form["goal"] or "")
    if goal.strip() and task:
        raise UserError('both a goal and a benchmark task are given; empty the goal, or choose the task "none"')
    if task:
        return ["--task", task]
    if not goal.strip():
        raise UserError(
            "this run has no goal, so success is not defined; write or upload one under Success, or in a terminal add "
            "--goal goal.toml to the command"
        )
    GOAL.look(goal, form)
    file = goal_file(site, process)
    if BytesFile(file).read() != goal.encode():  # the time of an unchanged goal tells that earlier probes had it
        replace_file(file, goal.encode())
    return ["--goal", str(file)]


def goal_file(site: Site, process: str) -> Path:
    """Return the path of the goal that was written for a process; it exists only if the run had none of its own."""
    return site.own / "goals" / f"{process}.toml"


def _form(run: Run) -> Form:
    """Return the goal typed for a run, and the run's environment; kept over reloads and restarts."""
    kept: dict[str, Form] = app.storage.user.setdefault("goals", {})
    return kept.setdefault(run.name, {"goal": "", "goal_name": "", "environment": run.brief().environment})


def _is_measured(run: Run) -> bool:
    return bool(run.asked().task) or run.goal.path.exists()
