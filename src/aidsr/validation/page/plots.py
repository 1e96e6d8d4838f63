"""Plots of signals: curves over time with their limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from aidsr.core.formatting import format_number
from aidsr.core.plots import BAD, svg_plot
from aidsr.validation.signals import Signal

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_FEW_POINTS = 20
"""Most points of a curve that is drawn with a marker at each point."""
_LARGEST_RATIO = 12.0
"""Limit / largest value beyond which the limit is not drawn, because it would flatten the curve."""


def plot_signal(signal: Signal, key: str) -> str:
    """Return a signal as an <svg> element: curves, limits, and the first bad time.

    Args:
        signal: The signal to draw.
        key: Key of the plot, unique on its page.
    """
    title = f"{signal.quantity} over time: {signal.test}"
    return svg_plot(lambda axes: _draw(axes, signal), (5.6, 2.9), title, key=key)


def spark(values: tuple[float, ...], top: float, width: int = 132, height: int = 30) -> str:
    """Return the points of a small curve for an SVG <polyline>, 0 at the bottom and `top` at the top."""
    if len(values) < 2 or top <= 0:
        return ""
    step = width / (len(values) - 1)
    shown = [min(max(value / top, 0.0), 1.0) for value in values]
    return " ".join(f"{index * step:.1f},{1 + (height - 2) * (1 - value):.1f}" for index, value in enumerate(shown))


def _draw(axes: Axes, signal: Signal) -> None:
    from matplotlib.ticker import FuncFormatter, NullFormatter

    marker = "o" if len(signal.time_s) <= _FEW_POINTS else None
    for line in signal.lines:
        axes.plot(signal.time_s, line.values, marker=marker, ms=4, label=line.label)
    if signal.logarithmic:
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
    for limit in signal.limits:
        if _fits(signal, limit):
            _draw_limit(axes, limit)
    if signal.first_bad_s is not None:
        _draw_first_bad(axes, signal.first_bad_s, signal.time_s[-1])
    axes.set_xlabel("time in the test [s]")
    axes.set_ylabel(f"{signal.quantity} [{signal.unit}]" if signal.unit else signal.quantity, wrap=True)
    axes.set_xlim(0.0, 1.01 * signal.time_s[-1])
    if len(signal.lines) > 1:
        axes.legend(ncols=2, loc="best")


def _draw_limit(axes: Axes, limit: float) -> None:
    axes.axhline(limit, color=BAD, lw=1.1, ls=(0, (5, 3)))
    axes.annotate(
        f"limit {format_number(limit)}",
        xy=(1.0, limit),
        xycoords=("axes fraction", "data"),
        xytext=(-3, 3),
        textcoords="offset points",
        ha="right",
        color=BAD,
        fontsize=8,
    )


def _draw_first_bad(axes: Axes, time_s: float, end_s: float) -> None:
    """Draw a vertical line at a time, with its label above the axes, where no curve is."""
    axes.axvline(time_s, color=BAD, lw=1.1)
    axes.annotate(
        f"first bad at {format_number(time_s)} s",
        xy=(time_s, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(0, 3),
        textcoords="offset points",
        ha="left" if time_s < end_s / 2 else "right",
        color=BAD,
        fontsize=8,
    )


def _fits(signal: Signal, limit: float) -> bool:
    """Whether a limit can be drawn without flattening the curves."""
    largest = max((abs(value) for line in signal.lines for value in line.values), default=0.0)
    return signal.logarithmic or abs(limit) <= _LARGEST_RATIO * max(largest, 1e-12)
