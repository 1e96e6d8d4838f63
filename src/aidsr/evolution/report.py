"""Report of an evolution: the results of each generation, and the archive."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean

from aidsr.core.formatting import excerpt
from aidsr.memory import Lesson, elites


def report(planned: int, generations: Sequence[tuple[int, Sequence[Lesson]]]) -> str:
    """Return the report as Markdown.

    Args:
        planned: Maximum number of generations, from the plan.
        generations: Number and lessons of each generation so far.
    """
    rows = [_generation(number, lessons) for number, lessons in generations]
    every = [lesson for _, lessons in generations for lesson in lessons]
    cells = [_cell(lesson) for lesson in elites(every)]
    return "\n".join(
        [
            "# Evolution",
            "",
            f"{len(generations)} of at most {planned} generations. Progress is that of a trial without learning on",
            "development variations, 1 where the job is done; a policy's share is of development episodes, 0 if the",
            "policy is not valid. Neither is a score: `aidsr train` and `aidsr evaluate` give that, on variations that",
            "no design was chosen by.",
            "",
            "| generation | scenes tried | best | mean | best policy | best body |",
            "|---|---|---|---|---|---|",
            *rows,
            "",
            "## Archive: the best of each family and number of actuators",
            "",
            "| family | actuators | progress | policy | body | evidence |",
            "|---|---|---|---|---|---|",
            *cells,
            "",
        ]
    )


def _generation(number: int, lessons: Sequence[Lesson]) -> str:
    if not lessons:
        return f"| {number} | 0 | - | - | - | - |"
    best = max(lessons, key=lambda each: each.worth)
    policies = [each.valid_success for each in lessons if each.valid_success is not None]
    mean = fmean(each.progress for each in lessons)
    return (
        f"| {number} | {len(lessons)} | {max(each.progress for each in lessons):.2f} | {mean:.2f} "
        f"| {_share(max(policies, default=None))} | {_plain(best.name)} |"
    )


def _cell(lesson: Lesson) -> str:
    return (
        f"| {_plain(lesson.family)} | {lesson.actuators} | {lesson.progress:.2f} | {_share(lesson.valid_success)} "
        f"| {_plain(lesson.name)} | {lesson.evidence} |"
    )


def _share(share: float | None) -> str:
    return "-" if share is None else f"{share:.0%}"


def _plain(text: str) -> str:
    """Return text written by a designer as a cell of a Markdown table: one line, at most 80 characters, no markup."""
    return excerpt(" ".join(text.split()), 80).replace("|", "/").replace("<", "&lt;")
