"""How a task is judged, in sentences: what its docstrings say, for its page and for those who design for it."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING

from aidsr.core.errors import UserError

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
        facts["Lost at once"] = said(task, "failed")
    if task.base == "moving":
        driven = task.policy_actuators
        by = f"the policy drives {', '.join(driven)} beside the robot's own actuators" if driven else "a timetable does"
        facts["Who moves the mount"] = f"{by[0].upper()}{by[1:]}."
    return facts


def said(task: Task, method: str) -> str:
    """Return in one line what a task's method does, as its docstring or, at the hard level, `Task.hard_words` says.

    Raises:
        UserError: It says nothing. What stands at the method of a base class is no answer: it tells of other code.
    """
    docstring = getattr(type(task), method).__doc__ or ""
    text = task.hard_words.get(method, docstring) if task.level == "hard" else docstring
    words = " ".join(inspect.cleandoc(text).split()).rstrip(".")
    if not words:
        raise UserError(
            f'The task "{task.name}" must have a docstring on its method `{method}`, because designers are told how '
            "they are judged in its words; found none. Write a sentence there, as docs/tasks.md shows."
        )
    return f"{words}."
