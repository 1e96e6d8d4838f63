"""Means with honest intervals, and whether a difference is more than noise."""

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
"""Relative; a mean of the same numbers in another order is as far from zero."""


def bootstrap_mean(values: Mapping[str, Sequence[Sequence[Sequence[float]]]], seed: int = 0) -> Interval:
    """Return the mean over tasks of the mean over designs, with an interval that respects how the values came about.

    Episodes of one policy are alike, and so are policies of one design: tasks are kept, designs are redrawn within
    each task, policies within each design, and then episodes within each policy.

    Args:
        values: By task, for each design and each of its policies the outcomes (0 or 1, one an episode); a design
            without any policy counts as 0, and so does a policy without any episode.
        seed: Of the bootstrap.
    """
    tables = [[_shares(design) for design in designs] for designs in values.values() if designs]
    if not tables:
        return Interval(math.nan, math.nan, math.nan)
    mean = float(np.mean([np.mean([shares.mean() for shares, _ in designs]) for designs in tables]))
    rng = np.random.default_rng(seed)
    draws = np.mean([_redrawn(designs, rng) for designs in tables], axis=0)
    return Interval(mean, *_percentiles(draws))


Shares = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Of one design's policies: share of episodes won, and episodes, both (policies,)."""


def _shares(policies: Sequence[Sequence[float]]) -> Shares:
    played = [list(episodes) or [0.0] for episodes in policies] or [[0.0]]
    return np.array([np.mean(episodes) for episodes in played]), np.array([len(episodes) for episodes in played])


@dataclass(frozen=True)
class PairedDifference:
    """How far two things are apart on what both did, and how easily chance alone does as much."""

    interval: Interval
    chance: float
    """Two-sided p: how often the mean is as far from zero when the sign of each pair is drawn at random. A few pairs
    that all agree have a bootstrap interval without any width; this does not fall below 0.05 for fewer than six."""
    pairs: int


def paired_difference(
    one: Mapping[str, Mapping[T, float]], other: Mapping[str, Mapping[T, float]]
) -> PairedDifference | None:
    """Return by how much `other` is above `one`, on designs that both have, or None where there are none.

    Args:
        one: Values by task and by what pairs them, such as run and number of the design.
        other: The same of the other.

    The interval is a paired bootstrap: differences are redrawn within each task.

    Source: of the test by signs, R. A. Fisher, The Design of Experiments (1935), section 21; of adding one to both
    counts, B. Phipson and G. K. Smyth, Statistical Applications in Genetics and Molecular Biology 9 (2010) 39.
    """
    tables = []
    for task in sorted(one.keys() & other.keys()):  # in an order, since all draw from one generator
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
    """Return means of redrawn designs, their policies redrawn within, and episodes within those, (draws,)."""
    policies = np.array([shares.size for shares, _ in designs])
    most = int(policies.max())
    shares, counts = (np.zeros((len(designs), most)) for _ in range(2))
    for row, (won, played) in enumerate(designs):
        shares[row, : won.size], counts[row, : won.size] = won, played
    picked = rng.integers(0, len(designs), (_DRAWS, len(designs)))
    policy = rng.integers(0, policies[picked][..., None], (_DRAWS, len(designs), most))
    share, count = shares[picked[..., None], policy], counts[picked[..., None], policy]
    # a share of m episodes drawn with replacement is a binomial share
    drawn = rng.binomial(count.astype(int), np.clip(share, 0.0, 1.0)) / count
    # a design has as many policies as it had, not as many as the one with most
    drawn *= np.arange(most) < policies[picked][..., None]
    return np.asarray((drawn.sum(axis=2) / policies[picked]).mean(axis=1))


def _percentiles(draws: NDArray[np.float64]) -> tuple[float, float]:
    low, high = np.percentile(draws, [2.5, 97.5])
    return float(low), float(high)
