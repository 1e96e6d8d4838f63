"""Numbers and faults in words, the same wherever a person or a model reads them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from aidsr.core.artifacts import Fault, PlausibilityCheck


def written(value: float) -> str:
    """Return a number as engineers write it: 10,000 and 12,345, 0.0032, 1.2e-5; three digits, whole numbers whole."""
    if float(value).is_integer() and abs(value) < 1e6:
        return f"{value:,.0f}"
    rounded = float(f"{value:.3g}")
    if 1e-4 <= abs(rounded) < 1e6:
        digits = max(0, 2 - math.floor(math.log10(abs(rounded))))
        text = f"{rounded:,.{digits}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    mantissa, _, exponent = f"{value:.3g}".partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def finding(fault: Fault) -> str:
    """Return what was found and what is allowed: "sags: 0.41 of the robot's length, 123 mm (at most 0.35, 105 mm)"."""
    if fault.measured is None:
        return fault.message
    amount = f"{written(fault.measured)} {fault.unit}".rstrip() + absolute(fault, fault.measured)
    return f"{fault.message}: {amount}" + (f" ({allowed(fault)})" if fault.limit is not None else "")


def allowed(fault: Fault) -> str:
    """Return what a measured fault violates, "at most 0.35, 105 mm"; "" where no limit is known."""
    if fault.measured is None or fault.limit is None:
        return ""
    return f"{bound(fault.measured, fault.limit)} {written(fault.limit)}{absolute(fault, fault.limit)}"


def bound(measured: float, limit: float) -> str:
    """Return whether a limit that a value violates is the most or the least that is allowed."""
    return "at least" if measured < limit else "at most"


def compared(check: PlausibilityCheck) -> str:
    """Return what was measured and what is asked for: "0.82 (at least 0.5)"; "not measured" where nothing was."""
    if check.measured is None:
        return "not measured"
    return f"{f'{written(check.measured)} {check.unit}'.rstrip()} ({check.bound} {written(check.limit)})"


def absolute(fault: Fault, relative: float) -> str:
    """Return a value of a fault in SI units behind a comma where its unit is relative; short lengths in millimetres."""
    if fault.whole is None:
        return ""
    value, unit = relative * fault.whole, fault.whole_unit
    if unit == "m" and abs(value) < 1:
        value, unit = 1000 * value, "mm"
    return f", {written(value)} {unit}"


def account_of(faults: Sequence[Fault], max_bytes: int) -> str:
    """Return faults as plain text, one line per code; see `aidsr.core.artifacts.ValidationReport.account`.

    Args:
        faults: Errors first.
        max_bytes: Bound on the text in UTF-8, at least 200.
    """
    if not faults:
        return "stable: no faults found"
    groups: dict[tuple[bool, str], list[Fault]] = {}
    for fault in faults:
        groups.setdefault((fault.severity == "warning", fault.code), []).append(fault)
    lines = [_account_line(group) for group in groups.values()]
    codes = [code for _, code in groups]
    for kept in range(len(lines), 0, -1):
        left_out = [f"{len(lines) - kept} more: {', '.join(codes[kept:])}"] if kept < len(lines) else []
        text = "\n".join([*lines[:kept], *left_out])
        if len(text.encode()) <= max_bytes:
            return text
    rest = f" …\n{len(lines) - 1} more" if len(lines) > 1 else " …"
    return lines[0].encode()[: max_bytes - len(rest.encode())].decode(errors="ignore") + rest


def _account_line(faults: list[Fault]) -> str:
    """Return faults of one code as one line: where, what, how much, likely cause, cure."""
    fault = faults[0]
    names = list(dict.fromkeys(name for each in faults for name in each.names))
    shown = ", ".join(names) if len(names) <= 4 else f"{', '.join(names[:3])} … {names[-1]} ({len(names)} in all)"
    line = "warning " * (fault.severity == "warning") + fault.code + (f" at {shown}" if shown else "")
    line += (f" (line {fault.line})" if fault.line is not None else "") + f": {finding(fault)}"
    if len(faults) > 1:
        line += f", and {len(faults) - 1} more like it"
    sentences = [line, f"Likely cause: {fault.likely_cause}" if fault.likely_cause else "", fault.cure]
    return " ".join(sentence.rstrip(".") + "." for sentence in sentences if sentence)
