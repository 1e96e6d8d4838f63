"""The page on smoothing has a row for each way that a robot was trained in, and medians of its policies."""

import importlib.util
import sys
from pathlib import Path

import pytest

from aidsr.core.artifacts import EpisodeResult, Evaluation, PlausibilityCheck

PATH = Path(__file__).parents[2] / "benchmarks" / "rl" / "smoothing.py"


@pytest.fixture
def program(monkeypatch):
    pytest.importorskip("stable_baselines3")
    spec = importlib.util.spec_from_file_location("smoothing", PATH)
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)  # dataclasses look themselves up there
    spec.loader.exec_module(module)
    return module


def learned(program, smoothing, seed, won, wall_s, valid=True):
    case = program.CASES[0]
    episodes = [
        EpisodeResult(
            variation=index,
            ended="succeeded" if index < won else "out_of_time",
            progress=0.5,
            best_progress=0.5,
            reward=1.0,
            time_s=2.0,
        )
        for index in range(20)
    ]
    check = PlausibilityCheck(name="moves", passed=valid, measured=1.0, limit=0.0, message="it moves")
    evaluation = Evaluation(
        task=case.task, level="standard", benchmark_version=3, episodes=tuple(episodes), checks=(check,)
    )
    result = program.TrainingResult(
        steps=case.steps, wall_s=wall_s, episodes=100, diverged_episodes=0, success_share=0.5, stopped="budget"
    )
    return program.Learned(case, smoothing, seed, result, evaluation)


def test_each_way_is_a_row_of_its_own_policies(program):
    plain = [learned(program, 0.0, seed, won, 60.0 + seed) for seed, won in enumerate((10, 4, 16))]
    smoothed = [learned(program, 0.7, 0, 20, 75.4, valid=False)]
    rows = [line for line in program.page([*plain, *smoothed]).splitlines() if line.startswith("| reaching")]
    assert rows == [
        "| reaching/button_pushing | 7 | 45,000 | 0 | 3 of 3 | 50%, 20%, 80% | 50% | 61 |",
        "| reaching/button_pushing | 7 | 45,000 | 0.7 | 0 of 1 | 100% | 100% | 75 |",
    ]


def test_smoothings_take_turns_so_that_a_slower_machine_slows_both(program):
    assert list(program.Case("t", 1, 10, seeds=2).trainings()) == [(0.0, 0), (0.7, 0), (0.0, 1), (0.7, 1)]
