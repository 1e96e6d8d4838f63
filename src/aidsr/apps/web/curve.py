"""Learning curves and scatter plots as small SVG drawings, which contain only numbers and escaped names."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from aidsr.core.formatting import format_share
from aidsr.runs.trainings import CurveRow

_WIDTH, _HEIGHT, _LEFT, _BOTTOM, _TOP = 640, 220, 44, 26, 10


def curve_svg(rows: Sequence[CurveRow], budget_steps: int) -> str:
    """Return a drawing of success share and progress, both from 0 to 1, over the steps."""
    most = max([budget_steps, *(row.steps for row in rows)], default=1) or 1

    def line(name: str, kind: str) -> str:
        places = [(row.steps, getattr(row, name)) for row in rows if getattr(row, name) is not None]
        path = " ".join(f"{_across(steps, most):.1f},{_up(share):.1f}" for steps, share in places)
        if not places:
            return ""
        steps, share = places[-1]
        dot = f'<circle class="dot {kind}" cx="{_across(steps, most):.1f}" cy="{_up(share):.1f}" r="3.5"/>'
        return f'<polyline class="line {kind}" points="{path}"/>{dot}'

    return _framed("success and progress over steps", most, line("progress", "two") + line("success_share", ""))


CURVE_COLOURS = ("#1c87a6", "#d9822b", "#7a5cc2", "#2f9e5f")
"""Colours of the curves of several designs, the same as in the timeline."""


def curves_svg(curves: Sequence[tuple[str, Sequence[CurveRow]]]) -> str:
    """Return a drawing of the success share of several trainings over their steps, one line each."""
    most = max((row.steps for _, rows in curves for row in rows), default=1) or 1
    drawn = []
    for (_, rows), colour in zip(curves, CURVE_COLOURS, strict=False):
        known = [(row.steps, row.success_share) for row in rows if row.success_share is not None]
        path = " ".join(f"{_across(steps, most):.1f},{_up(share):.1f}" for steps, share in known)
        drawn.append(f'<polyline class="line" style="stroke: {colour}" points="{path}"/>')
    return _framed("success over steps", most, "".join(drawn))


def scatter_svg(points: Sequence[tuple[float, float, str]], against: str) -> str:
    """Return a scatter plot of (amount, share, name), with names as tooltips; `against` is the name of the amount."""
    most = max((amount for amount, _, _ in points), default=1) or 1
    drawn = "".join(
        f'<circle class="dot" cx="{_across(amount, most):.1f}" cy="{_up(share):.1f}" r="4.5">'
        f"<title>{escape(name)}: {format_share(share)}, {escape(against)}: {_short(amount)}</title></circle>"
        for amount, share, name in points
    )
    return _framed(f"held-out success against {against}", most, drawn)


def _across(amount: float, most: float) -> float:
    return _LEFT + (_WIDTH - _LEFT - 8) * amount / most


def _up(share: float) -> float:
    return _TOP + (_HEIGHT - _TOP - _BOTTOM) * (1.0 - min(max(share, 0.0), 1.0))


def _framed(name: str, most: float, drawn: str) -> str:
    """Return a drawing between axes from 0 to 100 % and from 0 to `most`."""
    grid = "".join(
        f'<line class="axis" x1="{_LEFT}" x2="{_WIDTH - 8}" y1="{_up(share):.1f}" y2="{_up(share):.1f}"/>'
        f'<text x="{_LEFT - 8}" y="{_up(share) + 4:.1f}" text-anchor="end">{format_share(share)}</text>'
        for share in (0.0, 0.5, 1.0)
    )
    ticks = "".join(
        f'<text x="{_across(tick, most):.1f}" y="{_HEIGHT - 6}" '
        f'text-anchor="{"start" if not tick else "end" if tick > 0.96 * most else "middle"}">{_short(tick)}</text>'
        for tick in round_ticks(most)
    )
    return (
        f'<svg class="curve" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{name}">{grid}{ticks}{drawn}</svg>'
    )


def round_ticks(most: float) -> tuple[float, ...]:
    """Return three to six round amounts from 0 up to `most`: multiples of 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(most))
    step = next(step for step in (power / 5, power / 2, power, 2 * power) if 5 * step * (1 + 1e-9) >= most)
    return tuple(step * count for count in range(int(most / step * (1 + 1e-9)) + 1))


def _short(steps: float) -> str:
    return f"{steps / 1e6:.3g} M" if steps >= 1e6 else f"{steps / 1e3:.3g} k" if steps >= 1e3 else f"{steps:.3g}"
