"""A driver that is killed at any moment and resumed writes the tables of one that was left alone."""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from aidsr.studies.runner import read_failures
from aidsr.studies.study import open_study

TIMES = ("latency_s", "training_s")


def command(folder: Path, options: list[str]) -> list[str]:
    return [sys.executable, "-m", "aidsr", "benchmark", str(folder), "--no-probe", *options]


def tables(folder: Path) -> tuple[list[dict[str, str]], list[object]]:
    """Return the raw rows without their times, and every episode of every policy."""
    with (folder / "report.csv").open() as file:
        rows = [{key: value for key, value in row.items() if key not in TIMES} for row in csv.DictReader(file)]
    designs = json.loads((folder / "report.json").read_text())["designs"]
    return rows, [[each["episodes"] for each in design["evaluations"]] for design in designs]


def kill_until(folder: Path, options: list[str], kills: int, longest_s: float, rng: np.random.Generator) -> list[Path]:
    """Kill the driver so many times, each time resuming what is there; a study that came to its end is followed by
    another one. Return the folders of all that were finished."""
    finished, hits = [], 0
    while not finished or hits < kills:
        study = folder / f"{len(finished)}"
        driver = subprocess.Popen(command(study, options), stdout=subprocess.DEVNULL)
        try:
            code = driver.wait(timeout=rng.uniform(0.5, longest_s) if hits < kills else None)
        except subprocess.TimeoutExpired:
            driver.kill()
            driver.wait()
            hits += 1
        else:
            assert code == 0
            finished.append(study)
    return finished


def check(tmp_path: Path, options: list[str], kills: int, longest_s: float) -> None:
    subprocess.run(command(tmp_path / "left_alone", options), check=True, stdout=subprocess.DEVNULL)
    expected = tables(tmp_path / "left_alone")
    assert expected[0]
    for study in kill_until(tmp_path, options, kills, longest_s, np.random.default_rng(4)):
        assert tables(study) == expected
        assert read_failures(open_study(study)) == []


def test_two_kills_while_designing(tmp_path: Path) -> None:
    options = ["--tasks", "button_pushing", "--designs", "1", "--concepts", "1", "--seeds", "0", "--jobs", "1"]
    check(tmp_path, options, kills=2, longest_s=6.0)


@pytest.mark.slow
def test_twenty_kills_while_designing_training_and_judging(tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3", reason="needs the extra rl")
    # less than one rollout: a policy killed in its second one goes on from a checkpoint, with other episodes
    options = ["--tasks", "dynamic_catching", "--designs", "2", "--concepts", "1", "--steps", "500"]
    check(tmp_path, options, kills=20, longest_s=25.0)
