"""How a task is judged, in sentences: what its docstrings say, for its page and for those who design for it."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING

from aidsr.errors import UserError

if TYPE_CHECKING:
    from aidsr.tasks.task import Task

__all__ = ["judging", "said"]


def judging(task: Task) -> dict[str, str]:
    """Return what differs between episodes, what counts and what does not, each in a sentence or two."""
    differ, success, against = task.terms()
    facts = {
        "Episodes differ": differ,
        "Success": f"{success} Held for {task.hold_s:g} s.",
        "Counts against it": against,
        "Time": f"{task.time_limit_s:g} s, {1 / task.control_dt_s:g} actions a second.",
    }
    if task.can_be_lost:
        facts["Lost at once"] = said(type(task), "failed")
    if task.base == "moving":
        driven = task.policy_actuators
        by = f"the policy drives {', '.join(driven)} beside the robot's own actuators" if driven else "a timetable does"
        facts["Who moves the mount"] = f"{by[0].upper()}{by[1:]}."
    return facts


def said(kind: type[Task], method: str) -> str:
    """Return what the docstring of a task's method says, in one line.

    Raises:
        UserError: It says nothing. What stands at the method of a base class is no answer: it tells of other code.
    """
    words = " ".join(inspect.cleandoc(getattr(kind, method).__doc__ or "").split()).rstrip(".")
    if not words:
        raise UserError(
            f'The task "{kind.name}" must have a docstring on its method `{method}`, because designers are told how '
            "they are judged in its words; found none. Write a sentence there, as docs/tasks.md shows."
        )
    return f"{words}."
