"""Text format of numbers, amounts and faults, the same for all texts that users and language models read.

`format_number` is the standard format. The other number formats are used in prompts and in the notes of built-in
designs. Do not change them: these texts are part of experiments, and a changed digit changes the experiment.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from aidsr.core.artifacts import Fault, PlausibilityCheck
    from aidsr.core.calls import Usage

_NUMERALS = ("no", "one", "two", "three", "four", "five", "six")


def format_number(value: float) -> str:
    """Return a number with three significant digits, whole numbers below 1e6 in full: 12,345, 0.0032, 1.2e-5."""
    if float(value).is_integer() and abs(value) < 1e6:
        return f"{value:,.0f}"
    rounded = float(f"{value:.3g}")
    if 1e-4 <= abs(rounded) < 1e6:
        digits = max(0, 2 - math.floor(math.log10(abs(rounded))))
        text = f"{rounded:,.{digits}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    mantissa, _, exponent = f"{value:.3g}".partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def format_coordinate(value: float) -> str:
    """Return a length or angle with four decimals, values below 0.001 with four significant digits; never "-0".

    Used for environments in prompts: coordinates of any size need the same number of decimals, whereas `format_number`
    uses a fixed number of significant digits.
    """
    if abs(value) < 0.001:
        return f"{value if abs(value) > 1e-9 else 0.0:.4g}"
    return f"{round(value, 4):.6g}"


def format_vector(values: Iterable[float]) -> str:
    """Return coordinates separated by spaces, as in MJCF."""
    return " ".join(format_coordinate(value) for value in values)


def format_direction(axis: Iterable[float]) -> str:
    """Return a unit vector with four decimals, separated by spaces."""
    return " ".join(f"{round(float(value), 4) + 0.0:g}" for value in axis)  # + 0.0 turns -0.0 into 0.0


def excerpt(text: str, most: int = 60) -> str:
    """Return a text shortened for quoting in a sentence: at most the first `most` characters, then "…"."""
    return text if len(text) <= most else f"{text[:most]}…"


def counted(number: int, of: str) -> str:
    """Return a number with its noun in the right form: "1 task", "3 tasks", "2 policies", "0 fixes"."""
    if number == 1:
        return f"1 {of}"
    if of.endswith("y"):
        return f"{number} {of.removesuffix('y')}ies"
    return f"{number} {of}{'es' if of.endswith(('s', 'x', 'ch', 'sh')) else 's'}"


def task_title(name: str) -> str:
    """Return the name of a task as a title, without its group: "button pushing" for "reaching/button_pushing"."""
    return name.rpartition("/")[2].replace("_", " ")


def iso_time(time_s: float) -> str:
    """Return a time [s since 1970] in ISO 8601, in UTC and without fractions of a second."""
    return datetime.fromtimestamp(time_s, UTC).isoformat(timespec="seconds")


def mm(length_m: float) -> str:
    """Return a length [m] of a built-in design as "376 mm", below 20 mm with one decimal."""
    length_mm = 1000.0 * length_m
    return f"{length_mm:.0f} mm" if length_mm >= 20 else f"{length_mm:.1f} mm"


def deg(angle_rad: float) -> str:
    """Return an angle [rad] of a built-in design as "132 deg"."""
    return f"{math.degrees(angle_rad):.0f} deg"


def numeral(number: int) -> str:
    """Return a number of parts of a built-in design as a word up to six, as digits above."""
    return _NUMERALS[number] if number < len(_NUMERALS) else str(number)


def format_cost(usage: Usage) -> str:
    """Return the cost in dollars; "unknown" if a price is unknown."""
    if usage.calls == 0:
        return "$0"
    return "unknown" if usage.cost_usd is None else f"${usage.cost_usd:.4f}"


def format_tokens(usage: Usage) -> str:
    """Return the input and output tokens, and whether they are estimated."""
    if usage.calls == 0:
        return "none"
    amounts = f"{usage.input_tokens:,} in, {usage.output_tokens:,} out"
    return f"{amounts}, estimated" if usage.tokens_estimated else amounts


def format_tokens_in_thousands(usage: Usage) -> str:
    """Return the input and output tokens in short form: "12 k" from 10,000 tokens on."""
    counts = (usage.input_tokens, usage.output_tokens)
    tokens_in, tokens_out = (str(count) if count < 10_000 else f"{count / 1000:.0f} k" for count in counts)
    return f"{tokens_in} in, {tokens_out} out" if usage.calls else "none"


def format_duration(seconds: float) -> str:
    """Return a duration as "59.4 s", "1 min 0 s" or "1 h 2 min"."""
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"


def format_time_left(steps: float, per_s: float) -> str:
    """Return about how long the remaining steps take, as text; "–" if the speed is unknown.

    Args:
        steps: Remaining steps; the work may end earlier.
        per_s: Recent speed [steps/s].
    """
    return f"about {format_duration(max(steps, 0.0) / per_s)} left" if per_s > 0 else "–"


def format_share(share: float) -> str:
    """Return a share as "62 %"."""
    return f"{100 * share:.0f} %"


def format_repairs(counts: Mapping[str, int]) -> str:
    """Return the number of automatic fixes and their kinds."""
    return f"{counted(sum(counts.values()), 'automatic fix')}: {', '.join(counts)}"


def format_fault(fault: Fault) -> str:
    """Return a fault with its value and limit: "sags: 0.41 of the robot's length, 123 mm (at most 0.35, 105 mm)"."""
    if fault.measured is None:
        return fault.message
    amount = f"{format_number(fault.measured)} {fault.unit}".rstrip() + format_absolute(fault, fault.measured)
    return f"{fault.message}: {amount}" + (f" ({format_limit(fault)})" if fault.limit is not None else "")


def format_limit(fault: Fault) -> str:
    """Return the limit that a measured fault violates, "at most 0.35, 105 mm"; "" if there is no limit."""
    if fault.measured is None or fault.limit is None:
        return ""
    bound = bound_in_words(fault.measured, fault.limit)
    return f"{bound} {format_number(fault.limit)}{format_absolute(fault, fault.limit)}"


def bound_in_words(measured: float, limit: float) -> str:
    """Return whether a violated limit is a lower bound ("at least") or an upper bound ("at most")."""
    return "at least" if measured < limit else "at most"


def format_check(check: PlausibilityCheck) -> str:
    """Return the measured value and the limit of a check: "0.82 (at least 0.5)"; "not measured" without a value."""
    if check.measured is None:
        return "not measured"
    return f"{f'{format_number(check.measured)} {check.unit}'.rstrip()} ({check.bound} {format_number(check.limit)})"


def format_absolute(fault: Fault, relative: float) -> str:
    """Return ", " and a relative value of a fault in SI units, lengths below 1 m in mm; "" if it is not relative."""
    if fault.whole is None:
        return ""
    value, unit = relative * fault.whole, fault.whole_unit
    if unit == "m" and abs(value) < 1:
        value, unit = 1000 * value, "mm"
    return f", {format_number(value)} {unit}"


def format_faults(faults: Sequence[Fault], max_bytes: int) -> str:
    """Return faults as plain text, one line per code; see `aidsr.core.artifacts.ValidationReport.account`.

    Args:
        faults: Faults to format, errors first.
        max_bytes: Maximum length of the text in UTF-8 [bytes], at least 200.
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
    """Return faults with the same code as one line: names, message, value, likely cause, cure."""
    fault = faults[0]
    names = list(dict.fromkeys(name for each in faults for name in each.names))
    shown = ", ".join(names) if len(names) <= 4 else f"{', '.join(names[:3])} … {names[-1]} ({len(names)} in all)"
    line = "warning " * (fault.severity == "warning") + fault.code + (f" at {shown}" if shown else "")
    line += (f" (line {fault.line})" if fault.line is not None else "") + f": {format_fault(fault)}"
    if len(faults) > 1:
        line += f", and {len(faults) - 1} more like it"
    sentences = [line, f"Likely cause: {fault.likely_cause}" if fault.likely_cause else "", fault.cure]
    return " ".join(sentence.rstrip(".") + "." for sentence in sentences if sentence)


def format_cell(text: str) -> str:
    """Return text as a cell of a Markdown table: on one line, with all Markdown markup and cell separators escaped."""
    return re.sub(r"([\\`*\[\]<>|])", r"\\\1", " ".join(text.split()))


def rounded_vector(values: Iterable[float]) -> tuple[float, float, float]:
    """Return a vector with six decimals and without -0.0."""
    x, y, z = (round(float(value), 6) + 0.0 for value in values)  # + 0.0 turns -0.0 into 0.0
    return x, y, z
