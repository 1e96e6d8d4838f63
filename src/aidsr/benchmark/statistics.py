"""Rates with honest intervals, and whether a difference is more than noise."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = ["Interval", "Rate", "bootstrap_mean", "paired_difference", "wilson"]

T = TypeVar("T")
_Z_95 = 1.959964
"""Standard normal quantile of a two-sided interval of 95 %."""
_DRAWS = 10_000
"""Bootstrap samples. Source: Efron and Tibshirani, An Introduction to the Bootstrap (1993): thousands for percentile
intervals."""


@dataclass(frozen=True)
class Interval:
    """A value with its 95 % interval."""

    value: float
    low: float
    high: float

    @property
    def excludes_zero(self) -> bool:
        """Whether 0 lies outside."""
        return self.low > 0 or self.high < 0


@dataclass(frozen=True)
class Rate:
    """How many of how many. The denominator is all that was attempted, never only what ended well."""

    hits: int
    of: int

    @property
    def share(self) -> float:
        """The rate, nan of nothing."""
        return self.hits / self.of if self.of else math.nan

    @property
    def interval(self) -> Interval:
        """The rate with its Wilson interval."""
        return wilson(self.hits, self.of)


def wilson(hits: int, of: int) -> Interval:
    """Return a rate with its Wilson score interval at 95 %; 0 to 1 of nothing.

    Source: E. B. Wilson, Journal of the American Statistical Association 22 (1927) 209-212.
    """
    if of == 0:
        return Interval(math.nan, 0.0, 1.0)
    share, z2 = hits / of, _Z_95**2
    middle = (share + z2 / (2 * of)) / (1 + z2 / of)
    half = _Z_95 * math.sqrt(share * (1 - share) / of + z2 / (4 * of**2)) / (1 + z2 / of)
    return Interval(share, max(0.0, middle - half), min(1.0, middle + half))


def bootstrap_mean(values: Mapping[str, Sequence[Sequence[float]]], seed: int = 0) -> Interval:
    """Return the mean over tasks of the mean over designs, with an interval that respects how the values came about.

    Episodes of one policy are alike, and so are seeds of one design: tasks are kept, designs are drawn anew within each
    task, and then episodes within each design.

    Args:
        values: By task, one sequence of outcomes (0 or 1, one an episode) for each design; an empty one counts as 0.
        seed: Of the bootstrap.
    """
    tables = [[np.asarray(design if len(design) else [0.0], dtype=float) for design in v] for v in values.values() if v]
    if not tables:
        return Interval(math.nan, math.nan, math.nan)
    mean = float(np.mean([np.mean([design.mean() for design in designs]) for designs in tables]))
    rng = np.random.default_rng(seed)
    draws = np.mean([_redrawn(designs, rng) for designs in tables], axis=0)
    return Interval(mean, *_percentiles(draws))


def paired_difference(one: Mapping[str, Mapping[T, float]], other: Mapping[str, Mapping[T, float]]) -> Interval | None:
    """Return by how much `other` is above `one`, on designs that both have, or None where there are none.

    Args:
        one: Values by task and by what pairs them, such as run and number of the design.
        other: The same of the other.

    The interval is a paired bootstrap: differences are drawn anew within each task.
    """
    tables = []
    for task in one.keys() & other.keys():
        pairs = sorted(one[task].keys() & other[task].keys(), key=repr)
        if pairs:
            tables.append(np.array([other[task][pair] - one[task][pair] for pair in pairs]))
    if not tables:
        return None
    rng = np.random.default_rng(0)
    draws = np.mean([_drawn(rng, table, lambda picked: picked.mean(axis=1)) for table in tables], axis=0)
    return Interval(float(np.mean([table.mean() for table in tables])), *_percentiles(draws))


def _redrawn(designs: Sequence[NDArray[np.float64]], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return means of designs drawn anew, their episodes drawn anew within, (draws,)."""
    # a share of m episodes drawn with replacement is a binomial share
    shares = np.array([design.mean() for design in designs])
    counts = np.array([design.size for design in designs])
    picked = rng.integers(0, len(designs), size=(_DRAWS, len(designs)))
    drawn = rng.binomial(counts[picked], np.clip(shares[picked], 0.0, 1.0)) / counts[picked]
    return np.asarray(drawn.mean(axis=1))


def _drawn(
    rng: np.random.Generator,
    table: NDArray[np.float64],
    of: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> NDArray[np.float64]:
    return of(table[rng.integers(0, table.size, size=(_DRAWS, table.size))])


def _percentiles(draws: NDArray[np.float64]) -> tuple[float, float]:
    low, high = np.percentile(draws, [2.5, 97.5])
    return float(low), float(high)
