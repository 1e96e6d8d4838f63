"""What `aidsr train` and `aidsr evaluate` share: what the terminal says."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from aidsr.core.artifacts import Evaluation
from aidsr.core.formatting import compared

if TYPE_CHECKING:
    from aidsr.learn.rl.callbacks import CurvePoint


class TrainingBar:
    """A line that grows while a policy learns, or a line now and then where there is no terminal."""

    def __init__(self, console: Console, title: str, steps: int) -> None:
        self._console, self._title, self._steps = console, title, steps
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed:>7.0f} steps  {task.fields[speed]:>6.0f}/s  success {task.fields[success]}"),
            TimeRemainingColumn(),
        )
        self._progress = Progress(*columns, console=console, transient=True)
        self._bar = self._progress.add_task(title, total=steps, speed=0.0, success="–")
        self._next_line = 0

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.stop()

    def listen(self, point: CurvePoint) -> None:
        """Take a point of the curve in."""
        success = f"{point.success_share:.0%}" if point.episodes else "–"
        self._progress.update(self._bar, completed=point.steps, speed=point.steps_per_s, success=success)
        if not self._console.is_terminal and point.steps >= self._next_line:
            self._next_line = point.steps + self._steps // 10
            told = f"{self._title}: {point.steps} steps, {point.steps_per_s:.0f}/s, success {success}"
            self._console.print(escape(told), soft_wrap=True)


def print_evaluation(console: Console, folder: Path, evaluation: Evaluation) -> None:
    """Say what a policy is worth, and why it is not believed where it is not."""
    print_evaluations(console, {folder: evaluation})
    for check in evaluation.checks:
        if not check.passed:
            console.print(f"[red]{check.name}[/]: {escape(check.message)}: {compared(check)}", soft_wrap=True)


def print_evaluations(console: Console, evaluations: dict[Path, Evaluation]) -> None:
    """Print one line for each policy."""
    table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), header_style="dim")
    for title in ("training", "success", "progress", "valid", "successful"):
        table.add_column(title, overflow="fold")
    for folder, evaluation in evaluations.items():
        progress = sum(one.best_progress for one in evaluation.episodes) / len(evaluation.episodes)
        verdict = ["[green]yes[/]" if yes else "[red]no[/]" for yes in (evaluation.valid, evaluation.successful)]
        won = round(evaluation.success_share * len(evaluation.episodes))
        share = f"{evaluation.success_share:.0%} ({won} of {len(evaluation.episodes)})"
        table.add_row(escape(str(folder)), share, f"{progress:.2f}", *verdict)
    console.print(table)
