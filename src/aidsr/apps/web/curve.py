"""The curve of a training as a small drawing; nothing in it but numbers of ours."""

from __future__ import annotations

from collections.abc import Sequence

from aidsr.runs.trainings import CurveRow

_WIDTH, _HEIGHT, _LEFT, _BOTTOM, _TOP = 640, 220, 44, 26, 10


def curve_svg(rows: Sequence[CurveRow], budget_steps: int) -> str:
    """Return success share and progress over the steps, both from 0 to 1."""
    most = max([budget_steps, *(row.steps for row in rows)], default=1) or 1

    def x(steps: float) -> float:
        return _LEFT + (_WIDTH - _LEFT - 8) * steps / most

    def y(share: float) -> float:
        return _TOP + (_HEIGHT - _TOP - _BOTTOM) * (1.0 - min(max(share, 0.0), 1.0))

    def line(name: str, kind: str) -> str:
        places = [(row.steps, getattr(row, name)) for row in rows if getattr(row, name) is not None]
        path = " ".join(f"{x(steps):.1f},{y(share):.1f}" for steps, share in places)
        if not places:
            return ""
        steps, share = places[-1]
        dot = f'<circle class="dot {kind}" cx="{x(steps):.1f}" cy="{y(share):.1f}" r="3.5"/>'
        return f'<polyline class="line {kind}" points="{path}"/>{dot}'

    grid = "".join(
        f'<line class="axis" x1="{_LEFT}" x2="{_WIDTH - 8}" y1="{y(share):.1f}" y2="{y(share):.1f}"/>'
        f'<text x="{_LEFT - 8}" y="{y(share) + 4:.1f}" text-anchor="end">{share:.0%}</text>'
        for share in (0.0, 0.5, 1.0)
    )
    ticks = "".join(
        f'<text x="{x(most * part):.1f}" y="{_HEIGHT - 6}" text-anchor="{anchor}">{_short(most * part)}</text>'
        for part, anchor in ((0.0, "start"), (0.5, "middle"), (1.0, "end"))
    )
    drawn = line("progress", "two") + line("success_share", "")
    return (
        f'<svg class="curve" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="success and progress over steps">'
        f"{grid}{ticks}{drawn}</svg>"
    )


def _short(steps: float) -> str:
    return f"{steps / 1e6:.3g} M" if steps >= 1e6 else f"{steps / 1e3:.3g} k" if steps >= 1e3 else f"{steps:.0f}"
