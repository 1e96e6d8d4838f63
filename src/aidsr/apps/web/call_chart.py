"""Calls of language models on a time axis: the calls of each role, and the cumulative tokens and cost."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from html import escape

from aidsr.core.calls import CallRecord
from aidsr.core.formatting import format_duration

_WIDTH, _LEFT, _RIGHT = 640, 76, 56
_TOP, _CURVES, _LANE, _AXIS = 20, 84, 20, 22
_LONGEST_GAP_S = 600.0
"""Longer pauses, as in a run that was resumed the next day, are shortened to this. Our choice."""


@dataclass(frozen=True)
class ChartedCall:
    """A call, its description in words, and the address of its full text."""

    record: CallRecord
    says: str
    address: str


def call_chart_svg(calls: Sequence[ChartedCall]) -> str:
    """Return an SVG drawing of calls; empty where there are none.

    The upper part shows the cumulative tokens and, where prices are known, the cumulative cost. Below is a lane for
    each role, in which each call, from prompt to reply, is a bar with a link.
    """
    spans = _spans(calls)
    if not spans:
        return ""
    ordered, _, ends = zip(*spans, strict=True)
    whole_s = max(ends) or 1.0
    roles = list(dict.fromkeys(call.record.question.role for call in ordered))
    floor = _TOP + _CURVES
    height = floor + 10 + _LANE * len(roles) + _AXIS

    def across(time_s: float) -> float:
        return _LEFT + (_WIDTH - _LEFT - _RIGHT) * time_s / whole_s

    replies = sorted(zip(ends, (call.record.usage for call in ordered), strict=True), key=lambda each: each[0])
    tokens = [(end, usage.input_tokens + usage.output_tokens) for end, usage in replies]
    money = [(end, usage.cost_usd or 0.0) for end, usage in replies]
    drawn = _axis(whole_s, across, floor, height)
    drawn += _curve("", [(across(end), value) for end, value in tokens], "tokens", _in_thousands, left=True)
    if any(cost for _, cost in money):
        drawn += _curve("two", [(across(end), cost) for end, cost in money], "cost", _in_dollars, left=False)
    for row, role in enumerate(roles):
        top = floor + 10 + _LANE * row
        drawn += f'<text x="{_LEFT - 8}" y="{top + 14}" text-anchor="end">{escape(role)}</text>'
        for call, begin, end in spans:
            if call.record.question.role == role:
                drawn += _bar(call, across(begin), across(end), top)
    name = "calls over time, with total tokens and spending"
    return f'<svg class="curve calls" viewBox="0 0 {_WIDTH} {height}" role="group" aria-label="{name}">{drawn}</svg>'


def _spans(calls: Sequence[ChartedCall]) -> list[tuple[ChartedCall, float, float]]:
    """Return the calls in order, each with its start and end since the first call, long pauses shortened [s]."""
    known = []
    for call in calls:
        try:
            known.append((datetime.fromisoformat(call.record.started).timestamp(), call))
        except ValueError:  # a file written by hand may have no valid time
            continue
    known.sort(key=lambda each: each[0])
    spans: list[tuple[ChartedCall, float, float]] = []
    at, quiet_from = 0.0, 0.0
    for index, (begun, call) in enumerate(known):
        if index:
            way = begun - known[index - 1][0]
            silence = max(0.0, at + way - quiet_from)
            at += way - max(0.0, silence - _LONGEST_GAP_S)
        end = at + call.record.usage.latency_s
        quiet_from = max(quiet_from, end)
        spans.append((call, at, end))
    return spans


def _bar(call: ChartedCall, begin: float, end: float, top: float) -> str:
    kind = "" if call.record.finish == "stop" else " bad"
    return (
        f'<a href="{escape(call.address, quote=True)}" aria-label="{escape(call.says, quote=True)}">'
        f'<rect class="call{kind}" x="{begin:.1f}" y="{top + 3}" width="{max(end - begin, 3):.1f}" '
        f'height="{_LANE - 6}" rx="2"><title>{escape(call.says)}</title></rect></a>'
    )


def _curve(
    kind: str, steps: Sequence[tuple[float, float]], name: str, words: Callable[[float], str], *, left: bool
) -> str:
    """Return a cumulative sum as a line that steps up at each reply, with its name and its final value."""
    total = sum(amount for _, amount in steps) or 1.0
    floor, path, risen = _TOP + _CURVES, [(float(_LEFT), float(_TOP + _CURVES))], 0.0
    for x, amount in steps:
        path.append((x, path[-1][1]))
        risen += amount
        path.append((x, floor - _CURVES * risen / total))
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in path)
    x, anchor = (_LEFT - 8, "end") if left else (_WIDTH - _RIGHT + 8, "start")
    return (
        f'<polyline class="line {kind}" points="{points}"/>'
        f'<text class="of {kind}" x="{x}" y="{_TOP + 4}" text-anchor="{anchor}">{words(total)}</text>'
        f'<text class="of {kind}" x="{x}" y="{_TOP + 20}" text-anchor="{anchor}">{name}</text>'
    )


def _axis(whole_s: float, across: Callable[[float], float], floor: float, height: float) -> str:
    ticks = "".join(
        f'<text x="{across(whole_s * part):.1f}" y="{height - 5}" text-anchor="{anchor}">'
        f"{format_duration(whole_s * part) if part else '0'}</text>"
        for part, anchor in ((0.0, "start"), (0.5, "middle"), (1.0, "end"))
    )
    return f'<line class="axis" x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{floor}" y2="{floor}"/>{ticks}'


def _in_thousands(tokens: float) -> str:
    return f"{tokens / 1000:.3g} k" if tokens >= 1000 else f"{tokens:.0f}"


def _in_dollars(money: float) -> str:
    return f"${money:.2f}" if money >= 0.01 else f"${money:.4f}"
