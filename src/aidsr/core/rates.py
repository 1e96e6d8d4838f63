"""Success rates with confidence intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass

_Z_95 = 1.959964
"""Quantile of the standard normal distribution for a two-sided 95 % interval."""


@dataclass(frozen=True)
class Interval:
    """A value with its 95 % confidence interval."""

    value: float
    low: float
    high: float

    @property
    def excludes_zero(self) -> bool:
        """Whether 0 lies outside the interval."""
        return self.low > 0 or self.high < 0


@dataclass(frozen=True)
class Rate:
    """A number of hits out of a number of attempts, counting all attempts, including those that ended in an error."""

    hits: int
    of: int

    @property
    def share(self) -> float:
        """Hits / attempts; nan without attempts."""
        return self.hits / self.of if self.of else math.nan

    @property
    def interval(self) -> Interval:
        """The share with its 95 % Wilson interval."""
        return wilson(self.hits, self.of)


def wilson(hits: int, of: int) -> Interval:
    """Return a share with its 95 % Wilson score interval; without attempts, nan with the interval 0 to 1.

    Source: E. B. Wilson, Journal of the American Statistical Association 22 (1927) 209-212.
    """
    if of == 0:
        return Interval(math.nan, 0.0, 1.0)
    share, z2 = hits / of, _Z_95**2
    middle = (share + z2 / (2 * of)) / (1 + z2 / of)
    half = _Z_95 * math.sqrt(share * (1 - share) / of + z2 / (4 * of**2)) / (1 + z2 / of)
    return Interval(share, max(0.0, middle - half), min(1.0, middle + half))
