"""Markdown reference of all tasks, generated from their fields and docstrings: docs/task_reference.md.

aidsr tasks --page > docs/task_reference.md
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable

from aidsr.core.errors import UserError
from aidsr.tasks.feature_numbers import numbers_of
from aidsr.tasks.task import BENCHMARK_VERSION, Task

_HEAD = f"""# Task reference

Version {BENCHMARK_VERSION} of the benchmark, task by task, as the code has it; [Tasks](tasks.md) has the overview and
the reasons. `aidsr tasks --page > docs/task_reference.md` makes this page, and a test compares the two.
"""
_BASES = {
    "fixed": "fixed to the mount",
    "free": "free on the ground",
    "moving": "on a mount that moves",
    "any": "as the Scene Integrator decides",
}


def task_reference(tasks: Iterable[type[Task]]) -> str:
    """Return the Markdown reference of the given tasks.

    Raises:
        UserError: Python runs without docstrings (-OO), which contain the summary and the source of each task.
    """
    return "\n".join([_HEAD, *(_section(task) for task in tasks)])


def _section(kind: type[Task]) -> str:
    if kind.__doc__ is None:
        raise UserError("the task reference needs docstrings: run Python without -OO")
    summary, *sources = map(_line, inspect.cleandoc(kind.__doc__).split("\n\n"))
    task, short = kind.at("standard"), kind.name.rpartition("/")[2]
    levels = f"\n\nLevel hard: {kind.at('hard').objective}" if kind.hard else ""
    judged = _at_both_levels(kind)
    rows = (
        ("varies", judged["Episodes differ"]),
        ("base", _base(task)),
        ("progress", task.criteria.progress),
        *([("stages", judged["Stages"])] if "Stages" in judged else []),
        ("success", judged["Success"]),
        ("penalty", judged["Penalty"]),
        ("ends early", judged.get("Lost at once", "Only by success or divergence.")),
        ("time", judged["Time"]),
    )
    facts = "\n".join(f"| {name} | {text} |" for name, text in rows)
    paragraphs = (
        f"## {kind.name}",
        f"![{short}](images/tasks/{short}.png)",
        f"{task.objective}{levels}",
        summary,
        f"| | |\n|---|---|\n{facts}",
        "What a policy observes beside its own body:",
        _features(kind),
        *sources,
    )
    return "\n\n".join(paragraphs) + "\n"


def _features(kind: type[Task]) -> str:
    rows = ["| numbers | feature | unit | range | sensor |", "|---|---|---|---|---|"]
    for names, feature in numbers_of(kind.features):
        low, high = feature.range
        cells = (names, feature.name, feature.unit, f"{low:g} to {high:g}", feature.source)
        rows.append("|" + "|".join(f" {cell} " if cell else " " for cell in cells) + "|")
    return "\n".join(rows)


def _at_both_levels(kind: type[Task]) -> dict[str, str]:
    """Return the judging of a task by title, with the hard level's sentence appended where it differs."""
    hard = kind.at("hard").judging() if kind.hard else {}
    return {
        title: text if hard.get(title, text) == text else f"{text} Level hard: {hard[title]}"
        for title, text in kind.at("standard").judging().items()
    }


def _base(task: Task) -> str:
    driven = f"; the policy drives {', '.join(task.policy_actuators)} as well" if task.policy_actuators else ""
    return f"{_BASES[task.base]}{driven}"


def _line(text: str) -> str:
    return " ".join(text.split())
