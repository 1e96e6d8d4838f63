"""Intervals against known values and against what they promise."""

from __future__ import annotations

import itertools
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


def alone(*designs: list[list[float]]) -> list[list[list[list[float]]]]:
    """Return designs as the only ones of their runs."""
    return [[design] for design in designs]


def test_every_task_counts_the_same_and_an_untrained_design_counts_as_failed() -> None:
    won, lost = [[1.0] * 20], [[0.0] * 20]
    interval = bootstrap_mean({"a": alone(won, won), "b": alone(won, []), "c": alone(lost, lost)})
    assert interval.value == pytest.approx((1.0 + 0.5 + 0.0) / 3)
    assert interval.low < interval.value < interval.high


def test_a_task_of_one_run_has_no_interval() -> None:
    found = bootstrap_mean({"a": [[[[1.0, 0.0]]]], "b": alone([[1.0]], [[0.0]])})
    assert found.value == 0.5
    assert np.isnan([found.low, found.high]).all()


def test_two_runs_that_agree_have_no_interval_and_six_have_one() -> None:
    """Two runs in which every design wins would else be 100 %, 100 % to 100 %."""
    for runs in (2, 5, 6):
        for values in ({"a": alone(*[[[1.0] * 20]] * runs)}, {"a": alone(*[[[0.0] * 20]] * runs)}):
            found = bootstrap_mean(values)
            assert np.isnan([found.low, found.high]).all() == (runs < 6)
            assert found.value in (0.0, 1.0)
    three_tasks = {task: alone([[1.0]], [[0.0]]) for task in "abc"}
    assert not np.isnan(bootstrap_mean(three_tasks).low), "the runs of all tasks count together"


def test_designs_that_differ_widen_the_interval_more_than_episodes_do() -> None:
    mixed = bootstrap_mean({"a": alone(*[[[1.0, 0.0] * 10]] * 10)})
    split = bootstrap_mean({"a": alone(*[[[1.0] * 20]] * 5 + [[[0.0] * 20]] * 5)})
    assert mixed.value == split.value
    assert split.high - split.low > 2 * (mixed.high - mixed.low)


def test_policies_that_differ_widen_the_interval_more_than_episodes_do() -> None:
    mixed = bootstrap_mean({"a": alone(*[[[1.0, 0.0] * 10] * 4] * 6)})
    split = bootstrap_mean({"a": alone(*[[[1.0] * 20] * 2 + [[0.0] * 20] * 2] * 6)})
    assert mixed.value == split.value == 0.5
    assert split.high - split.low > 2 * (mixed.high - mixed.low)


def test_runs_that_differ_widen_the_interval_more_than_designs_in_them_do() -> None:
    won, lost = [[1.0] * 20], [[0.0] * 20]
    mixed = bootstrap_mean({"a": [[won, lost, won, lost]] * 6})
    split = bootstrap_mean({"a": [[won] * 4] * 3 + [[lost] * 4] * 3})
    assert mixed.value == split.value == 0.5
    assert split.high - split.low > 1.5 * (mixed.high - mixed.low)


def test_designs_and_runs_need_not_have_the_same_number_of_policies_and_designs() -> None:
    won = [1.0] * 20
    found = bootstrap_mean({"a": [[[won]], [[won] * 5, [won]]] * 3})
    assert (found.value, found.low, found.high) == (1.0, 1.0, 1.0)
    uneven = bootstrap_mean({"a": [[[won]] * 3, [[[0.0] * 20]]] * 3})
    assert uneven.value == 0.75, "each design has the same weight"
    assert uneven.low < 0.5 < 0.9 < uneven.high


@pytest.mark.parametrize("concepts", [1, 3])
def test_the_interval_holds_the_truth_as_often_as_it_says(concepts: int) -> None:
    """Designs of one run have the same success rate, which a bootstrap of designs would take for less spread."""
    rng, held, studies = np.random.default_rng(3), 0, 60
    for _ in range(studies):
        rates = rng.beta(0.5, 0.5, size=10)
        runs = [[[rng.binomial(1, rate, size=20).tolist()] for _ in range(concepts)] for rate in rates]
        interval = bootstrap_mean({"a": runs})
        held += interval.low <= 0.5 <= interval.high
    assert held >= 0.85 * studies


def test_pairs_cancel_what_they_share() -> None:
    one = {"a": {(run, 1): float(run % 2) for run in range(20)}}
    other = {"a": {key: value + 0.1 for key, value in one["a"].items()}}
    found = paired_difference(one, other)
    assert found is not None
    assert found.interval.value == pytest.approx(0.1)
    assert found.interval.excludes_zero
    assert (found.pairs, found.runs) == (20, 20)
    assert found.p_value < 0.001


