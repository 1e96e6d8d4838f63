"""Output about studies in the terminal: estimate, progress, comparison."""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from rich.console import Console, Group
from rich.live import Live
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from aidsr.core.config import Budget
from aidsr.core.errors import Limit
from aidsr.core.formatting import counted
from aidsr.studies.budget import StudyBudget, read_budget
from aidsr.studies.comparison import compare
from aidsr.studies.estimate import StudyEstimate, estimate_study
from aidsr.studies.jobs import Job, format_limits, is_finished
from aidsr.studies.outcomes import paid_usd, read_outcomes
from aidsr.studies.runner import Progress
from aidsr.studies.study import Study
from aidsr.studies.tables import Difference, chance_in_words
from aidsr.teams.baselines.generations import format_search, read_search
from aidsr.teams.providers.offline import SEARCH


def print_forecast(console: Console, study: Study, jobs: int, limit: Budget) -> None:
    """Print the remaining jobs of a study and their estimated cost and time.

    Args:
        console: Console to print to.
        study: The study.
        jobs: Number of parallel jobs; 0 if unknown.
        limit: Limits of the study on the use of language models.
    """
    arms = Table(box=None, pad_edge=False)
    for name in ("arm", "model", "settings"):
        arms.add_column(name, overflow="fold")
    for arm in study.plan.arms:
        arms.add_row(*map(escape, (arm.name, arm.config.model, arm.settings or "defaults, the full method")))
    console.print(arms)
    found = estimate_study(study)
    left = ", ".join(f"{count} {stage}" for stage, count in found.jobs.items() if count) or "none"
    console.print(f"[bold]{escape(study.path.name)}[/]: remaining jobs: {left}", soft_wrap=True)
    basis = "from this study's own designs" if found.measured else "first guess"
    took = f", {_hours(found.core_hours / jobs)} with --jobs {jobs}" if jobs > 1 and found.core_hours else ""
    price = f"${found.cost_usd:.2f}" + (" (at the published cost of GPT-5)" if found.published_costs else "")
    console.print(
        f"Estimate ({basis}): {_hours(found.core_hours)} of one core{took}, {price}, {found.disk_mb:,.0f} MB",
        soft_wrap=True,
    )
    above = _above(study, found, limit)
    if above:
        console.print(f"[yellow]Above the limit:[/] {above}; the study would stop before all is done", soft_wrap=True)


def _above(study: Study, coming: StudyEstimate, limit: Budget) -> str:
    """Return the limits that the used and the estimated amounts together exceed, as text; empty if none."""
    budget, parts = StudyBudget(study, limit), []
    if limit.cost_usd is not None and budget.paid_usd + coming.cost_usd > limit.cost_usd:
        parts.append(f"${budget.paid_usd + coming.cost_usd:.2f} in total, ${limit.cost_usd:.2f} allowed")
    if limit.tokens is not None and budget.tokens + coming.tokens > limit.tokens:
        parts.append(f"{budget.tokens + coming.tokens:,} tokens in total, {limit.tokens:,} allowed")
    return " and ".join(parts)


def print_unfinished(console: Console, study: Study, refused: Collection[Limit]) -> None:
    """Print the unfinished runs of a study that ended at its limit, and how to resume it.

    Args:
        console: Console to print to.
        study: The study.
        refused: Limits that left too little for the next call.
    """
    limit, coming = read_budget(study), estimate_study(study)
    undone = [cell for cell in study.cells if not is_finished(study.run(cell))]
    budget, parts, options = StudyBudget(study, limit), [], []
    if limit.cost_usd is not None:
        parts.append(f"${budget.paid_usd:.2f} of ${limit.cost_usd:.2f} spent")
        if "cost_usd" in refused:
            options.append(f"--max-cost {math.ceil(max(budget.paid_usd, limit.cost_usd) + coming.cost_usd)}")
    if limit.tokens is not None:
        parts.append(f"{budget.tokens:,} of {limit.tokens:,} tokens used")
        if "tokens" in refused:
            options.append(f"--max-tokens {max(budget.tokens, limit.tokens) + coming.tokens}")
    names = ", ".join(cell.name for cell in undone[:_NAMED]) + (", …" if len(undone) > _NAMED else "")
    runs = "1 run is" if len(undone) == 1 else f"{len(undone)} runs are"
    console.print(
        f"The study's limit is reached: {' and '.join(parts)}; the remaining budget ({format_limits(refused)}) is "
        f"not enough for the next call. {runs} unfinished ({escape(names)}). To continue with a limit that should be "
        f"enough according to the estimate: aidsr benchmark "
        f"{escape(study.quoted_path)} --resume {' '.join(options)}",
        soft_wrap=True,
    )


_NAMED = 3
"""Maximum number of unfinished runs that are named; the report lists all."""


