"""Trainings in a row, and their output; shared by `aidsr train`, `aidsr evaluate` and `aidsr design --train`."""

from __future__ import annotations

import shlex
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Table

from aidsr.apps.cli.reporting import print_unwrapped
from aidsr.core.artifacts import Evaluation, PerturbedEpisodes
from aidsr.core.config import VERDICT_EPISODES
from aidsr.core.ends import evaluation_in_words
from aidsr.core.formatting import format_check, format_time_left
from aidsr.core.progress_lines import INTERRUPTED, evaluation_line

if TYPE_CHECKING:
    from aidsr.api import DesignedScene
    from aidsr.core.rates import Rate
    from aidsr.learn.episodes.actions import Grouping
    from aidsr.learn.episodes.policy_checks import EvaluationPoint
    from aidsr.learn.rl.curve_point import CurvePoint
    from aidsr.learn.rl.recipe import Recipe
    from aidsr.runs import Run


@dataclass(frozen=True)
class Trainer:
    """Trains a policy for each seed and evaluates it; finished trainings and evaluations are only printed again."""

    console: Console
    steps: int
    """Maximum control steps for each policy."""
    seeds: range
    recipe: Recipe
    minutes: float | None = None
    """Maximum wall time for each policy [min]; None for no limit."""
    threads: int = 0
    tensorboard: bool = False
    evaluate: bool = True
    """Whether to evaluate each policy."""
    videos: bool = True
    again: bool = False
    """Whether to train again even if earlier trainings are finished or stopped."""

    def train(self, scene: DesignedScene, home: Path, grouping: Grouping = "auto") -> bool:
        """Train a policy for each seed, in numbered folders; return whether any succeeds (True if not evaluated)."""
        from aidsr.learn.rl.isolated_learning import describe_actions

        actions = describe_actions(*scene.as_text(), grouping)
        self.console.print(actions, style="bold", markup=False, soft_wrap=True)
        verdicts = []
        for seed in self.seeds:
            folder = self._train(scene, home, grouping, seed)
            if self.evaluate:
                verdicts.append(self._evaluate(folder))
        return any(verdicts) or not self.evaluate

    def _train(self, scene: DesignedScene, home: Path, grouping: Grouping, seed: int) -> Path:
        """Train one policy with a progress bar, print how the training ended, and return its folder."""
        from aidsr.api import train_policy

        finished_before = set(home.glob("*/training.json"))
        with TrainingBar(self.console, f"seed {seed}", self.steps, self.recipe) as bar:
            training = train_policy(
                scene,
                home,
                grouping=grouping,
                steps=self.steps,
                seed=seed,
                recipe=self.recipe,
                minutes=self.minutes,
                threads=self.threads,
                tensorboard=self.tensorboard,
                again=self.again,
                listen=bar.listen,
            )
        result = training.result.read()
        assert result is not None, "a training ends with its result"
        how = f"{result['steps']} steps in {result['wall_s']:.0f} s, ended by {result['stopped']}"
        if training.resumed:
            how += ", resumed during training: not the policy of an uninterrupted training"
        how += training.beginning
        known = training.result.path in finished_before
        line = f"{training.path}: already trained, {how}; --again repeats it" if known else f"{training.path}: {how}"
        self.console.print(line, markup=False, soft_wrap=True)
        return training.path

    def _evaluate(self, folder: Path) -> bool:
        """Evaluate one policy, print the result, and return whether it is successful."""
        from aidsr.api import evaluate
        from aidsr.runs.trainings import Training

        known = Training(folder).evaluation.read()
        if known is None:
            with evaluating(self.console, videos=self.videos) as listen:
                known = evaluate(folder, threads=self.threads, videos=self.videos, listen=listen)
        print_evaluation(self.console, folder, known)
        return known.successful


def train_designs(run: Run, *, steps: int, seeds: int) -> int:
    """Train and evaluate each approved design of a run; return 0 if any succeeds, 1 if none, 130 if interrupted."""
    from aidsr.api import find_scene
    from aidsr.apps.cli.reporting import print_status
    from aidsr.apps.cli.terminal import make_console
    from aidsr.learn.rl.recipe import recipe_of
    from aidsr.runs import read_status, write_summary
    from aidsr.teams.providers import is_offline

    offline = is_offline(run.asked().config.model)
    console = make_console()
    trainer = Trainer(console, steps, range(seeds), recipe_of("best"))
    left = [one for one in run.designs if (ended := one.outcome.read()) is not None and ended.outcome == "approved"]
    successful = False
    try:
        while left:
            found = find_scene(left[0])
            of_design = replace(trainer, recipe=trainer.recipe.starting_from("own", found.script))
            successful |= of_design.train(found, found.trainings)
            left.pop(0)
            write_summary(run, offline=offline)
    except KeyboardInterrupt:
        write_summary(run, offline=offline)
        console.print(f"\n{INTERRUPTED}; continue with", soft_wrap=True)
        for design in left:
            command = ["aidsr", "train", str(design.path), "--steps", str(steps), "--seeds", str(seeds)]
            console.print(f"  {shlex.join(command)}", style="bold", markup=False, soft_wrap=True)
        return 130
    console.print()
    print_status(console, run, read_status(run))
    return 0 if successful else 1


_NO_SUCCESS_YET = (
    "no episode has succeeded so far; few such trainings succeed later (aidsr train --stop-hopeless ends them here)"
)


