"""Designers are told what the code judges by, from the docstrings of the code that judges."""

import re

import pytest

from aidsr.tasks import load_task, task_names


@pytest.mark.parametrize("name", task_names())
def test_every_task_says_how_it_is_judged(name):
    task = load_task(name)
    told = task.brief().judging
    assert {"Episodes differ", "Success", "Counts against it", "Time"} <= told.keys()
    assert f"Held for {task.hold_s:g} s." in told["Success"]
    assert ("Lost at once" in told) == name.startswith(("grasping/", "locomotion/"))
    assert ("Who moves the mount" in told) == (task.base == "moving")
    for sentence in told.values():
        assert re.match(r"[A-Z0-9]", sentence), sentence
        assert sentence.isascii()
        assert "See `Task`" not in sentence


def test_a_mount_is_moved_by_the_policy_or_by_a_timetable():
    assert (
        "the policy drives base_x, base_z" in load_task("drawer_opening").brief().judging["Who moves the mount"].lower()
    )
    assert load_task("simple_grasping").brief().judging["Who moves the mount"] == "A timetable does."
