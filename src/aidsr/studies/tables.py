"""The figures of a study, computed from its raw rows: per task, per arm, and what broke."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from statistics import fmean

from aidsr.core.artifacts import Artifact
from aidsr.core.rates import Interval, Rate
from aidsr.studies.outcomes import DesignRow
from aidsr.studies.statistics import bootstrap_mean, paired_difference
from aidsr.tasks import RULES_FROZEN_AT, TASKS_OUT_OF_SAMPLE


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

IN_SAMPLE = (
    "The rules were written with the benchmark's tasks in view (in-sample): their rates say nothing about new tasks."
)
"""Belongs to every table that shows the built-in rules, above all beside published figures."""


def sample_in_words(tasks: Sequence[str]) -> str:
    """Return which tasks of a table the built-in rules were written with in view, and which came later."""
    later = [task for task in tasks if task in TASKS_OUT_OF_SAMPLE]
    if not later:
        return IN_SAMPLE
    words = f"{', '.join(later)}: added after the rules were frozen at commit {RULES_FROZEN_AT} (out of sample)."
    return words if len(later) == len(tasks) else f"{IN_SAMPLE} Exceptions: {words}"


class Line(Artifact):
    """Designs of one task, or of all, in one arm."""

    task: str
    attempted: int
    """Designs that the plan asks for: the denominator of every rate."""
    ended: int
    """Those that came to an end; the figures a design are their means."""
    complete: int
    """Those whose policies are all judged, or that need none."""
    approved: int
    stable: int
    valid: int
    successful: int
    won_80: int = 0
    """Designs most of whose policies are valid and win at least 80 % of their held-out episodes; `successful` is at
    least 50 %, the paper's binary rate."""
    won_95: int = 0
    """The same with 95 %."""
    episodes_share: float | None
    """Mean share of held-out episodes that succeeded, a policy that is not judged counting as 0; None of nothing."""
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
    chance: float
    """How often signs drawn at random come as far, see `PairedDifference`."""
    pairs: int
    """Designs that came to an end in both."""

    @property
    def real(self) -> bool:
        """Whether the interval excludes zero, and chance seldom comes as far."""
        return Interval(self.value, self.low, self.high).excludes_zero and self.chance < _SELDOM

    @property
    def in_words(self) -> tuple[str, str, str]:
        """The difference and its interval, as a person reads them: points of a hundred, or a number."""

        def shown(value: float) -> str:
            if self.what == "tokens":
                text = f"{value:+,.0f}"
            else:
                text = f"{value:+.1f}" if self.what == "iterations" else f"{100 * value:+.0f} %"
            return text[1:] if value == 0 else text

        return shown(self.value), shown(self.low), shown(self.high)


_SELDOM = 0.05
"""Our choice: the usual one, to go with intervals of 95 %."""


def line_of(task: str, rows: Sequence[DesignRow]) -> Line:
    """Return the figures of some designs."""
    ended = [row for row in rows if row.outcome != "unfinished"]
    usages = [row.usage for row in ended]
    costs = [usage.cost_usd for usage in usages]
    probed = [row.probe_progress for row in rows if row.probe_progress is not None]
    return Line(
        task=task,
        attempted=len(rows),
        ended=len(ended),
        complete=sum(row.complete for row in rows),
        approved=sum(row.outcome == "approved" for row in rows),
        stable=sum(row.stable for row in rows),
        valid=sum(row.valid for row in rows),
        successful=sum(row.successful for row in rows),
        won_80=sum(row.wins(0.8) for row in rows),
        won_95=sum(row.wins(0.95) for row in rows),
        episodes_share=_mean([row.episodes_share for row in rows]),
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
    return tuple(line_of(task, own) for task, own in _rows_by_task(rows, arm).items())


def _rows_by_task(rows: Sequence[DesignRow], arm: str) -> dict[str, list[DesignRow]]:
    found: dict[str, list[DesignRow]] = {}
    for row in rows:
        if row.arm == arm:
            found.setdefault(row.task, []).append(row)
    return found


def arm_lines(rows: Sequence[DesignRow], models: Mapping[str, str]) -> tuple[ArmLine, ...]:
    """Return one line an arm.

    Args:
        rows: Of the study.
        models: The model of each arm.
    """
    found = []
    for arm, model in models.items():
        by_task = _rows_by_task(rows, arm)
        if by_task:
            interval = bootstrap_mean({task: [row.policies for row in of_task] for task, of_task in by_task.items()})
            found.append(
                ArmLine(
                    arm=arm,
                    model=model,
                    line=line_of("all tasks", [row for row in rows if row.arm == arm]),
                    success_low=interval.low,
                    success_high=interval.high,
                )
            )
    return tuple(found)


def differences(rows: Sequence[DesignRow], against: str) -> tuple[Difference, ...]:
    """Return by how much each other arm differs from one, on designs that came to an end in both.

    What was designed always; what was trained where every policy of a design is judged; tokens where a model was asked.
    """
    compared = [*_DESIGNED, *(_TRAINED if any(row.evaluations for row in rows) else ())]
    if any(row.usage.calls for row in rows):
        compared.append("tokens")
    return tuple(
        found
        for arm in dict.fromkeys(row.arm for row in rows)
        if arm != against
        for what in compared
        if (found := _difference(rows, what, arm, against))
    )


_DESIGNED, _TRAINED = ("approved", "stable", "iterations"), ("valid", "successful", "episodes")
_COMPARED: dict[str, Callable[[DesignRow], float]] = {
    "approved": lambda row: float(row.outcome == "approved"),
    "iterations": lambda row: float(row.iterations),
    "stable": lambda row: float(row.stable),
    "valid": lambda row: float(row.valid),
    "successful": lambda row: float(row.successful),
    "episodes": lambda row: row.episodes_share,
    "tokens": lambda row: float(row.usage.input_tokens + row.usage.output_tokens),
}


def _difference(rows: Sequence[DesignRow], what: str, arm: str, against: str) -> Difference | None:
    one, other = (_by_task(rows, name, what) for name in (against, arm))
    found = paired_difference(one, other)
    if found is None:
        return None
    value, low, high = found.interval.value, found.interval.low, found.interval.high
    return Difference(
        what=what,
        arm=arm,
        against=against,
        value=value,
        low=low,
        high=high,
        chance=found.chance,
        pairs=found.pairs,
    )


def _by_task(rows: Sequence[DesignRow], arm: str, what: str) -> dict[str, dict[tuple[int, int], float]]:
    found: dict[str, dict[tuple[int, int], float]] = {}
    for row in rows:
        if row.arm == arm and _is_known(row, what):
            found.setdefault(row.task, {})[row.key] = _COMPARED[what](row)
    return found


def _is_known(row: DesignRow, what: str) -> bool:
    """Return whether a design came so far that this will not change any more."""
    if what in _TRAINED:
        return row.complete
    if what == "stable" and row.outcome == "approved":
        return row.verified
    return row.outcome != "unfinished"


def _mean(values: Sequence[float]) -> float | None:
    return fmean(values) if values else None
