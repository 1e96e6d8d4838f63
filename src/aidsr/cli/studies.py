"""What the terminal says of studies."""

from __future__ import annotations

from collections import Counter
from datetime import timedelta
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.live import Live
from rich.table import Table

from aidsr.benchmark.driving import Progress
from aidsr.benchmark.outcomes import read_outcomes
from aidsr.benchmark.planning import forecast
from aidsr.benchmark.study import Study
from aidsr.benchmark.tables import differences

__all__ = ["StudyTable", "say_comparison", "say_forecast"]


def say_forecast(console: Console, study: Study) -> None:
    """Say what is still to be done and what it may take."""
    arms = Table(box=None, pad_edge=False)
    for name in ("arm", "model", "what is not as usual"):
        arms.add_column(name, overflow="fold")
    for arm in study.plan.arms:
        arms.add_row(arm.name, arm.config.model, arm.settings or "nothing, the full method")
    console.print(arms)
    found = forecast(study)
    jobs = ", ".join(f"{count} {stage}" for stage, count in found.jobs.items() if count) or "none"
    console.print(f"[bold]{study.path.name}[/]: jobs to do: {jobs}", soft_wrap=True)
    basis = "from this study's own designs" if found.measured else "a first guess"
    console.print(
        f"Estimate ({basis}): {found.core_hours:.1f} core hours, ${found.cost_usd:.2f}, {found.disk_mb:,.0f} MB",
        soft_wrap=True,
    )


class StudyTable:
    """A live table of a study: done, running, failed, hours left."""

    def __init__(self, console: Console, study: Study) -> None:
        self._console = console
        self._study = study
        self._spent_s = Counter[str]()
        self._ended = Counter[str]()
        self._live = Live(console=console, refresh_per_second=2, transient=not console.is_terminal)

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def listen(self, progress: Progress) -> None:
        """Show where the study stands."""
        if progress.last is not None:
            self._spent_s[progress.last.job.stage] += round(progress.last.wall_s)
            self._ended[progress.last.job.stage] += 1
            if progress.last.error:
                line = progress.last.error.splitlines()[-1][:200]
                self._console.print(f"[red]{progress.last.job.name}[/]: {line}", soft_wrap=True, markup=True)
        table = Table(box=None, pad_edge=False)
        for name in ("done", "running", "waiting", "given up", "left"):
            table.add_column(name, justify="right")
        counts = (progress.done, len(progress.running), progress.waiting, len(progress.failed))
        table.add_row(*(str(count) for count in counts), self._left(progress))
        for job in progress.running:
            table.add_row("", "", "", "", "", f"[dim]{job.name}[/]")
        self._live.update(table)

    def _left(self, progress: Progress) -> str:
        """Return the time left in words, from the jobs that ended; nothing before the first did."""
        if not self._ended or not progress.running:
            return ""
        each_s = sum(self._spent_s.values()) / sum(self._ended.values())
        jobs = progress.waiting + len(progress.running)
        return f"about {timedelta(seconds=round(each_s * jobs / len(progress.running)))}"


def say_comparison(console: Console, one: Study, other: Study) -> int:
    """Say whether the first arm of one study differs from that of another; return the exit code."""
    rows = [
        row.model_copy(update={"arm": name})
        for study, name in ((one, "first"), (other, "second"))
        for row in read_outcomes(study)
        if row.arm == study.plan.arms[0].name
    ]
    found = differences(rows, "first")
    if not found:
        console.print("The two studies have no design in common: no task with the same run and number in both.")
        return 1
    table = Table(box=None, pad_edge=False, title=f"{other.path.name} against {one.path.name}", title_justify="left")
    for name in ("what", "difference", "95 %", ""):
        table.add_column(name, justify="left" if name in ("what", "") else "right")
    for each in found:
        tokens = each.what == "tokens"
        shown = [f"{v:+,.0f}" if tokens else f"{100 * v:+.0f} %" for v in (each.value, each.low, each.high)]
        verdict = "more than noise" if each.real else "within noise"
        table.add_row(each.what, shown[0], f"{shown[1]} to {shown[2]}", verdict)
    console.print(table)
    return 0
