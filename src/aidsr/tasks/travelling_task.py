"""Serialization of a task for a function that runs in a child process (`aidsr.sandbox.isolated`)."""

from __future__ import annotations

import base64
import pickle
from typing import Annotated, Any

from pydantic import PlainSerializer, PlainValidator

from aidsr.sandbox.environment import inside_worker
from aidsr.tasks.task import Task

_PICKLED = "pickled:"


def can_travel(task: str | Task) -> bool:
    """Return whether a child process can import the task's class, not one of a script, notebook or function."""
    kind = type(task)
    return kind.__module__ != "__main__" and "<locals>" not in kind.__qualname__


def _write(task: str | Task) -> str:
    return task if isinstance(task, str) else _PICKLED + base64.b64encode(pickle.dumps(task)).decode()


def _read(value: Any) -> str | Task:
    if not isinstance(value, str) or not value.startswith(_PICKLED):
        return value  # type: ignore[no-any-return]
    if not inside_worker():
        raise ValueError("a task travels to a child process, never back")  # data from a child is not trusted
    task: Task = pickle.loads(base64.b64decode(value.removeprefix(_PICKLED)))  # from the parent
    return task


TravellingTask = Annotated[str | Task, PlainSerializer(_write, return_type=str), PlainValidator(_read)]
"""A task or its name; the parent process pickles a task object for its own child process."""