class TrainingBar:
    """Progress bar of a training; without a terminal, a line of text after every tenth of the steps."""

    def __init__(self, console: Console, title: str, steps: int, recipe: Recipe) -> None:
        self._console, self._title, self._steps, self._recipe = console, title, steps, recipe
        self._told_hopeless = recipe.stop_hopeless  # then the end of the training reports it
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed:>7.0f} steps  {task.fields[speed]:>6.0f}/s  success {task.fields[success]}"),
            TextColumn("{task.fields[left]}"),
        )
        self._progress = Progress(*columns, console=console, transient=True)
        first = "probing for a motion first" if recipe.searches(steps) else ""
        self._bar = self._progress.add_task(title, total=steps, speed=0.0, success="–", left=first)
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
        """Update the bar with a point of the learning curve."""
        self._say_if_hopeless(point)
        success = f"{point.success_share:.0%}" if point.episodes else "–"
        left = format_time_left(self._steps - point.steps, point.steps_per_s)
        if point.steps >= self._steps:
            left = "testing the policy"
        self._progress.update(self._bar, completed=point.steps, speed=point.steps_per_s, success=success, left=left)
        if not self._console.is_terminal and point.steps >= self._next_line:
            self._next_line = point.steps + self._steps // 10
            line = f"{self._title}: {point.steps} steps, {point.steps_per_s:.0f}/s, success {success}, {left}"
            self._console.print(escape(line), soft_wrap=True)

    def _say_if_hopeless(self, point: CurvePoint) -> None:
        """Print once that a training looks hopeless, unless `stop_hopeless` ends it: then its end reports that."""
        from aidsr.learn.rl.recipe import is_hopeless

        algorithm, has_succeeded = self._recipe.algorithm, point.won > 0
        hopeless = is_hopeless(algorithm, has_succeeded=has_succeeded, steps=point.steps, budget=self._steps)
        if hopeless and not self._told_hopeless:
            self._told_hopeless = True
            self._console.print(f"{self._title}: {_NO_SUCCESS_YET}", soft_wrap=True)


@contextmanager
def evaluating(
    console: Console, episodes: int = VERDICT_EPISODES, *, videos: bool, perturbed: bool = False
) -> Iterator[Callable[[EvaluationPoint], None]]:
    """Show the progress of an evaluation, which takes half a minute or more; yield the listener to pass to it.

    Nothing is printed before the first call of the listener, because there may be nothing to evaluate. Without a
    terminal, as in a log file, a line is printed for each quarter of the time.
    """
    again = ", plus as many with each perturbation" * perturbed
    began, told = time.monotonic(), -1
    with console.status("starting") as status:

        def listen(point: EvaluationPoint) -> None:
            nonlocal told
            quarter = 4 if point.ended == point.episodes else int(4 * point.simulated_s / point.time_limit_s)
            if told < 0:
                console.print(f"evaluating {episodes} episodes{' and writing videos' * videos}{again} …", style="dim")
                told = 0
            if point.ended == point.episodes:
                rest = "checking plausibility"
            else:
                per_s = point.simulated_s / (time.monotonic() - began)
                rest = f"{format_time_left(point.time_limit_s - point.simulated_s, per_s)}, then checks"
            line = evaluation_line(point.ended, point.episodes, point.succeeded, rest)
            status.update(line)
            if quarter > told and not console.is_terminal:
                console.print(line, style="dim", soft_wrap=True)
            told = max(told, quarter)

        yield listen


def print_evaluation(console: Console, folder: Path, evaluation: Evaluation) -> None:
    """Print the evaluation of a policy: success, ends of its episodes, failed plausibility checks, perturbations."""
    print_evaluations(console, {folder: evaluation})
    for line in evaluation_in_words(evaluation):
        console.print(escape(line), soft_wrap=True)
    for check in evaluation.checks:
        if not check.passed:
            found = escape(f"{check.message}: {format_check(check)}")
            console.print(f"[red]{escape(check.name)}[/]: {found}", soft_wrap=True)
    if evaluation.perturbed:
        print_perturbed(console, evaluation.perturbed)


def print_perturbed(console: Console, perturbed: Sequence[PerturbedEpisodes]) -> None:
    """Print the success rates in perturbed scenes, and their share of the nominal success."""
    table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), header_style="dim")
    for title in ("perturbation", "success", "kept"):
        table.add_column(title, overflow="fold")
    for one in perturbed:
        kept = "–" if one.kept_share is None else f"{one.kept_share:.0%}"
        table.add_row(escape(one.summary), _success(one.success_rate), kept)
    console.print()
    print_unwrapped(console, table)


def print_evaluations(console: Console, evaluations: dict[Path, Evaluation]) -> None:
    """Print one line for each policy; its success rate has a 95 % Wilson interval."""
    from aidsr.runs.trainings import Training

    table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), header_style="dim")
    for title in ("training", "success", "mean best progress", "valid", "successful"):
        table.add_column(title, overflow="fold")
    for folder, evaluation in evaluations.items():
        progress = sum(one.best_progress for one in evaluation.episodes) / len(evaluation.episodes)
        verdict = ["[green]yes[/]" if yes else "[red]no[/]" for yes in (evaluation.valid, evaluation.successful)]
        name = f"{folder} (resumed during training)" if Training(folder).resumed else str(folder)
        table.add_row(escape(name), _success(evaluation.success_rate), f"{progress:.2f}", *verdict)
    print_unwrapped(console, table)


def _success(rate: Rate) -> str:
    return f"{rate.share:.0%} ({rate.hits} of {rate.of}; {rate.interval.low:.0%} to {rate.interval.high:.0%})"
