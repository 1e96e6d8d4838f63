"""Kill -9 at any point, resume: no answered question is asked again, and the files are those of an undisturbed run."""

import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

HERE = Path(__file__).parent


@pytest.fixture(
    scope="module", params=[16, pytest.param(10_000, marks=pytest.mark.slow)], ids=["some points", "all points"]
)
def stories(request, tmp_path_factory) -> list[dict]:
    place = tmp_path_factory.mktemp("killed")
    told = subprocess.run(
        [sys.executable, HERE / "killing.py", place, str(request.param)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(HERE.parent), *sys.path])},
        capture_output=True,
        text=True,
        check=True,
    )
    return [json.loads(line) for line in told.stdout.splitlines()]


def test_kills_hit_everywhere(stories) -> None:
    undisturbed, *killed = stories
    assert undisturbed["ended_by"] == 0
    assert len(killed) >= 16
    assert {story["ended_by"] for story in killed} == {9}
    recorded = {len(story["recorded_before"]) for story in killed}
    assert len(recorded) >= 5, "early, in the middle and late"


def test_files_are_those_of_an_undisturbed_run(stories) -> None:
    undisturbed, *killed = stories
    assert {"designs/2/final.xml", "designs/2/02/repairs.json"} <= undisturbed["files"].keys()
    for story in killed:
        assert story["files"] == undisturbed["files"], story["last"]
        assert story["state"] == "finished"


def test_no_answered_question_is_asked_again(stories) -> None:
    undisturbed, *killed = stories
    needed = Counter(undisturbed["recorded_after"])
    assert max(needed.values()) == 2, "one question is asked twice on purpose"
    for story in killed:
        after, answered = Counter(story["asked_after"]), Counter(story["recorded_before"])
        assert after == needed - answered, story["last"]
        assert Counter(story["recorded_after"]) == needed, story["last"]


def test_at_most_the_calls_in_flight_are_lost(stories) -> None:
    for story in stories:
        lost = Counter(story["asked_before"]) - Counter(story["recorded_before"])
        assert lost.total() <= 2, "one call of each of the two designs"


def test_the_account_is_the_same(stories) -> None:
    assert {round(story["cost_usd"], 9) for story in stories} == {round(0.01 * len(stories[0]["recorded_after"]), 9)}


def test_status_can_be_read_at_any_point(stories) -> None:
    assert {story["state_after_kill"] for story in stories[1:]} <= {"running", "finished"}
