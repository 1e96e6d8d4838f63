"""The tool `check`, for users who define a task; it is in this package because it tries built-in robots.

The docstring of `check` is sent to models as the description of the tool.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from aidsr.core.errors import UserError
from aidsr.tasks import GoalTask
from aidsr.teams.fitting.check import check_task
from aidsr.tools import Result, Tool, Workspace


def check(
    workspace: Workspace,
    task: Annotated[str, Field(max_length=500, description='Own task to check, such as "task_1".')],
    seed: Annotated[int, Field(ge=0, description="Of the body and of the random actions.")] = 0,
) -> Result:
    """Try an own task with a built-in body that does nothing, anything, and open-loop motions."""
    _, _, found = workspace.task_of(task, "standard")
    if not isinstance(found, GoalTask):
        raise UserError(f"check takes an own task, and {task} is one of the benchmark; make_task makes one")
    checked = check_task(found, seed=seed)
    pictures = tuple(drawn for drawn in (checked.picture, checked.strip) if drawn)
    return Result(text="\n".join(checked.lines), pictures=pictures if workspace.draws else ())


CHECK = Tool.of(check)
