"""The fuzzer: seeds decide what it makes, and it sees what it looks for."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from benchmarks.validator import fuzz
from benchmarks.validator.fuzz import (
    Campaign,
    files_read,
    fingerprint,
    make_canary,
    mark_unread,
    marked_processes,
    processor_s,
    reads_show,
    run_campaign,
    run_case,
)
from benchmarks.validator.mutation import mutate

BODY = '<body name="a" pos="0 0 1"><joint name="j"/><geom size="0.1"/></body>'
ROBOT = f"<mujoco>\n<worldbody>\n{BODY}\n</worldbody>\n</mujoco>"


def test_a_seed_gives_the_same_mutations_and_they_differ() -> None:
    made = [[mutate([ROBOT], np.random.default_rng([seed, k]), "/x") for k in range(300)] for seed in (1, 1, 2)]
    assert made[0] == made[1]
    assert made[0] != made[2]
    assert len(set(made[0])) > 200
    assert any("/x/model.xml" in text for text in made[0])


def test_a_case_ends_with_codes_and_not_with_an_exception() -> None:
    assert run_case("<mujoco", battery=False) == ("refused", ["xml_syntax"])
    ending, codes = run_case(ROBOT, battery=False)
    assert ending == "refused"
    assert {"no_tendons", "no_soft_chain"} <= set(codes)


def test_a_case_that_takes_too_long_or_raises_is_a_failure_and_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    endings = iter([21.0, None])
    spent_s = [0.0]

    def run_case(text: str, *, battery: bool) -> tuple[str, list[str]]:
        spent_s[0] += next(endings)
        return "accepted", []

    monkeypatch.setattr(fuzz, "run_case", run_case)
    monkeypatch.setattr(fuzz, "processor_s", lambda: spent_s[0])
    campaign = run_campaign([7, 8], 0, "/x", tmp_path, battery=False, threads=1)
    assert campaign.failures[7] == "took 21.0 s of processor time, accepted"
    assert "TypeError" in campaign.failures[8]
    assert {path.name for path in tmp_path.iterdir()} == {"case-0-7.xml", "case-0-8.xml"}
    assert campaign.longest == (21.0, 7)
    assert Campaign.read(json.loads(json.dumps(vars(campaign)))) == campaign


def test_processor_time_of_children_counts() -> None:
    before_s = processor_s()
    busy = "import time\nwhile time.process_time() < 0.3: pass\nprint(flush=True)\nimport sys; sys.stdin.read()"
    with subprocess.Popen([sys.executable, "-c", busy], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as child:
        child.stdout.readline()
        assert processor_s() - before_s > 0.25
        child.stdin.close()
        child.wait()
        assert processor_s() - before_s > 0.25


def test_touched_files_show(tmp_path: Path) -> None:
    make_canary(tmp_path)
    before = fingerprint(tmp_path)
    assert set(before) == {"model.xml", "secret.txt"}
    assert fingerprint(tmp_path) == before
    (tmp_path / "MUJOCO_LOG.TXT").write_text("warning")
    assert set(fingerprint(tmp_path)) - set(before) == {"MUJOCO_LOG.TXT"}


def test_reads_show_again_and_again(tmp_path: Path) -> None:
    if not reads_show():
        pytest.skip("the file system keeps no times of access")
    make_canary(tmp_path)
    for name in ("secret.txt", "model.xml", "secret.txt"):
        before = fingerprint(tmp_path)
        mark_unread(tmp_path)
        assert files_read(tmp_path) == []
        (tmp_path / name).read_bytes()
        assert files_read(tmp_path) == [name]
        assert fingerprint(tmp_path) == before


def test_processes_left_behind_show() -> None:
    marker = f"a-marker-of-{os.getpid()}"
    child = subprocess.Popen(
        [sys.executable, "-c", "import sys; print(flush=True); sys.stdin.read()"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={"MARK": marker, "PATH": os.environ.get("PATH", "")},
    )
    child.stdout.readline()  # before it has begun it still carries its parent's environment
    seen = marked_processes(marker)
    child.communicate()
    if sys.platform == "linux":
        assert seen == [child.pid]
    assert marked_processes(marker) == []
