"""Tasks out of sample are news to the built-in rules; that they can be won is shown in test_wins.py."""

import dataclasses
import re

import pytest

from aidsr.tasks import RULES_FROZEN_AT, TASKS, TASKS_IN_SAMPLE, TASKS_OUT_OF_SAMPLE, load_task
from aidsr.teams.rules import job_kinds

FUNCTION_WORDS = frozenset(
    """a an and are around as at below beside between by down for from in into is it its of off on one onto out over
    than the then there through to towards up with""".split()  # noqa: SIM905
)


def words(text: str) -> set[str]:
    return set(re.findall(r"[a-z]{3,}", text.lower())) - FUNCTION_WORDS


def strings(value) -> list[str]:
    """All text in a table, however it is made."""
    if isinstance(value, re.Pattern):
        return [value.pattern]
    if isinstance(value, str):
        return [value]
    if isinstance(value, dict):
        return [text for pair in value.items() for each in pair for text in strings(each)]
    if isinstance(value, (list, tuple, set, frozenset)):
        return [text for each in value for text in strings(each)]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return [text for field in dataclasses.fields(value) for text in strings(getattr(value, field.name))]
    return []


BEGINNINGS = {
    word
    for name, value in vars(job_kinds).items()
    if not name.startswith("__")
    for text in strings(value)
    for word in words(text)
}


def shared(objective: str) -> set[str]:
    """Words of an objective that begin as one in the rules' tables does."""
    return {word for word in words(objective) if any(word.startswith(beginning) for beginning in BEGINNINGS)}


def test_every_task_is_in_sample_or_out_of_it():
    assert (*TASKS_IN_SAMPLE, *TASKS_OUT_OF_SAMPLE) == tuple(TASKS)
    assert len(TASKS_IN_SAMPLE) == 14
    assert {name.partition("/")[0] for name in TASKS_OUT_OF_SAMPLE} == {
        name.partition("/")[0] for name in TASKS_IN_SAMPLE
    }
    assert re.fullmatch(r"[0-9a-f]{7,40}", RULES_FROZEN_AT)


@pytest.mark.parametrize("level", ["standard", "hard"])
@pytest.mark.parametrize("name", TASKS_OUT_OF_SAMPLE)
def test_no_word_of_the_objective_is_in_the_rules_tables(name, level):
    assert not shared(load_task(name, level).objective)


@pytest.mark.parametrize("name", TASKS_IN_SAMPLE)
def test_words_of_tasks_in_sample_are_in_the_rules_tables(name):
    assert shared(load_task(name).objective)
