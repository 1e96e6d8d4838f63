"""A memory: a file of lessons, and the selection of lessons for a job."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from aidsr.core.arguments import check_type
from aidsr.core.artifacts import Base
from aidsr.core.errors import UserError
from aidsr.core.text_files import read_text_file
from aidsr.memory.lesson import Lesson
from aidsr.runs.files import replace_file

TOLD = 8
"""Number of lessons given to a designer. Our choice: below 3,000 tokens."""
_MAX_BYTES = 32_000_000
"""Maximum size of a memory file [bytes]: tens of thousands of lessons."""
_LARGE_STEP = 0.15
"""Change in progress above which a change is instructive. Our choice: above the spread of a trial over seeds."""


@dataclass(frozen=True, init=False)
class Memory:
    """A file of lessons, one JSON object per line.

        memory = aidsr.Memory("lessons.jsonl")
        memory.add(aidsr.lessons_of(run))               # a run with task_feedback, or of the measuring team
        run = aidsr.design(task="tunnel", model="openai:gpt-5", memory="lessons.jsonl")
        records = [lesson.model_dump() for lesson in memory.lessons()]

    Raises:
        TypeError: `path` has another type.
    """

    path: Path

    def __init__(self, path: str | Path) -> None:
        check_type(path, (str, Path), "a memory must be given as the path of its file")
        object.__setattr__(self, "path", Path(path))

    def lessons(self) -> tuple[Lesson, ...]:
        """Return all lessons; none if the file does not exist.

        Raises:
            UserError: The file cannot be read, or is not a memory file.
        """
        try:
            text = read_text_file(self.path, max_bytes=_MAX_BYTES)
        except FileNotFoundError:
            return ()
        except OSError as error:
            raise UserError(f"the memory {self.path} cannot be read: {error.strerror}") from None
        # not splitlines: a name may contain the line separators of Unicode, which JSON does not escape
        return tuple(self._lesson(number, line) for number, line in enumerate(text.split("\n"), 1) if line.strip())

    def _lesson(self, number: int, line: str) -> Lesson:
        try:
            return Lesson.model_validate_json(line)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(str(part) for part in first["loc"]) or "the whole line"
            raise UserError(
                f"{self.path} is not a memory: line {number} is no lesson ({place}: {first['msg']}); name a file that "
                "`aidsr memory` made"
            ) from None

    def add(self, lessons: Iterable[Lesson]) -> int:
        """Store lessons and return how many are new; a lesson replaces an earlier one with the same evidence.

        Raises:
            UserError: The file cannot be read or written.
        """
        known = {lesson.evidence: lesson for lesson in self.lessons()}
        before = len(known)
        known.update({lesson.evidence: lesson for lesson in lessons})
        text = "".join(f"{lesson.model_dump_json()}\n" for lesson in known.values())
        replace_file(self.path, text.encode())
        return len(known) - before

    def recall(
        self, objective: str, base: Base = "any", count: int = TOLD, *, without: Collection[str] = ()
    ) -> tuple[Lesson, ...]:
        """Return the lessons to give to a designer: the most similar jobs first, of each the best and most instructive.

        The similarity of jobs is the cosine similarity of the TF-IDF weights of their objectives, plus 0.1 if the base
        of the robot is the same. Of robots of one family with the same number of actuators, the best one is chosen. One
        job gets at most half of the lessons, unless there are too few of other jobs.

        Args:
            objective: Objective of the job.
            base: How the robot is held in this job.
            count: Maximum number of lessons.
            without: Names of tasks whose lessons are left out.
        """
        jobs: dict[tuple[str, str], list[Lesson]] = {}
        for lesson in self.lessons():
            if lesson.task not in without or not lesson.task:
                jobs.setdefault((lesson.objective, lesson.base), []).append(lesson)
        likeness = _likeness(objective, [words for words, _ in jobs])
        near = {job: alike + 0.1 * (job[1] == base) for job, alike in zip(jobs, likeness, strict=True)}
        nearest_first = sorted(jobs, key=lambda each: -near[each])
        chosen: dict[tuple[str, str], list[Lesson]] = {job: [] for job in nearest_first}
        for most in (max(count // 2, 1), count):  # half of them for one job, then those that are left
            for job in nearest_first:
                left = count - sum(map(len, chosen.values()))
                more = _choose(jobs[job], min(most, left + len(chosen[job])))
                chosen[job] += [each for each in more if each not in chosen[job]][:left]
        return tuple(lesson for job in nearest_first for lesson in chosen[job])

    def tell(
        self, objective: str, base: Base = "any", count: int = TOLD, *, level: str = "", without: Collection[str] = ()
    ) -> tuple[str, ...]:
        """Return the lessons of `recall` as text; a lesson on another job, or on another level of it, says so.

        Args:
            objective: Objective of the job, as the next three arguments of `recall`.
            base: How the robot is held in this job.
            count: Maximum number of lessons.
            level: Level of the job's task; "" if it has none, or if the level is not compared.
            without: Names of tasks whose lessons are left out.
        """

        def told(lesson: Lesson) -> str:
            if lesson.objective != objective:
                return f"Job: {lesson.job} {lesson.text()}"
            other_level = level and lesson.level and lesson.level != level
            return f"At level {lesson.level}: {lesson.text()}" if other_level else lesson.text()

        return tuple(map(told, self.recall(objective, base, count, without=without)))


def elites(lessons: Iterable[Lesson]) -> tuple[Lesson, ...]:
    """Return the best lesson of each family and number of actuators, the best first.

    Source: MAP-Elites (Mouret and Clune 2015), with these two as behaviour descriptors.
    """
    found: dict[tuple[str, int], Lesson] = {}
    for lesson in lessons:
        cell = (lesson.family.casefold(), lesson.actuators)
        if cell not in found or lesson.worth > found[cell].worth:
            found[cell] = lesson
    return tuple(sorted(found.values(), key=lambda each: -each.worth))


def _choose(lessons: Sequence[Lesson], count: int) -> list[Lesson]:
    """Return the best lessons on a job, and as many instructive ones: large changes, then the worst families."""
    best = elites(lessons)
    chosen = list(best[: (count + 1) // 2])
    steps = sorted((each for each in lessons if abs(each.step) >= _LARGE_STEP), key=lambda each: -abs(each.step))
    families = {each.family.casefold() for each in chosen}
    failures = [each for each in reversed(best) if each.family.casefold() not in families]
    for lesson in (*steps, *failures, *best):
        if len(chosen) >= count:
            break
        if lesson not in chosen:
            chosen.append(lesson)
    return chosen


def _likeness(text: str, others: Sequence[str]) -> list[float]:
    """Return the similarity of a text to each of the others, 0 to 1.

    Source: cosine of TF-IDF weights (Salton and Buckley 1988), with inverse document frequencies over all these texts.
    """
    counts = [Counter(re.findall(r"[a-z]{3,}", each.casefold())) for each in (text, *others)]
    frequency = Counter(word for each in counts for word in each)
    weights = [{word: n * math.log(1 + len(counts) / frequency[word]) for word, n in each.items()} for each in counts]
    lengths = [math.sqrt(sum(weight**2 for weight in each.values())) for each in weights]
    own, own_length = weights[0], lengths[0]
    return [
        sum(weight * own.get(word, 0.0) for word, weight in each.items()) / max(own_length * length, 1e-12)
        for each, length in zip(weights[1:], lengths[1:], strict=True)
    ]
