"""Comparison of two iterations of a design, in words: what changed, and what became better or worse."""

from __future__ import annotations

import difflib
import itertools
from collections import Counter
from collections.abc import Iterator

from aidsr.core.artifacts import Artifact, Concept, Fault, Placement, ValidationReport
from aidsr.core.formatting import bound_in_words, format_coordinate, format_vector
from aidsr.runs.folders import DesignFolder, IterationFolder
from aidsr.runs.status import newest


class Attempted(Artifact):
    """State of a design at one iteration: the newest version of each file up to it."""

    number: int
    concept: Concept | None
    robot: str
    """MJCF of the robot, empty before one exists."""
    placement: Placement | None
    report: ValidationReport | None
    """Report on this iteration's scene, or on its robot where there is no report on a scene."""
    judged: bool | None
    """The Judge's verdict in this iteration."""


class Comparison(Artifact):
    """Differences between two iterations, one sentence each."""

    changed: tuple[str, ...]
    better: tuple[str, ...]
    worse: tuple[str, ...]


def attempted(design: DesignFolder, number: int) -> Attempted:
    """Return the state of a design at an iteration."""
    own = design.iteration(number)
    until = design.leading_to(number)
    robot = newest(it.robot.xml.read_text() for it in until)
    critique = own.critique.read()
    return Attempted(
        number=number,
        concept=newest(it.concept.read() for it in until),
        robot=robot or "",
        placement=newest(it.placement.read() for it in until),
        report=_report(own),
        judged=critique.passed if critique else None,
    )


def compare(before: Attempted, after: Attempted) -> Comparison:
    """Return what changed from `before` to `after`, and what became better or worse."""
    better, worse = _by_faults(before.report, after.report)
    if before.judged is False and after.judged:
        better.append("the Judge passes it now")
    if before.judged and after.judged is False:
        worse.append("the Judge no longer passes it")
    changed = (*_in_concept(before.concept, after.concept), *_in_robot(before, after))
    return Comparison(
        changed=(*changed, *_in_placement(before.placement, after.placement)),
        better=tuple(better),
        worse=tuple(worse),
    )


def _report(iteration: IterationFolder) -> ValidationReport | None:
    return iteration.scene_report.read() or iteration.robot_report.read()


def _in_concept(before: Concept | None, after: Concept | None) -> Iterator[str]:
    if before is None or after is None or before == after:
        return
    if before.name != after.name:
        yield f"concept: now “{after.name}”"
    numbers = {
        key: (before.parameters.get(key), after.parameters.get(key))
        for key in {**before.parameters, **after.parameters}
    }
    for key, (old, new) in numbers.items():
        if old != new:
            yield f"{key}: {_number(old)} → {_number(new)}"
    for field in ("morphology", "actuation", "functional_part"):
        if getattr(before, field) != getattr(after, field):
            yield f"the {field.replace('_', ' ')} was rewritten"


def _in_robot(before: Attempted, after: Attempted) -> Iterator[str]:
    if before.robot == after.robot:
        return
    diff = difflib.unified_diff(before.robot.splitlines(), after.robot.splitlines(), n=0, lineterm="")
    signs = Counter(line[0] for line in itertools.islice(diff, 2, None))  # the first two lines are file names
    added, removed = signs["+"], signs["-"]
    yield f"the robot's MJCF: {added} {'line' if added == 1 else 'lines'} added, {removed} removed"


def _in_placement(before: Placement | None, after: Placement | None) -> Iterator[str]:
    if before is None or after is None:
        return
    for field in ("mount", "base", "position_m", "rotation_deg", "scale", "functional_part"):
        old, new = getattr(before, field), getattr(after, field)
        if old != new:
            yield f"{field}: {_setting(old)} → {_setting(new)}"


def _by_faults(before: ValidationReport | None, after: ValidationReport | None) -> tuple[list[str], list[str]]:
    """Return what became better and what became worse, according to the errors in two reports."""
    if before is None or after is None:
        return [], []
    if before.stable and after.stable:
        return [], []
    old, new = Counter(fault.code for fault in before.errors), Counter(fault.code for fault in after.errors)
    better = ["it is stable now"] if after.stable else []
    worse = ["it is no longer stable"] if before.stable else []
    better += [f"{code} is gone ({_times(count)})" for code, count in old.items() if code not in new]
    worse += [f"{code} is new ({_times(count)})" for code, count in new.items() if code not in old]
    for code in (code for code in old if code in new):
        change = _change(_worst(before, code), _worst(after, code))
        if new[code] != old[code]:
            (better if new[code] < old[code] else worse).append(f"{code}: {old[code]} → {new[code]} places")
        elif change is not None:
            (better if change[0] else worse).append(f"{code}: {change[1]}")
    return better, worse


def _change(old: Fault | None, new: Fault | None) -> tuple[bool, str] | None:
    """Return whether a fault's measured value came closer to its limit, and a text with both values.

    None where a value is missing or the values are equal.
    """
    if old is None or new is None:
        return None
    values = (old.measured, new.measured, new.limit)
    if any(value is None for value in values) or old.measured == new.measured:
        return None
    was, now, limit = (float(value or 0.0) for value in values)
    text = f"{was:.3g} → {now:.3g} {new.unit}".rstrip() + f" ({bound_in_words(now, limit)} {limit:.3g})"
    return abs(now - limit) < abs(was - limit), text


def _worst(report: ValidationReport, code: str) -> Fault | None:
    measured = [fault for fault in report.errors if fault.code == code and fault.measured is not None]
    return max(measured, key=lambda fault: abs((fault.measured or 0.0) - (fault.limit or 0.0)), default=None)


def _times(count: int) -> str:
    return "1 place" if count == 1 else f"{count} places"


def _number(value: float | None) -> str:
    return "–" if value is None else format_coordinate(value)


def _setting(value: object) -> str:
    if isinstance(value, tuple):
        return format_vector(value)
    return format_coordinate(value) if isinstance(value, float) else str(value)
