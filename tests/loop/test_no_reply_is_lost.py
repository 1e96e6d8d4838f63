"""Over injected faults and kill -9, no reply that was paid for is lost; losing.py does it and says what counts."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
FAULTS, KILLS = 200, 50

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def found() -> dict:
    told = subprocess.run(
        [sys.executable, HERE / "losing.py", "--faults", str(FAULTS), "--kills", str(KILLS), "--json"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(HERE.parent), *sys.path])},
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(told.stdout)


def test_every_reply_paid_for_in_spite_of_faults_is_in_a_run(found) -> None:
    faults = found["faults"]
    assert sum(faults["injected"].values()) >= FAULTS
    assert (faults["lost"], faults["never_sent"]) == (0, 0)
    assert faults["paid"] > 0


def test_every_fault_is_recovered_and_recorded(found) -> None:
    faults = found["faults"]
    assert faults["finished"] == faults["runs"]
    assert faults["failed_attempts"] >= faults["without_a_reply"], "a slow machine may add timeouts of its own"
    assert faults["tokens_recorded"] == faults["tokens_paid"]


def test_every_reply_paid_for_before_a_kill_is_in_the_run(found) -> None:
    stories = found["kills"]["killed"]
    assert len(stories) >= KILLS - 2, "all but what hit a call under way"
    assert {story["ends"][0] for story in stories} == {-9}
    for story in stories:
        assert (story["lost"], story["never_sent"], story["finished"]) == (0, 0, True), story


def test_a_kill_while_a_call_is_under_way_loses_that_call_at_most(found) -> None:
    for story in found["kills"]["writing_a_reply"]:
        assert story["ends"][0] == -9
        assert story["lost"] <= 1
        assert (story["never_sent"], story["finished"]) == (0, True)
