"""Means with bootstrap intervals, and significance of paired differences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aidsr.core.rates import Interval

_DRAWS = 10_000
"""Bootstrap samples. Source: Efron and Tibshirani, An Introduction to the Bootstrap (1993): thousands for percentile
intervals."""
_ROUNDING = 1e-9
"""Relative tolerance when means are compared: the sum of the same numbers in another order has rounding errors."""
FEWEST_RUNS = 6
"""Least number of runs for an interval or a significant difference: with five that all agree, 2 of the 2^5 choices of
signs give as large a difference, more than 5 %."""

Policies = Sequence[Sequence[float]]
"""Outcomes of the episodes, 0 or 1, of each policy of one design."""


def bootstrap_mean(values: Mapping[str, Sequence[Sequence[Policies]]], seed: int = 0) -> Interval:
    """Return the mean over tasks of the mean over designs, with a 95 % hierarchical bootstrap interval.

    Episodes of one policy are correlated, and so are policies of one design and designs of one run. Therefore tasks are
    kept, runs are resampled within each task, designs within each run, policies within each design, and episodes within
    each policy.

    Args:
        values: By task, for each run, each of its designs and each of their policies the outcomes of the episodes, 0 or
            1. A design without any policy counts as 0, and so does a policy without any episode.
        seed: Seed of the random generator.

    Returns:
        The mean; the ends are nan where an interval cannot be estimated, see `_has_interval`.

    Source: A. C. Davison and D. V. Hinkley, Bootstrap Methods and their Application (1997), section 3.8.
    """
    tables = [[[_shares(design) for design in run] for run in runs if run] for runs in values.values()]
    tables = [runs for runs in tables if runs]
    if not tables:
        return Interval(math.nan, math.nan, math.nan)
    mean = float(np.mean([np.mean([shares.mean() for run in runs for shares, _ in run]) for runs in tables]))
    if not _has_interval([len(runs) for runs in tables]):
        return Interval(mean, math.nan, math.nan)
    rng = np.random.default_rng(seed)
    draws = np.mean([_redrawn(runs, rng) for runs in tables], axis=0)
    return Interval(mean, *_percentiles(draws))


def _has_interval(runs: Sequence[int]) -> bool:
    """Whether an interval can be estimated from these numbers of runs, one for each task.

    It takes `FEWEST_RUNS` runs in total, as few runs agree by chance, and two of each task: one does not say how runs
    differ.
    """
    return sum(runs) >= FEWEST_RUNS and min(runs) > 1


Shares = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Share of successful episodes and number of episodes of each policy of one design, both (policies,)."""


def _shares(policies: Policies) -> Shares:
    played = [list(episodes) or [0.0] for episodes in policies] or [[0.0]]
    return np.array([np.mean(episodes) for episodes in played]), np.array([len(episodes) for episodes in played])


@dataclass(frozen=True)
class PairedDifference:
    """Mean difference of paired values, with its interval and p value."""

    interval: Interval
    """The mean; the ends are nan where an interval cannot be estimated, see `_has_interval`."""
    p_value: float
    """Two-sided p value: probability of a mean at least as far from zero when the sign of each run is random. It is not
    below 0.05 for fewer than `FEWEST_RUNS` runs."""
    pairs: int
    """Number of pairs."""
    runs: int
    """Number of runs that the pairs are from."""


