"""The page of all tasks, written from their docstrings: docs/task_reference.md.

aidsr tasks --page > docs/task_reference.md
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable

from aidsr.tasks.judging import judging, said
from aidsr.tasks.task import BENCHMARK_VERSION, Task

__all__ = ["task_page"]

_HEAD = f"""# Task reference

Version {BENCHMARK_VERSION} of the benchmark, task by task, as the code says it; [Tasks](tasks.md) has the overview and
the reasons. This page is made from docstrings by `aidsr tasks --page > docs/task_reference.md`, and a test compares the
two.
"""
_BASES = {
    "fixed": "fixed to the mount",
    "free": "free on the ground",
    "moving": "on a mount that moves",
    "any": "as the Scene Integrator decides",
}
_CELL = re.compile(r" +\|")


def task_page(tasks: Iterable[type[Task]]) -> str:
    """Return the page of some tasks as Markdown."""
    return "\n".join([_HEAD, *(_section(task) for task in tasks)])


def _section(kind: type[Task]) -> str:
    task, short = kind.at("standard"), kind.name.rpartition("/")[2]
    summary, table, reasons = _parts(kind)
    levels = f"\n\nLevel hard: {kind.at('hard').objective}" if kind.hard else ""
    stages = " → ".join(f"{words} ({start:.2g})" for start, words in kind.stages)
    judged = _at_both_levels(kind)
    rows = (
        ("varies", judged["Episodes differ"]),
        ("base", _base(task)),
        ("progress", said(task, "progress") + (f" Stages: {stages}." if stages else "")),
        ("success", judged["Success"]),
        ("violation", judged["Counts against it"]),
        ("ends early", judged.get("Lost at once", "Only by success or divergence.")),
        ("time", judged["Time"]),
    )
    facts = "\n".join(f"| {name} | {text} |" for name, text in rows)
    return (
        f"## {kind.name}\n\n![{short}](images/tasks/{short}.png)\n\n{task.objective}{levels}\n\n{summary}\n\n"
        f"| | |\n|---|---|\n{facts}\n\nWhat a policy sees beside its own body:\n\n{table}\n\n{reasons}\n"
    )


def _parts(kind: type[Task]) -> tuple[str, str, str]:
    """Return a task's docstring in three parts: what happens, the table of its features, and why."""
    paragraphs = inspect.cleandoc(kind.__doc__ or "").split("\n\n")
    (at,) = (index for index, text in enumerate(paragraphs) if text.startswith("|"))
    table = _CELL.sub(" |", paragraphs[at])
    return (
        _line("\n\n".join(paragraphs[:at])),
        re.sub(r"-{4,}", "---", table),
        "\n\n".join(map(_line, paragraphs[at + 1 :])),
    )


def _at_both_levels(kind: type[Task]) -> dict[str, str]:
    """Return how a task is judged, and how at the hard level where that is told in other words."""
    hard = judging(kind.at("hard")) if kind.hard else {}
    return {
        title: text if hard.get(title, text) == text else f"{text} Level hard: {hard[title]}"
        for title, text in judging(kind.at("standard")).items()
    }


def _base(task: Task) -> str:
    driven = f"; the policy drives {', '.join(task.policy_actuators)} as well" if task.policy_actuators else ""
    return f"{_BASES[task.base]}{driven}"


def _line(text: str) -> str:
    return " ".join(text.split())
