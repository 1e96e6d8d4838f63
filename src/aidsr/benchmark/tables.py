"""The figures of a study, computed from its raw rows: per task, per arm, and what broke."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from statistics import fmean

from aidsr.artifacts import Artifact
from aidsr.benchmark.outcomes import DesignRow
from aidsr.benchmark.statistics import Interval, Rate, bootstrap_mean, paired_difference

__all__ = [
    "PAPER",
    "ArmLine",
    "Difference",
    "Line",
    "PaperFigures",
    "arm_lines",
    "differences",
    "line_of",
    "task_lines",
]


class PaperFigures(Artifact):
    """Published figures, for orientation only: the paper's tasks are not public, so the work is not the same."""

    source: str
    valid: float
    successful: float
    successful_by_table: float
    tokens: int
    cost_usd: float
    latency_s: float


PAPER = PaperFigures(
    source='AID-SR, "Bridging Language and Physics", with GPT-5; its tasks are not public',
    valid=0.962,
    successful=0.267,
    successful_by_table=0.276,
    tokens=151_000,
    cost_usd=0.73,
    latency_s=523.0,
)


class Line(Artifact):
    """Designs of one task, or of all, in one arm."""

    task: str
    attempted: int
    """Designs that the plan asks for: the denominator of every rate."""
    ended: int
    """Those that came to an end; the figures a design are their means."""
    approved: int
    stable: int
    valid: int
    successful: int
    episodes_share: float | None
    """Mean share of held-out episodes that succeeded, an untrained design counting as 0; None of nothing."""
    probe_progress: float | None
    tokens: float
    """A design, in and out together."""
    tokens_estimated: bool
    cost_usd: float | None
    """A design; None where a price is unknown."""
    latency_s: float
    iterations: float
    steps: float
    training_s: float

    def rate(self, of: str) -> Rate:
        """Return one of its counts as a rate of what was attempted."""
        return Rate(int(getattr(self, of)), self.attempted)


class ArmLine(Artifact):
    """An arm over all tasks: every task counts the same."""

    arm: str
    model: str
    line: Line
    success_low: float
    success_high: float
    """Of the mean share of episodes, by a bootstrap over designs within tasks and episodes within designs."""


class Difference(Artifact):
    """How much better one arm is than another on the designs both attempted, and whether that is more than noise."""

    what: str
    arm: str
    against: str
    value: float
    low: float
    high: float

    @property
    def real(self) -> bool:
        """Whether the interval excludes zero."""
        return Interval(self.value, self.low, self.high).excludes_zero


def line_of(task: str, rows: Sequence[DesignRow]) -> Line:
    """Return the figures of some designs."""
    ended = [row for row in rows if row.outcome != "unfinished"]
    usages = [row.usage for row in ended]
    costs = [usage.cost_usd for usage in usages]
    probed = [row.probe_progress for row in rows if row.probe_progress is not None]
    shares = [fmean(row.episodes) if row.episodes else 0.0 for row in rows]
    return Line(
        task=task,
        attempted=len(rows),
        ended=len(ended),
        approved=sum(row.outcome == "approved" for row in rows),
        stable=sum(row.stable for row in rows),
        valid=sum(row.valid for row in rows),
        successful=sum(row.successful for row in rows),
        episodes_share=_mean(shares),
        probe_progress=_mean(probed),
        tokens=_mean([usage.input_tokens + usage.output_tokens for usage in usages]) or 0.0,
        tokens_estimated=any(usage.tokens_estimated for usage in usages),
        cost_usd=None if None in costs else _mean([cost for cost in costs if cost is not None]) or 0.0,
        latency_s=_mean([row.latency_s for row in ended]) or 0.0,
        iterations=_mean([row.iterations for row in ended]) or 0.0,
        steps=_mean([row.steps for row in rows if row.evaluations]) or 0.0,
        training_s=_mean([row.training_s for row in rows if row.evaluations]) or 0.0,
    )


def task_lines(rows: Sequence[DesignRow], arm: str) -> tuple[Line, ...]:
    """Return one line a task, in the order in which tasks come."""
    own = [row for row in rows if row.arm == arm]
    return tuple(line_of(task, [row for row in own if row.task == task]) for task in dict.fromkeys(r.task for r in own))


def arm_lines(rows: Sequence[DesignRow], models: Mapping[str, str]) -> tuple[ArmLine, ...]:
    """Return one line an arm.

    Args:
        rows: Of the study.
        models: The model of each arm.
    """
    found = []
    for arm, model in models.items():
        own = [row for row in rows if row.arm == arm]
        if own:
            tasks = dict.fromkeys(row.task for row in own)
            interval = bootstrap_mean({task: [row.episodes for row in own if row.task == task] for task in tasks})
            found.append(
                ArmLine(
                    arm=arm,
                    model=model,
                    line=line_of("all tasks", own),
                    success_low=interval.low,
                    success_high=interval.high,
                )
            )
    return tuple(found)


def differences(rows: Sequence[DesignRow], against: str) -> tuple[Difference, ...]:
    """Return by how much each other arm differs from one, in stable, valid and successful designs and in tokens."""
    return tuple(
        found
        for arm in dict.fromkeys(row.arm for row in rows)
        if arm != against
        for what in _COMPARED
        if (found := _difference(rows, what, arm, against))
    )


_COMPARED: dict[str, Callable[[DesignRow], float]] = {
    "stable": lambda row: float(row.stable),
    "valid": lambda row: float(row.valid),
    "successful": lambda row: float(row.successful),
    "episodes": lambda row: fmean(row.episodes) if row.episodes else 0.0,
    "tokens": lambda row: float(row.usage.input_tokens + row.usage.output_tokens),
}


def _difference(rows: Sequence[DesignRow], what: str, arm: str, against: str) -> Difference | None:
    one, other = (_by_task(rows, name, _COMPARED[what]) for name in (against, arm))
    interval = paired_difference(one, other)
    if interval is None:
        return None
    return Difference(what=what, arm=arm, against=against, value=interval.value, low=interval.low, high=interval.high)


def _by_task(
    rows: Sequence[DesignRow], arm: str, value: Callable[[DesignRow], float]
) -> dict[str, dict[tuple[int, int], float]]:
    found: dict[str, dict[tuple[int, int], float]] = {}
    for row in rows:
        if row.arm == arm:
            found.setdefault(row.task, {})[row.key] = value(row)
    return found


def _mean(values: Sequence[float]) -> float | None:
    return fmean(values) if values else None
