"""Results of a study aggregated from its raw rows, per task and per arm, and differences between arms."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from statistics import fmean

from aidsr.core.artifacts import Artifact
from aidsr.core.rates import Interval, Rate
from aidsr.studies.outcomes import DesignRow
from aidsr.studies.statistics import Policies, bootstrap_mean, paired_difference
from aidsr.tasks import RULES_FROZEN_AT, TASKS_OUT_OF_SAMPLE


class PaperFigures(Artifact):
    """Published results, for orientation only: the paper's tasks are not public, so they are not comparable."""

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
"""Note for every table with results of the built-in rules, in particular next to published results."""


def sample_in_words(tasks: Sequence[str]) -> str:
    """Return a note on which tasks of a table were known when the built-in rules were written, and which came later."""
    later = [task for task in tasks if task in TASKS_OUT_OF_SAMPLE]
    if not later:
        return IN_SAMPLE
    words = f"{', '.join(later)}: added after the rules were frozen at commit {RULES_FROZEN_AT} (out of sample)."
    return words if len(later) == len(tasks) else f"{IN_SAMPLE} Exceptions: {words}"


class Line(Artifact):
    """Aggregated results of the designs of one task, or of all tasks, in one arm."""

    task: str
    attempted: int
    """Number of designs in the plan, the denominator of every rate."""
    ended: int
    """Number of designs that have ended; tokens, cost, latency and iterations are means over these."""
    complete: int
    """Number of designs whose policies are all evaluated, or that need none."""
    approved: int
    stable: int
    valid: int
    successful: int
    won_80: int = 0
    """Number of designs most of whose policies are valid and succeed in at least 80 % of their held-out episodes.
    `successful` requires at least 50 %, the paper's binary rate."""
    won_95: int = 0
    """Number of designs most of whose policies are valid and succeed in at least 95 % of their held-out episodes."""
    episodes_share: float | None
    """Mean success rate in held-out episodes; a policy that is not evaluated counts as 0. None without designs."""
    probe_progress: float | None
    """Mean progress of the best open-loop motions; None where no design was probed."""
    tokens: float
    """Mean input and output tokens per design."""
    tokens_estimated: bool
    cost_usd: float | None
    """Mean cost per design; None where a price is unknown."""
    latency_s: float
    iterations: float
    steps: float
    training_s: float

    def rate(self, of: str) -> Rate:
        """Return one of the counts, given by its name, as a rate of the attempted designs."""
        return Rate(int(getattr(self, of)), self.attempted)


class ArmLine(Artifact):
    """Aggregated results of an arm over all tasks."""

    arm: str
    model: str
    line: Line
    success_low: float | None
    success_high: float | None
    """Upper end, with `success_low`, of the 95 % interval of the mean success rate in held-out episodes; None
    if the runs are too few.

    Every task has the same weight; see `bootstrap_mean`.
    """


class Difference(Artifact):
    """Mean difference of one quantity between two arms, on the designs that ended in both."""

    what: str
    arm: str
    against: str
    value: float
    low: float
    high: float
    """Upper end, with `low`, of the 95 % interval; both are nan if the runs are too few, see `PairedDifference`."""
    p_value: float
    """Two-sided p value, see `PairedDifference`."""
    pairs: int
    """Number of designs that ended in both arms."""
    runs: int
    """Number of runs that these designs are from."""

    @property
    def real(self) -> bool:
        """Whether the difference is significant.

        It is if the p value is below `SIGNIFICANCE_LEVEL` and the interval, where there is one, excludes zero.
        """
        has_interval = not math.isnan(self.low)
        excludes_zero = Interval(self.value, self.low, self.high).excludes_zero
        return self.p_value < SIGNIFICANCE_LEVEL and (excludes_zero or not has_interval)

    @property
    def in_words(self) -> tuple[str, str]:
        """The difference and its interval as text: in %, or as numbers for tokens and iterations."""

        def shown(value: float) -> str:
            if self.what == "tokens":
                text = f"{value:+,.0f}"
            else:
                text = f"{value:+.1f}" if self.what == "iterations" else f"{100 * value:+.0f} %"
            return text[1:] if value == 0 else text

        interval = TOO_FEW_RUNS if math.isnan(self.low) else f"{shown(self.low)} to {shown(self.high)}"
        return shown(self.value), interval


SIGNIFICANCE_LEVEL = 0.05
"""Significance level of the p value. Our choice: the usual one, which matches 95 % intervals."""
TOO_FEW_RUNS = "too few runs"
"""Text in place of an interval that cannot be estimated."""


def chance_in_words(tests: int) -> str:
    """Return a sentence on how many of several differences are significant by chance; empty for one."""
    if tests < 2:
        return ""
    return (
        f"Each of these {tests} differences is tested by itself at {SIGNIFICANCE_LEVEL:.0%}, so where nothing differs "
        f"up to {tests * SIGNIFICANCE_LEVEL:.1f} are significant by chance: decide by the one named before the study."
    )


def line_of(task: str, rows: Sequence[DesignRow]) -> Line:
    """Return the aggregated results of some designs."""
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
    """Return one line for each task of an arm, in the order of the rows."""
    return tuple(line_of(task, own) for task, own in _rows_by_task(rows, arm).items())


def _rows_by_task(rows: Sequence[DesignRow], arm: str) -> dict[str, list[DesignRow]]:
    found: dict[str, list[DesignRow]] = {}
    for row in rows:
        if row.arm == arm:
            found.setdefault(row.task, []).append(row)
    return found


def arm_lines(rows: Sequence[DesignRow], models: Mapping[str, str]) -> tuple[ArmLine, ...]:
    """Return one line for each arm that has rows.

    Args:
        rows: Rows of the study.
        models: Model of each arm, by the arm's name.
    """
    found = []
    for arm, model in models.items():
        by_task = _rows_by_task(rows, arm)
        if by_task:
            interval = bootstrap_mean({task: _policies_by_run(of_task) for task, of_task in by_task.items()})
            found.append(
                ArmLine(
                    arm=arm,
                    model=model,
                    line=line_of("all tasks", [row for row in rows if row.arm == arm]),
                    success_low=None if math.isnan(interval.low) else interval.low,
                    success_high=None if math.isnan(interval.high) else interval.high,
                )
            )
    return tuple(found)


def _policies_by_run(rows: Sequence[DesignRow]) -> list[list[Policies]]:
    found: dict[int, list[Policies]] = {}
    for row in rows:
        found.setdefault(row.run, []).append(row.policies)
    return list(found.values())


def differences(rows: Sequence[DesignRow], against: str) -> tuple[Difference, ...]:
    """Return the differences of each other arm from one arm, on designs that ended in both.

    Quantities of the design process are always compared, those of training where both plans train and all policies of
    a design are evaluated, and tokens where a language model was called.
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
        p_value=found.p_value,
        pairs=found.pairs,
        runs=found.runs,
    )


def _by_task(rows: Sequence[DesignRow], arm: str, what: str) -> dict[str, dict[tuple[int, int], float]]:
    found: dict[str, dict[tuple[int, int], float]] = {}
    for row in rows:
        if row.arm == arm and _is_known(row, what):
            found.setdefault(row.task, {})[row.key] = _COMPARED[what](row)
    return found


def _is_known(row: DesignRow, what: str) -> bool:
    """Return whether a quantity of a design is final."""
    if what in _TRAINED:
        return row.complete and row.seeds > 0
    if what == "stable" and row.outcome == "approved":
        return row.verified
    return row.outcome != "unfinished"


def _mean(values: Sequence[float]) -> float | None:
    return fmean(values) if values else None
