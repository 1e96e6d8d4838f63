"""Common style of all plots: SVG with the colours of the surrounding page, or PNG with the same colours on white.

Drawing code does not set colours: each curve gets the next colour of `CURVES`, and text, axes and grid get theirs from
the style. Only marks of a limit or an error use `BAD`.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, SOFT, BAD, _LINE = "#010101", "#020202", "#030303", "#040404"
CURVES = tuple(f"#05050{number}" for number in range(1, 9))
"""Placeholders for the CSS variables of `base.html.j2`, which differ in dark mode; they are replaced in every plot."""

_WHITE_CURVES = ("#1f6f78", "#b5792a", "#6b5aa8", "#4c8a3f", "#a8567c", "#5f6b76", "#b3543f", "#3f6fb0")
_ON_WHITE = {INK: "#1d2326", SOFT: "#5c666b", BAD: "#b3392a", _LINE: "#dfe1dc"} | dict(
    zip(CURVES, _WHITE_CURVES, strict=True)
)
_OF_THE_PAGE = {INK: "var(--ink)", SOFT: "var(--soft)", BAD: "var(--bad)", _LINE: "var(--line)"} | {
    colour: f"var(--curve-{number})" for number, colour in enumerate(CURVES, 1)
}


def svg_plot(draw: Callable[[Axes], None], size: tuple[float, float], title: str, *, key: str = "") -> str:
    """Return a plot as an <svg> element for a page based on `base.html.j2`: with its colours and font, in fluid width.

    Args:
        draw: Function that draws into the axes.
        size: Width and height [inch]; the page keeps their ratio.
        title: Description of the plot for screen readers.
        key: Unique key of the plot within its page, so that the identifiers inside the SVGs differ.
    """
    drawn = io.StringIO()
    with _style({colour: colour for colour in _OF_THE_PAGE}, key):
        figure = _figure(size)
        draw(figure.add_subplot())
        figure.savefig(drawn, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    text = drawn.getvalue()
    svg = text[text.index("<svg") :]
    for colour, variable in _OF_THE_PAGE.items():
        svg = svg.replace(colour, variable)
    svg = re.sub(r'<svg ([^>]*?)height="[^"]*"([^>]*?)width="[^"]*"', r"<svg \1\2", svg, count=1)
    svg = re.sub(r"font: ([^;\"]*?)'sans-serif'[^;\"]*", r"font: \1 var(--face)", svg)
    return svg.replace("<svg ", f'<svg role="img" aria-label="{escape(title, quote=True)}" ', 1)


def png_plot(draw: Callable[[Figure], None], size: tuple[float, float]) -> bytes:
    """Return a plot as a PNG picture on white; `draw` creates the axes, `size` is the width and height [inch]."""
    drawn = io.BytesIO()
    with _style(_ON_WHITE):
        figure = _figure(size)
        draw(figure)
        figure.savefig(drawn, format="png", dpi=130)
    return drawn.getvalue()


def _figure(size: tuple[float, float]) -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=size, layout="constrained")


def _style(colours: dict[str, str], key: str = "") -> Any:
    """Return the context with the style settings in which a plot is drawn."""
    import matplotlib as mpl
    from cycler import cycler

    settings: dict[Any, Any] = {
        "svg.fonttype": "none",
        "svg.hashsalt": key or "aidsr",
        "text.parse_math": False,  # names may contain a dollar sign
        "axes.unicode_minus": False,
        "font.family": "sans-serif",
        "font.size": 9.0,
        "legend.fontsize": 8.0,
        "legend.frameon": False,
        "legend.labelcolor": colours[INK],
        "text.color": colours[INK],
        "axes.labelcolor": colours[SOFT],
        "axes.edgecolor": colours[SOFT],
        "xtick.color": colours[SOFT],
        "ytick.color": colours[SOFT],
        "grid.color": colours[_LINE],
        "grid.linewidth": 0.6,
        "axes.axisbelow": True,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.prop_cycle": cycler(color=[colours[each] for each in CURVES]),
        "lines.linewidth": 1.6,
    }
    return mpl.rc_context(settings)
