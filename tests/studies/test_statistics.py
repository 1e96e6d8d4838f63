"""Intervals against known values and against what they promise."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from aidsr.core.rates import wilson
from aidsr.studies.statistics import bootstrap_mean, paired_difference
from aidsr.studies.tables import IN_SAMPLE, sample_in_words
from aidsr.tasks import RULES_FROZEN_AT, TASKS_OUT_OF_SAMPLE


@pytest.mark.parametrize(
    ("hits", "of", "low", "high"),
    # from the formula worked out by hand; the first two are the textbook's extremes
    [(0, 10, 0.0, 0.2775), (10, 10, 0.7225, 1.0), (5, 10, 0.2366, 0.7634), (81, 263, 0.2553, 0.3662)],
)
def test_wilson(hits: int, of: int, low: float, high: float) -> None:
    interval = wilson(hits, of)
    assert (interval.low, interval.high) == (pytest.approx(low, abs=1e-4), pytest.approx(high, abs=1e-4))


def test_nothing_says_nothing() -> None:
    interval = wilson(0, 0)
    assert (interval.low, interval.high) == (0.0, 1.0)
    assert np.isnan(interval.value)


def test_every_task_counts_the_same_and_an_untrained_design_counts_as_failed() -> None:
    interval = bootstrap_mean({"a": [[[1.0] * 20], [[1.0] * 20]], "b": [[[1.0] * 20], []], "c": [[[0.0] * 20]]})
    assert interval.value == pytest.approx((1.0 + 0.5 + 0.0) / 3)
    assert interval.low < interval.value < interval.high


def test_designs_that_differ_widen_the_interval_more_than_episodes_do() -> None:
    mixed = bootstrap_mean({"a": [[[1.0, 0.0] * 10]] * 10})
    split = bootstrap_mean({"a": [[[1.0] * 20]] * 5 + [[[0.0] * 20]] * 5})
    assert mixed.value == split.value
    assert split.high - split.low > 2 * (mixed.high - mixed.low)


def test_policies_that_differ_widen_the_interval_more_than_episodes_do() -> None:
    mixed = bootstrap_mean({"a": [[[1.0, 0.0] * 10] * 4]})
    split = bootstrap_mean({"a": [[[1.0] * 20] * 2 + [[0.0] * 20] * 2]})
    assert mixed.value == split.value == 0.5
    assert split.high - split.low > 2 * (mixed.high - mixed.low)


def test_designs_need_not_have_the_same_number_of_policies() -> None:
    found = bootstrap_mean({"a": [[[1.0] * 20], [[1.0] * 20] * 5]})
    assert (found.value, found.low, found.high) == (1.0, 1.0, 1.0)


def test_the_interval_holds_the_truth_as_often_as_it_says() -> None:
    rng, held, studies = np.random.default_rng(3), 0, 60
    for _ in range(studies):
        designs = [[rng.binomial(1, rng.beta(2, 2), size=20).tolist()] for _ in range(30)]
        interval = bootstrap_mean({"a": designs})
        held += interval.low <= 0.5 <= interval.high
    assert held >= 0.85 * studies


def test_pairs_cancel_what_they_share() -> None:
    one = {"a": {(run, 1): float(run % 2) for run in range(20)}}
    other = {"a": {key: value + 0.1 for key, value in one["a"].items()}}
    found = paired_difference(one, other)
    assert found is not None
    assert found.interval.value == pytest.approx(0.1)
    assert found.interval.excludes_zero
    assert found.pairs == 20
    assert found.p_value < 0.001


@pytest.mark.parametrize(("pairs", "exact"), [(1, 1.0), (3, 0.25), (5, 0.0625), (6, 0.03125), (8, 0.0078125)])
def test_a_few_pairs_that_agree_may_be_chance(pairs: int, exact: float) -> None:
    found = paired_difference({"a": dict.fromkeys(range(pairs), 0.0)}, {"a": dict.fromkeys(range(pairs), 1.0)})
    assert found is not None
    assert (found.interval.low, found.interval.high) == (1.0, 1.0)
    assert found.p_value == pytest.approx(exact, abs=0.01)


def test_what_is_not_in_both_is_left_out() -> None:
    one, other = {"a": {(1, 1): 0.0}, "b": {(1, 1): 0.0}}, {"a": {(1, 1): 1.0, (2, 1): 5.0}}
    found = paired_difference(one, other)
    assert found is not None
    assert found.interval.value == 1.0
    assert paired_difference({"a": {(1, 1): 0.0}}, {"b": {(1, 1): 0.0}}) is None


ONE_DIFFERENCE = """
from aidsr.studies.statistics import paired_difference
tasks = {task: {run: (3 * run + 7 * number) % 5 for run in range(6)} for number, task in enumerate("abcdefgh")}
print(paired_difference({task: dict.fromkeys(runs, 1.0) for task, runs in tasks.items()}, tasks))
"""


def test_a_difference_is_the_same_in_every_process() -> None:
    """The order of a set of names differs from process to process."""
    found = {
        subprocess.run(
            [sys.executable, "-c", ONE_DIFFERENCE],
            env=os.environ | {"PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("1", "2", "3")
    }
    assert len(found) == 1


def test_a_caption_tells_tasks_out_of_sample_apart() -> None:
    assert sample_in_words(["locomotion/gap"]) == IN_SAMPLE
    later = TASKS_OUT_OF_SAMPLE[0]
    assert IN_SAMPLE not in sample_in_words([later])
    both = sample_in_words(["locomotion/gap", later])
    assert both.startswith(IN_SAMPLE)
    assert f"{later}: added after the rules were frozen at commit {RULES_FROZEN_AT}" in both
