"""Early stopping: the same role was asked to fix the same problems, and they have not improved."""

from __future__ import annotations

from collections.abc import Sequence

from aidsr.core.artifacts import Critique, Fault, ValidationReport
from aidsr.core.roles import Feedback
from aidsr.loop.routing import Change

_LEAST_IMPROVEMENT = 0.05
"""Share of its distance to the limit by which a fault must improve to count as better. Our choice: eight iterations
with less improvement would leave two thirds of the distance."""


def never_stop(changes: Sequence[Change]) -> int | None:
    """Return None: never stop before the iterations are used up, as in the paper's method."""
    del changes
    return None


def no_progress(changes: Sequence[Change]) -> int | None:
    """Return how many changes ago the same roles got the same problems, which have not improved since.

    Problems are the same when the faults have the same codes and places, or the Judge's words are the same. Faults that
    moved at least a twentieth of their distance to the limit are not the same. A role that has not been asked yet gets
    one attempt, so a problem that the Scene Integrator could not solve still goes to the Coder.

    Args:
        changes: Change requested after each iteration of the round, in order.

    Returns:
        1 for the change before the latest one, and so on; None if there is no such change.
    """
    newest = changes[-1]
    for ago, before in enumerate(reversed(changes[:-1]), 1):
        if not _no_better(before, newest):
            return None
        if _roles(before) == _roles(newest):
            return ago
    return None


def _roles(change: Change) -> tuple[bool, ...]:
    """Return which roles a change goes to: Designer, Coder, Scene Integrator."""
    return bool(change.concept), change.robot is not None, change.placement is not None


def _no_better(before: Change, now: Change) -> bool:
    """Return whether two iterations found the same problems and none of them improved."""
    first, second = _problems(before), _problems(now)
    if first.keys() != second.keys():
        return False
    return all(second[place] > (1 - _LEAST_IMPROVEMENT) * first[place] or not first[place] for place in first)


def _problems(change: Change) -> dict[tuple[str, ...], float]:
    """Return all problems by code and place, each with its distance to the limit, 0 if unknown."""
    found: dict[tuple[str, ...], float] = {("concept", change.concept): 0.0} if change.concept else {}
    for feedback in (change.robot, change.placement):
        for place, distance in _of(feedback):
            found[place] = found.get(place, 0.0) + distance
    return found


def _of(feedback: Feedback | None) -> list[tuple[tuple[str, ...], float]]:
    match feedback:
        case ValidationReport():
            return [((fault.code, *fault.names), _distance(fault)) for fault in feedback.errors]
        case Critique():
            return [((issue.blame, issue.component, issue.problem), 0.0) for issue in feedback.issues]
        case _:
            return []


def _distance(fault: Fault) -> float:
    if fault.measured is None or fault.limit is None:
        return 0.0
    return abs(fault.measured - fault.limit)