def _hours(hours: float) -> str:
    """Return a time as text, in minutes or hours."""
    return f"{60 * hours:.0f} min" if hours < 1 else f"{hours:,.1f} h"


class StudyTable:
    """Live table of a study: jobs done, running, to do, failed, cost, time left; without a terminal, lines of text."""

    def __init__(self, console: Console, study: Study) -> None:
        self._console = console
        self._study = study
        self._live = Live(console=console, refresh_per_second=2)
        self._left = estimate_study(study)
        self._paid = _paid(study)
        self._next_refresh_s = 0.0

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def listen(self, progress: Progress) -> None:
        """Show the state of the study."""
        last = progress.last
        if last is not None and last.error and not last.exhausted_limits:
            line = escape(last.error.splitlines()[-1][:200])
            self._console.print(f"[red]{escape(last.job.name)}[/]: {line}", soft_wrap=True)
        self._refresh(at_the_end=not progress.running)
        to_do = max(0, sum(self._left.jobs.values()) - len(progress.running) - len(progress.failed))
        counts = (progress.done, len(progress.running), to_do, len(progress.failed))
        cells = (*(str(count) for count in counts), self._paid, self._time_left(progress))
        if not self._console.is_terminal:
            words = ", ".join(f"{name} {cell}" for name, cell in zip(_HEADS, cells, strict=True) if cell)
            self._console.print(words, soft_wrap=True)
            return
        table = Table(box=None, pad_edge=False)
        for name in _HEADS:
            table.add_column(name, justify="right")
        table.add_row(*cells)
        at_work = [_AtWork(self._study, job) for job in progress.running]
        self._live.update(Group(table, *at_work), refresh=True)

    def _refresh(self, at_the_end: bool) -> None:
        """Read the study's folder again, but not so often that it takes a notable share of the time."""
        began_s = time.monotonic()
        if began_s < self._next_refresh_s and not at_the_end:
            return
        self._left, self._paid = estimate_study(self._study), _paid(self._study)
        ended_s = time.monotonic()
        self._next_refresh_s = ended_s + _REFRESH_SHARE * (ended_s - began_s)

    def _time_left(self, progress: Progress) -> str:
        if not progress.running:
            return ""
        return f"about {_hours(self._left.core_hours / len(progress.running))}"


@dataclass(frozen=True)
class _AtWork:
    """Line of a running job, rendered at each refresh; a search, which takes minutes, shows its progress."""

    study: Study
    job: Job

    def __rich__(self) -> Text:
        run = self.study.run(self.job.cell) if self._searches else None
        search = format_search(read_search(run)) if run else ""
        return Text(f"  {self.job.name}" + (f": {search}" if search else ""), style="dim")

    @property
    def _searches(self) -> bool:
        return self.job.stage == "design" and self.study.arm(self.job.cell.arm).config.model == SEARCH.prefix


_HEADS = ("done", "running", "to do", "failed", "cost", "time left")
_REFRESH_SHARE = 20
"""Pause before the study's folder is read again / time of the last reading. Our choice: at most 5 % of the driver."""


def _paid(study: Study) -> str:
    cost, limit = paid_usd(study, read_outcomes(study)), read_budget(study).cost_usd
    allowed = "" if limit is None else f" of ${limit:.2f}"
    return "unknown" if cost is None else f"${cost:.2f}{allowed}"


def print_comparison(console: Console, one: Study, other: Study) -> int:
    """Print whether the first arms of two studies differ significantly; return 0, or 1 if nothing is comparable."""
    found = compare(one, other)
    if found.differences:
        names = [f"{study.path.name} ({study.plan.arms[0].name})" for study in (other, one)]
        _print_differences(console, " compared with ".join(names), found.differences)
    for note in found.notes:
        console.print(f"[yellow]{escape(note)}[/]" if found.differences else escape(note), soft_wrap=True)
    return 0 if found.differences else 1


def _print_differences(console: Console, title: str, found: Sequence[Difference]) -> None:
    table = Table(box=None, pad_edge=False, title=escape(title), title_justify="left")
    for name in ("metric", "difference", "95 % CI", "p", ""):
        table.add_column(name, justify="left" if name in ("metric", "") else "right")
    for each in found:
        value, interval = each.in_words
        verdict = "significant" if each.real else "not significant"
        table.add_row(each.what, value, interval, f"{each.p_value:.3f}", verdict)
    console.print(table)
    console.print(
        f"{counted(found[0].pairs, 'design')} of {counted(found[0].runs, 'run')} finished in both, paired by task, run "
        "and number. Designs of one run are not independent, so the bootstrap resamples whole runs, and p is the share "
        "of sign flips of whole runs with a difference at least as large. An interval needs six runs and two of each "
        "task; with fewer than six runs no difference is significant. " + chance_in_words(len(found)),
        soft_wrap=True,
    )
