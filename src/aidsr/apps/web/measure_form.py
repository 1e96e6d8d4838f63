"""The choice of the task that measures success, in the forms of trainings and probes."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from aidsr.core.errors import UserError
from aidsr.runs import Run
from aidsr.tasks import task_names


def measure_field(run: Run, choices: dict[str, Any]) -> None:
    """Show the field for the task that measures success, if the run has neither a task nor a goal."""
    if not _is_measured(run):
        task = ui.select(list(task_names()), label="Task that measures success").props("outlined dense")
        task.bind_value(choices, "task")


def measure_arguments(run: Run, choices: dict[str, Any]) -> list[str]:
    """Return the command-line arguments for the chosen task; empty where the run has its own task or goal.

    Raises:
        UserError: No task was chosen.
    """
    if _is_measured(run):
        return []
    if not choices["task"]:
        raise UserError("this objective has no goal to measure success; select a task that measures it")
    return ["--task", str(choices["task"])]


def _is_measured(run: Run) -> bool:
    return bool(run.asked().task) or run.goal.path.exists()
