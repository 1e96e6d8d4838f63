"""The task study's page follows from its facts, and the facts are those of good tasks."""

import importlib.util
from pathlib import Path

import pytest

from aidsr.tasks import TASKS

PATH = Path(__file__).parents[2] / "benchmarks" / "tasks" / "study.py"


@pytest.fixture(scope="module")
def study():
    spec = importlib.util.spec_from_file_location("tasks_study", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_made_of_the_facts(study):
    assert study.TABLE.read_text(encoding="utf-8") == study.table()


def test_no_idle_body_succeeds_and_every_goal_can_be_held(study):
    facts = study.facts()
    for name in TASKS:
        mine = [fact for fact in facts if fact["task"] == name and fact["level"] == "standard"]
        assert [fact["goal_held"] for fact in mine if not fact["design"]] == [True], name
        bodies = [fact for fact in mine if fact["design"]]
        assert bodies, name
        assert sum(fact["idle_successes"] for fact in bodies) == 0, name
        assert all(fact["features_differ"] > 0 for fact in mine if not fact["design"]), name
