"""Signals drawn as SVG that takes its colours from the page, so that one drawing suits light and dark."""

from __future__ import annotations

import io
import re
from typing import TYPE_CHECKING, Any

from aidsr.core.formatting import format_number
from aidsr.validation.signals import Signal

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_INK, _SOFT, _BAD, _SHEET = "#010101", "#020202", "#030303", "#040404"
_CURVES = ("#050501", "#050502", "#050503", "#050504", "#050505", "#050506")
_VARIABLES = {_INK: "--ink", _SOFT: "--soft", _BAD: "--bad", _SHEET: "--sheet"} | {
    colour: f"--curve-{number}" for number, colour in enumerate(_CURVES, 1)
}
"""Colours that stand for the page's own. Drawn as written, they would all be black."""

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "text.parse_math": False,  # names may hold a dollar sign
    "axes.unicode_minus": False,
    "font.size": 9.0,
    "font.family": "sans-serif",
    "text.color": _INK,
    "axes.labelcolor": _SOFT,
    "axes.edgecolor": _SOFT,
    "xtick.color": _SOFT,
    "ytick.color": _SOFT,
}
_FEW_POINTS = 20
"""Of a curve that shows each of them."""
_LARGEST_RATIO = 12.0
"""Limit / largest value beyond which the limit is named beside the plot instead of flattening the curve."""


def plotted(signal: Signal, key: str) -> str:
    """Return a signal as an <svg> element: curves, limits, and the first bad time.

    Args:
        signal: What to draw.
        key: Told apart from other drawings on the same page by this.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context({**_STYLE, "svg.hashsalt": key}):
        figure = Figure(figsize=(5.6, 2.9), layout="constrained")
        figure.patch.set_alpha(0.0)
        axes = figure.add_subplot()
        axes.patch.set_alpha(0.0)
        _draw(axes, signal)
        drawn = io.StringIO()
        figure.savefig(drawn, format="svg", metadata={"Date": None, "Creator": None})
    return _for_page(drawn.getvalue(), f"{signal.quantity} over time: {signal.test}")


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
    for line, colour in zip(signal.lines, _CURVES, strict=False):
        axes.plot(signal.time_s, line.values, marker=marker, ms=4, color=colour, lw=1.6, label=line.label)
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
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlim(0.0, 1.01 * signal.time_s[-1])
    if len(signal.lines) > 1:
        axes.legend(frameon=False, fontsize=8, ncols=2, loc="best", labelcolor=_INK)


def _draw_limit(axes: Axes, limit: float) -> None:
    axes.axhline(limit, color=_BAD, lw=1.1, ls=(0, (5, 3)))
    axes.annotate(
        f"limit {format_number(limit)}",
        xy=(1.0, limit),
        xycoords=("axes fraction", "data"),
        xytext=(-3, 3),
        textcoords="offset points",
        ha="right",
        color=_BAD,
        fontsize=8,
    )


def _draw_first_bad(axes: Axes, time_s: float, end_s: float) -> None:
    """A line at the time, named above the axes, where no curve is."""
    axes.axvline(time_s, color=_BAD, lw=1.1)
    axes.annotate(
        f"first bad at {format_number(time_s)} s",
        xy=(time_s, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(0, 3),
        textcoords="offset points",
        ha="left" if time_s < end_s / 2 else "right",
        color=_BAD,
        fontsize=8,
    )


def _fits(signal: Signal, limit: float) -> bool:
    """Whether a limit can be drawn without flattening the curves."""
    largest = max((abs(value) for line in signal.lines for value in line.values), default=0.0)
    return signal.logarithmic or abs(limit) <= _LARGEST_RATIO * max(largest, 1e-12)


def _for_page(text: str, title: str) -> str:
    """Return an SVG document as an element of a page: no prologue, the page's colours, fluid width."""
    from html import escape

    svg = text[text.index("<svg") :]
    for colour, variable in _VARIABLES.items():
        svg = svg.replace(colour, f"var({variable})")
    svg = re.sub(r'<svg ([^>]*?)height="[^"]*"([^>]*?)width="[^"]*"', r"<svg \1\2", svg, count=1)
    svg = re.sub(r"font: ([^;\"]*?)'sans-serif'[^;\"]*", r"font: \1 var(--face)", svg)
    return svg.replace("<svg ", f'<svg role="img" aria-label="{escape(title, quote=True)}" ', 1)
