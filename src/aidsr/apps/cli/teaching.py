"""Policies trained and judged one after the other, for `aidsr train` and `aidsr design --train`."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

if TYPE_CHECKING:
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.learn.rl.recipe import Recipe
    from aidsr.runs import Run


@dataclass(frozen=True)
class Teacher:
    """Does what is left to do: what was begun goes on, what was learned is judged, a verdict that is there is told."""

    console: Console
    steps: int
    """Budget of each policy."""
    seeds: range
    recipe: Recipe
    threads: int = 0
    tensorboard: bool = False
    evaluate: bool = True
    """Whether policies are judged."""
    videos: bool = True
    again: bool = False
    """Whether to train anew what is there."""

    def teach(self, learning: TaskScene, home: Path) -> bool:
        """Train a policy for each seed, in numbered folders; return whether one is successful or none was judged."""
        told = f"{learning.task.name}: {len(learning.actions.actuators)} actuators in {learning.actions.size} actions"
        self.console.print(told, style="bold", markup=False, soft_wrap=True)
        verdicts = []
        for seed in self.seeds:
            folder = self._train(learning, home, seed)
            if self.evaluate:
                verdicts.append(self._judge(folder))
        return any(verdicts) or not self.evaluate

    def _train(self, learning: TaskScene, home: Path, seed: int) -> Path:
        """Train one policy in the folder that is its own; return that."""
        from aidsr.learn.rl.training import folder_for
        from aidsr.learn.rl.training_folder import TakenError

        place = partial(folder_for, home, learning, steps=self.steps, seed=seed, recipe=self.recipe, again=self.again)
        folder = place()
        while True:
            try:
                self._train_in(folder, learning, seed)
            except TakenError:
                taken, folder = folder, place()
                if folder == taken:  # by another process for this very training
                    raise
            else:
                return folder

    def _train_in(self, folder: Path, learning: TaskScene, seed: int) -> None:
        """Train one policy while a person watches, and say how it went."""
        from aidsr.apps.cli.learning import TrainingBar
        from aidsr.learn.rl.training import train

        is_there = (folder / "training.json").exists()
        with TrainingBar(self.console, f"seed {seed}", self.steps) as bar:
            result = train(
                learning,
                folder,
                steps=self.steps,
                seed=seed,
                recipe=self.recipe,
                threads=self.threads,
                tensorboard=self.tensorboard,
                listen=bar.listen,
            )
        told = f"{result.steps} steps in {result.wall_s:.0f} s, ended by {result.stopped}"
        told = f"{folder}: trained already, {told}; --again trains anew" if is_there else f"{folder}: {told}"
        self.console.print(told, markup=False, soft_wrap=True)

    def _judge(self, folder: Path) -> bool:
        """Evaluate one policy, say how it did, and return whether it is successful."""
        from aidsr.apps.cli.learning import print_evaluation
        from aidsr.learn.rl.trained import evaluate_training
        from aidsr.runs.trainings import Training

        known = Training(folder).evaluation.read()
        verdict = known or evaluate_training(folder, threads=self.threads, videos=self.videos)
        print_evaluation(self.console, folder, verdict)
        return verdict.successful


def train_designs(run: Run, *, steps: int, seeds: int) -> int:
    """Train and judge every approved design of a run; return 0 if one is successful, 1 if none, 130 if interrupted."""
    from aidsr.apps.cli.reporting import print_status
    from aidsr.apps.cli.subject import subject_of
    from aidsr.learn.rl.recipe import Recipe
    from aidsr.runs import read_status, write_summary

    console = Console(highlight=False)
    teacher = Teacher(console, steps, range(seeds), Recipe())
    left = [one for one in run.designs if (ended := one.outcome.read()) is not None and ended.outcome == "approved"]
    successful = False
    try:
        while left:
            subject = subject_of(left[0].path, None, None)
            successful |= teacher.teach(subject.to_learn_in("auto"), subject.home / "training")
            left.pop(0)
            write_summary(run)
    except KeyboardInterrupt:
        write_summary(run)
        console.print("\nInterrupted. What was learned is kept; go on with", soft_wrap=True)
        for design in left:
            command = ["aidsr", "train", str(design.path), "--steps", str(steps), "--seeds", str(seeds)]
            console.print(f"  {shlex.join(command)}", style="bold", markup=False, soft_wrap=True)
        return 130
    console.print()
    print_status(console, run, read_status(run))
    return 0 if successful else 1
