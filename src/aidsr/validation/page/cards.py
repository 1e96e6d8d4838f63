"""One card for each fault on the page: message, location, measured value and limit, plot and lines of the document."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Self

from aidsr.core.artifacts import Fault
from aidsr.core.formatting import format_number
from aidsr.validation.page.plots import plot_signal
from aidsr.validation.signals import Signal

_MOST_NAMES = 8
_AROUND = 2
"""Lines shown before and after the line of a fault."""
_WIDEST = 200
_GAUGE_DECADES = 1.5
"""Powers of ten that the gauge covers on each side of the limit."""


@dataclass(frozen=True)
class Card:
    """One fault, as the page shows it."""

    fault: Fault
    names: str
    gauge: float | None
    """Position of the measured value on a logarithmic scale of three powers of ten with the limit in the middle [%];
    None without a measured value or a limit."""
    times: str
    plot: str
    test: str
    lines: tuple[tuple[int, str, bool], ...]
    """Lines of the document around the fault: number, text, and whether the fault is in this line."""
    more: tuple[Fault, ...] = ()
    """Other faults with the same code that share this card; only for faults of the document."""

    @classmethod
    def of(cls, fault: Fault, signal: Signal | None, mjcf: str, key: str) -> Self:
        """Return the card of a fault; `key` identifies its plot on the page."""
        shown = fault.names[:_MOST_NAMES]
        more = f" and {len(fault.names) - len(shown)} more" if len(fault.names) > len(shown) else ""
        measured, limit = fault.measured, fault.limit
        ratio = measured / limit if measured is not None and limit and measured / limit > 0 else None
        return cls(
            fault=fault,
            names=", ".join(shown) + more,
            gauge=None if ratio is None else min(max(50 + 50 / _GAUGE_DECADES * math.log10(ratio), 1.5), 98.5),
            times="" if ratio is None else _times(ratio),
            plot="" if signal is None else plot_signal(signal, key),
            test="" if signal is None else signal.test,
            lines=() if fault.line is None else tuple(_excerpt(mjcf, fault.line)),
        )


def _times(ratio: float) -> str:
    """Return in words how far a value is from its limit, given value / limit."""
    if ratio >= 1:
        return f"{100 * (ratio - 1):.2g} % above the limit" if ratio < 2 else f"{_two_digits(ratio)} times the limit"
    if ratio > 0.5:
        return f"{100 * (1 - ratio):.2g} % below the limit"
    return f"the limit is {_two_digits(1 / ratio)} times as much"


def _two_digits(value: float) -> str:
    return format_number(float(f"{value:.2g}"))


def _excerpt(mjcf: str, line: int) -> list[tuple[int, str, bool]]:
    lines = mjcf.split("\n")  # XML counts only "\n"; str.splitlines splits at more characters
    first, last = max(1, line - _AROUND), min(len(lines), line + _AROUND)
    return [(number, _clipped(lines[number - 1]), number == line) for number in range(first, last + 1)]


def _clipped(line: str) -> str:
    return line if len(line) <= _WIDEST else line[:_WIDEST] + " …"


def cards(faults: Sequence[Fault], signals: Sequence[Signal | None], mjcf: str) -> Iterator[Card]:
    """Yield a card for each fault; faults of the layer "load" with the same code share one card."""
    same: dict[str, list[Fault]] = {}
    for fault in faults:
        if fault.layer == "load":
            same.setdefault(fault.code, []).append(fault)
    for index, (fault, signal) in enumerate(zip(faults, signals, strict=True)):
        alike = same.get(fault.code, [fault])
        if alike[0] is fault:
            yield replace(Card.of(fault, signal, mjcf, f"fault-{index}"), more=tuple(alike[1:]))
