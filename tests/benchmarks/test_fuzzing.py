"""The fuzzer: seeds decide what it makes, and it sees what it looks for."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from benchmarks.validator.fuzz import fingerprint, make_canary, marked_processes, run_case
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


def test_touched_files_show(tmp_path: Path) -> None:
    make_canary(tmp_path)
    before = fingerprint(tmp_path)
    assert set(before) == {"model.xml", "secret.txt"}
    assert fingerprint(tmp_path) == before
    (tmp_path / "MUJOCO_LOG.TXT").write_text("warning")
    assert set(fingerprint(tmp_path)) - set(before) == {"MUJOCO_LOG.TXT"}


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