def paired_difference(
    one: Mapping[str, Mapping[tuple[int, int], float]], other: Mapping[str, Mapping[tuple[int, int], float]]
) -> PairedDifference | None:
    """Return the mean of `other` - `one` over the pairs that both have, or None where there are none.

    Designs of one run are not independent: they come from one call of the Designer. Therefore the interval is a paired
    cluster bootstrap, in which whole runs are resampled within each task, and the test changes the sign of whole runs.
    The p value is exact if there are at most 13 runs, else from random signs.

    Args:
        one: Values by task and by number of the run and of the design.
        other: Values to compare with, by the same keys.

    Source: for the bootstrap, C. A. Field and A. H. Welsh, Journal of the Royal Statistical Society B 69 (2007)
    369-390; for the sign-flip test, R. A. Fisher, The Design of Experiments (1935), section 21; for signs of whole
    clusters, A. M. Winkler et al., NeuroImage 123 (2015) 253-268; for adding one to both counts of random signs,
    B. Phipson and G. K. Smyth, Statistical Applications in Genetics and Molecular Biology 9 (2010) 39.
    """
    tables = []
    for task in sorted(one.keys() & other.keys()):  # sorted, since all tasks draw from one generator
        runs: dict[int, list[float]] = {}
        for run, design in sorted(one[task].keys() & other[task].keys()):
            runs.setdefault(run, []).append(other[task][run, design] - one[task][run, design])
        if runs:
            tables.append(
                (np.array([sum(run) for run in runs.values()]), np.array([len(run) for run in runs.values()]))
            )
    if not tables:
        return None
    rng = np.random.default_rng(0)
    count = sum(sums.size for sums, _ in tables)
    # share of each run in the mean over tasks of the mean over designs
    parts = [sums / sizes.sum() / len(tables) for sums, sizes in tables]
    value = float(sum(part.sum() for part in parts))
    low, high = math.nan, math.nan
    if _has_interval([sums.size for sums, _ in tables]):
        low, high = _percentiles(np.mean([_resampled(*table, rng) for table in tables], axis=0))
    return PairedDifference(
        Interval(value, low, high), _p_value(parts, rng), int(sum(sizes.sum() for _, sizes in tables)), count
    )


def _resampled(sums: NDArray[np.float64], sizes: NDArray[np.int64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the means of bootstrap samples of whole runs (draws,), from the sum and the size of each run (runs,)."""
    picked = rng.integers(0, sums.size, (_DRAWS, sums.size))
    return np.asarray(sums[picked].sum(axis=1) / sizes[picked].sum(axis=1))


def _p_value(parts: Sequence[NDArray[np.float64]], rng: np.random.Generator) -> float:
    """Return the two-sided p value of a sum over tasks and runs under random signs of its parts, each (runs,).

    All signs are tried if these are not more than random draws would be.
    """
    every = np.concatenate(parts)
    far = abs(every.sum()) - _ROUNDING * np.abs(every).sum()
    if 2**every.size <= _DRAWS:
        signs = 1.0 - 2.0 * (np.arange(2**every.size)[:, None] >> np.arange(every.size) & 1)
        return float(np.mean(np.abs(signs @ every) >= far))
    signed = np.sum([rng.choice([-1.0, 1.0], (_DRAWS, part.size)) @ part for part in parts], axis=0)
    return (1 + int(np.sum(np.abs(signed) >= far))) / (1 + _DRAWS)


def _redrawn(runs: Sequence[Sequence[Shares]], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the means of bootstrap samples of runs, of designs, policies and episodes within them (draws,)."""
    designs = [design for run in runs for design in run]
    policies = np.array([shares.size for shares, _ in designs])
    most = int(policies.max())
    shares, counts = (np.zeros((len(designs), most)) for _ in range(2))
    for row, (won, played) in enumerate(designs):
        shares[row, : won.size], counts[row, : won.size] = won, played
    picked, weights = _picked_designs([len(run) for run in runs], rng)
    policy = rng.integers(0, policies[picked][..., None], (*picked.shape, most))
    share, count = shares[picked[..., None], policy], counts[picked[..., None], policy]
    # the number of successes among m episodes drawn with replacement is binomial
    drawn = rng.binomial(count.astype(int), np.clip(share, 0.0, 1.0)) / count
    # mask the padding: each design counts only its own number of policies
    drawn *= np.arange(most) < policies[picked][..., None]
    return np.asarray((weights * drawn.sum(axis=2) / policies[picked]).sum(axis=1) / weights.sum(axis=1))


def _picked_designs(sizes: Sequence[int], rng: np.random.Generator) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return designs picked by bootstrap of runs and of the designs within each, and whether each pick counts.

    Args:
        sizes: Number of designs of each run.
        rng: Random generator.

    Returns:
        Indices of designs, counted over all runs, and False for the padding of small runs; both (draws, picks).
    """
    size, first, most = np.array(sizes), np.cumsum([0, *sizes[:-1]]), max(sizes)
    run = rng.integers(0, len(sizes), (_DRAWS, len(sizes)))
    design = first[run][..., None] + rng.integers(0, size[run][..., None], (*run.shape, most))
    counts = np.arange(most) < size[run][..., None]
    return design.reshape(_DRAWS, -1), counts.reshape(_DRAWS, -1)


def _percentiles(draws: NDArray[np.float64]) -> tuple[float, float]:
    low, high = np.percentile(draws, [2.5, 97.5])
    return float(low), float(high)
