"""Estimate of a run's remaining time, from the duration of designs of other runs with the same settings."""

from __future__ import annotations

import statistics
from collections import defaultdict
from collections.abc import Iterable, Mapping
from datetime import datetime

from aidsr.apps.web.site import DesignView, RunView

Key = tuple[str, str, bool, bool]
"""Settings that decide how long a design takes: model, team, whether it is tried on its task, and whether it is trained
for that."""


def usual_s(views: Iterable[RunView]) -> dict[Key, float]:
    """Return the median time of a finished design [s], for each combination of the settings that decide it.

    For a design that a person had refined, its time per round counts.
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
    """Return the remaining time of a run if its designs take as long as usual [s].

    None where no such design is known or one takes longer than usual. Designs that wait for a person are not counted.
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
    ]  # designs are worked on in parallel
    return max(lefts) if lefts and min(lefts) > 0 else None


def _key(view: RunView) -> Key:
    config = view.status.record.config
    return config.model, config.team, config.task_feedback, bool(config.task_training)


def _worked_s(design: DesignView, now: datetime) -> float:
    """Return how long a design has been worked on [s]: up to its last event, plus the time since then."""
    return design.status.latency_s + _since_s(design.since, now)


def _since_s(time: str, now: datetime) -> float:
    return (now - datetime.fromisoformat(time)).total_seconds() if time else 0.0