def arm(runs: int, concepts: int, value: float) -> dict[tuple[int, int], float]:
    return {(run, design): value for run in range(1, runs + 1) for design in range(1, concepts + 1)}


@pytest.mark.parametrize("concepts", [1, 3])
@pytest.mark.parametrize(("runs", "exact"), [(1, 1.0), (3, 0.25), (5, 0.0625), (6, 0.03125), (8, 0.0078125)])
def test_a_few_runs_that_agree_may_be_chance_however_many_designs_each_has(
    runs: int, exact: float, concepts: int
) -> None:
    found = paired_difference({"a": arm(runs, concepts, 0.0)}, {"a": arm(runs, concepts, 1.0)})
    assert found is not None
    assert (found.pairs, found.runs) == (runs * concepts, runs)
    assert found.p_value == exact, "all signs are tried"
    ends = found.interval.low, found.interval.high
    assert ends == (1.0, 1.0) if runs >= 6 else np.isnan(ends).all()


def test_the_p_value_is_exact_up_to_thirteen_runs_and_close_to_it_beyond() -> None:
    values = np.random.default_rng(7).normal(0.4, 1.0, size=(14, 2))
    for runs in (13, 14):
        other = {(run, design): values[run, design] for run in range(runs) for design in (0, 1)}
        found = paired_difference({"a": dict.fromkeys(other, 0.0)}, {"a": other})
        means = [abs(np.dot(signs, values[:runs].sum(axis=1))) for signs in itertools.product((1, -1), repeat=runs)]
        exact = np.mean(np.array(means) >= means[0] - 1e-12)
        assert found is not None
        assert found.p_value == pytest.approx(exact, abs=1e-12 if runs == 13 else 0.01)


def test_runs_of_several_tasks_count_together_and_a_task_of_one_run_has_no_interval() -> None:
    names = "abcdef"
    found = paired_difference({name: arm(1, 3, 0.0) for name in names}, {name: arm(1, 3, 1.0) for name in names})
    assert found is not None
    assert (found.runs, found.p_value) == (6, 2 / 2**6)
    assert np.isnan([found.interval.low, found.interval.high]).all(), "one run of a task says nothing of others"


def test_designs_of_one_run_that_agree_do_not_make_two_equal_arms_differ() -> None:
    """By resampling designs, not runs, 17 of 100 comparisons were significant."""
    rng, significant, repetitions = np.random.default_rng(5), 0, 300
    for _ in range(repetitions):
        arms = []
        for _ in range(2):
            rates = rng.beta(0.15, 0.15, size=8)  # designs of one run mostly succeed or fail together
            arms.append(
                {"a": {(run, design): float(rng.random() < rates[run]) for run in range(8) for design in range(3)}}
            )
        found = paired_difference(*arms)
        significant += found.p_value < 0.05 and found.interval.excludes_zero
    assert significant <= 0.05 * repetitions


def test_a_large_difference_between_clustered_arms_is_found() -> None:
    rng, significant, repetitions = np.random.default_rng(6), 0, 50
    for _ in range(repetitions):
        rates = rng.beta([[0.3], [6.0]], [[6.0], [0.3]], size=(2, 10))
        one, other = (
            {"a": {(run, design): float(rng.random() < rate[run]) for run in range(10) for design in range(3)}}
            for rate in rates
        )
        found = paired_difference(one, other)
        significant += found.p_value < 0.05 and found.interval.excludes_zero
    assert significant > 0.9 * repetitions


def test_what_is_not_in_both_is_left_out() -> None:
    one, other = {"a": {(1, 1): 0.0}, "b": {(1, 1): 0.0}}, {"a": {(1, 1): 1.0, (2, 1): 5.0}}
    found = paired_difference(one, other)
    assert found is not None
    assert found.interval.value == 1.0
    assert paired_difference({"a": {(1, 1): 0.0}}, {"b": {(1, 1): 0.0}}) is None


def test_each_design_has_the_same_weight_in_its_task() -> None:
    other = {"a": {(1, 1): 1.0, (1, 2): 1.0, (1, 3): 1.0, (2, 1): 5.0}}
    found = paired_difference({"a": dict.fromkeys(other["a"], 0.0)}, other)
    assert found is not None
    assert found.interval.value == 2.0


ONE_DIFFERENCE = """
from aidsr.studies.statistics import paired_difference
tasks = {
    task: {(run, 1): (3 * run + 7 * number) % 5 for run in range(6)} for number, task in enumerate("abcdefgh")
}
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
