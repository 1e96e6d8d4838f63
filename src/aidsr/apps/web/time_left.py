"""How long a run at work will about take: from how long designs of other runs took with the same settings."""

from __future__ import annotations

import statistics
from collections import defaultdict
from collections.abc import Iterable, Mapping
from datetime import datetime

from aidsr.apps.web.site import DesignView, RunView

Key = tuple[str, str, bool, bool]
"""What decides how long a design takes: model, team, whether it is tried on its task, and trained for that."""


def usual_s(views: Iterable[RunView]) -> dict[Key, float]:
    """Return the median time of a finished design [s], for each of the settings that decide it.

    A design that a person had refined counts as one for each round.
    """
    took: dict[Key, list[float]] = defaultdict(list)
    for view in views:
        took[_key(view)] += [
            design.status.latency_s / design.status.round
            for design in view.designs
            if design.status.outcome is not None
        ]
    return {key: statistics.median(times) for key, times in took.items() if times}


def left_s(view: RunView, usual: Mapping[Key, float], now: datetime) -> float | None:
    """Return how long a run will take if its designs take as long as usual [s].

    None where nothing is known of such designs or one takes longer than usual. What waits for a person is not counted.
    """
    whole_s = usual.get(_key(view))
    if whole_s is None:
        return None
    if not view.designs:
        left = whole_s - _since_s(view.since, now)
        return left if left > 0 else None
    lefts = [
        whole_s * design.status.round - _worked_s(design, now)
        for design in view.designs
        if design.status.state == "running"
    ]  # designs are worked on side by side
    return max(lefts) if lefts and min(lefts) > 0 else None


def _key(view: RunView) -> Key:
    config = view.status.record.config
    return config.model, config.team, config.task_feedback, bool(config.task_training)


def _worked_s(design: DesignView, now: datetime) -> float:
    """Return how long a design has been worked on: up to its last event, and since then."""
    return design.status.latency_s + _since_s(design.since, now)


def _since_s(time: str, now: datetime) -> float:
    return (now - datetime.fromisoformat(time)).total_seconds() if time else 0.0
