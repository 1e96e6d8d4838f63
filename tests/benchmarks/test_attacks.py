"""The attacks: how many there are, and that their page hides none that succeeded."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3", reason="trainings are attacked too")

from benchmarks.attacks import documents, folders, kills, requests, servers
from benchmarks.attacks.run import page
from benchmarks.attacks.tries import Ended, Outcome


def test_there_are_four_hundred_tries_each_with_a_name_of_its_own(tmp_path: Path) -> None:
    named = {
        kind: [name for name, _ in kind.tries(tmp_path)] for kind in (documents, folders, kills, requests, servers)
    }
    named[kills] += [name for name, _ in requests.killed_tries(tmp_path)]
    assert [len(named[kind]) for kind in (kills, documents, folders, requests)] == [60, 200, 40, 40]
    assert len(named[servers]) >= 60
    names = Counter(name for each in named.values() for name in each)
    assert max(names.values()) == 1


def test_the_page_counts_what_was_lost_hung_or_changed_and_names_it() -> None:
    rows = []
    for number, fault in enumerate(("", "lost", "hang", "changed", "failed")):
        outcome = Outcome("servers", str(number))
        if fault:
            setattr(outcome, fault, "it was")
        rows.append({"try": f"server: {number}", **outcome.row(), "commit": "abc"})
    text = page(rows, 403)
    assert "made 5 of 403 tries (abc)" in text
    assert "| 5 | 1 | 1 | 1 | 1 | 1 |" in text
    assert "- server: 2: hang: it was" in text
    assert "server: 0" not in text


def test_a_traceback_a_late_end_and_an_odd_code_are_problems() -> None:
    ended = Ended(0, "", "", 1.0, 1.0)
    assert ended.problem() == ("", "")
    assert "no end" in Ended(None, "", "", 1.0, 700.0).problem()[0]
    assert "processor" in Ended(0, "", "", 25.0, 30.0).problem()[0]
    assert "ValueError" in Ended(1, "", "Traceback (most recent call last):\n x\nValueError: a", 1.0, 1.0).problem()[1]
    assert "exit code 139" in Ended(139, "", "", 1.0, 1.0).problem()[1]


def test_a_damaged_file_is_lost_unless_the_undisturbed_command_leaves_it_like_that() -> None:
    before = {
        "runs/a/robot.xml": "1",
        "runs/a/scene.xml": "2",
        "arm.xml": "3",
        "runs/a/events.jsonl": "4",
        "b/.lock": "5",
    }
    after = {"runs/a/robot.xml": "other", "arm.xml": "mended", "runs/a/events.jsonl": "longer"}
    assert kills.lost(before, after, {"arm.xml": "mended"}) == "runs/a/scene.xml, runs/a/robot.xml (damaged)"
    assert kills.lost(before, before, {}) == ""


def test_the_page_says_which_tries_saw_neither_reads_nor_damage() -> None:
    rows = []
    for attack, name, notes in (("documents", "a", {"reads": "watched"}), ("kills", "parent of x at 50%", {})):
        rows.append({"try": name, **Outcome(attack, name, notes=notes).row(), "commit": "abc"})
    assert "0 tries with documents did not see reads" in page(rows, 2)
    assert "1 kills compared results" in page(rows, 2)
    rows[1]["notes"]["compared"] = True
    assert "did not see reads" not in page(rows, 2)
