"""Recordings thinned out to what a plot can show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aidsr.validation.page.traces import Line, Signal

Array = NDArray[np.float64]

_MOST_POINTS = 240
"""Of a curve: two for each millimetre of a plot as wide as a hand."""
_DIGITS = 5


def kept_frames(frames: int) -> NDArray[np.int64]:
    """Return which of some frames are shown, the first and the last among them."""
    return np.unique(np.linspace(0, frames - 1, min(frames, _MOST_POINTS)).round().astype(int))


def thinned(values: Array) -> tuple[float, ...]:
    """Return a curve as few numbers of few digits; what is not finite as the largest number that is."""
    shown = np.nan_to_num(values[kept_frames(len(values))], nan=0.0, posinf=1e300, neginf=-1e300)
    return tuple(float(f"{value:.{_DIGITS}g}") for value in shown)


def signal(
    quantity: str,
    unit: str,
    test: str,
    frame_s: float,
    curves: dict[str, Array],
    limits: tuple[float, ...] = (),
    first_bad_s: float | None = None,
    logarithmic: bool = False,
) -> Signal | None:
    """Return curves of equal length over time, (n_frames,) each; None without any."""
    if not curves:
        return None
    frames = len(next(iter(curves.values())))
    return Signal(
        quantity=quantity,
        unit=unit,
        test=test,
        time_s=thinned(np.arange(1.0, frames + 1) * frame_s),
        lines=tuple(Line(label=label, values=thinned(values)) for label, values in curves.items()),
        limits=limits,
        first_bad_s=first_bad_s,
        logarithmic=logarithmic,
    )
