"""Means with bootstrap intervals, and significance of paired differences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from aidsr.core.rates import Interval

T = TypeVar("T")
_DRAWS = 10_000
"""Bootstrap samples. Source: Efron and Tibshirani, An Introduction to the Bootstrap (1993): thousands for percentile
intervals."""
_ROUNDING = 1e-9
"""Relative tolerance when means are compared: the sum of the same numbers in another order has rounding errors."""


def bootstrap_mean(values: Mapping[str, Sequence[Sequence[Sequence[float]]]], seed: int = 0) -> Interval:
    """Return the mean over tasks of the mean over designs, with a 95 % hierarchical bootstrap interval.

    Episodes of one policy are correlated, and so are policies of one design. Therefore tasks are kept, designs are
    resampled within each task, policies within each design, and episodes within each policy.

    Args:
        values: By task, for each design and each of its policies the outcomes of the episodes, 0 or 1. A design
            without any policy counts as 0, and so does a policy without any episode.
        seed: Seed of the random generator.
    """
    tables = [[_shares(design) for design in designs] for designs in values.values() if designs]
    if not tables:
        return Interval(math.nan, math.nan, math.nan)
    mean = float(np.mean([np.mean([shares.mean() for shares, _ in designs]) for designs in tables]))
    rng = np.random.default_rng(seed)
    draws = np.mean([_redrawn(designs, rng) for designs in tables], axis=0)
    return Interval(mean, *_percentiles(draws))


Shares = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Share of successful episodes and number of episodes of each policy of one design, both (policies,)."""


def _shares(policies: Sequence[Sequence[float]]) -> Shares:
    played = [list(episodes) or [0.0] for episodes in policies] or [[0.0]]
    return np.array([np.mean(episodes) for episodes in played]), np.array([len(episodes) for episodes in played])


@dataclass(frozen=True)
class PairedDifference:
    """Mean difference of paired values, with its interval and p value."""

    interval: Interval
    p_value: float
    """Two-sided p value: probability of a mean at least as far from zero when the sign of each pair is random. A few
    pairs that all agree have a bootstrap interval of zero width, but p is not below 0.05 for fewer than six pairs."""
    pairs: int
    """Number of pairs."""


def paired_difference(
    one: Mapping[str, Mapping[T, float]], other: Mapping[str, Mapping[T, float]]
) -> PairedDifference | None:
    """Return the mean of `other` - `one` over the pairs that both have, or None where there are none.

    The interval is a paired bootstrap: differences are resampled within each task.

    Args:
        one: Values by task and by the key that pairs them, such as run and number of the design.
        other: Values to compare with, by the same keys.

    Source: for the sign-flip test, R. A. Fisher, The Design of Experiments (1935), section 21; for adding one to both
    counts, B. Phipson and G. K. Smyth, Statistical Applications in Genetics and Molecular Biology 9 (2010) 39.
    """
    tables = []
    for task in sorted(one.keys() & other.keys()):  # sorted, since all tasks draw from one generator
        pairs = sorted(one[task].keys() & other[task].keys(), key=repr)
        if pairs:
            tables.append(np.array([other[task][pair] - one[task][pair] for pair in pairs]))
    if not tables:
        return None
    rng = np.random.default_rng(0)
    value = float(np.mean([table.mean() for table in tables]))
    draws = np.mean([table[rng.integers(0, table.size, (_DRAWS, table.size))].mean(axis=1) for table in tables], axis=0)
    signed = [(table * rng.choice([-1.0, 1.0], (_DRAWS, table.size))).mean(axis=1) for table in tables]
    as_far = int(np.sum(np.abs(np.mean(signed, axis=0)) >= abs(value) - _ROUNDING * abs(value)))
    return PairedDifference(
        Interval(value, *_percentiles(draws)), (1 + as_far) / (1 + _DRAWS), sum(table.size for table in tables)
    )


def _redrawn(designs: Sequence[Shares], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the means of bootstrap samples of designs, policies within them, and episodes within those (draws,)."""
    policies = np.array([shares.size for shares, _ in designs])
    most = int(policies.max())
    shares, counts = (np.zeros((len(designs), most)) for _ in range(2))
    for row, (won, played) in enumerate(designs):
        shares[row, : won.size], counts[row, : won.size] = won, played
    picked = rng.integers(0, len(designs), (_DRAWS, len(designs)))
    policy = rng.integers(0, policies[picked][..., None], (_DRAWS, len(designs), most))
    share, count = shares[picked[..., None], policy], counts[picked[..., None], policy]
    # the number of successes among m episodes drawn with replacement is binomial
    drawn = rng.binomial(count.astype(int), np.clip(share, 0.0, 1.0)) / count
    # mask the padding: each design counts only its own number of policies
    drawn *= np.arange(most) < policies[picked][..., None]
    return np.asarray((drawn.sum(axis=2) / policies[picked]).mean(axis=1))


def _percentiles(draws: NDArray[np.float64]) -> tuple[float, float]:
    low, high = np.percentile(draws, [2.5, 97.5])
    return float(low), float(high)
