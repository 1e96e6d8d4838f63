"""Make the language model's robots again from its recorded replies, train them and evaluate their policies.

    python benchmarks/manual/trained.py --steps 60000

Designs are run with `--model manual:DIRECTORY` and today's prompts. Each prompt is answered with the reply recorded for
the most similar prompt of the same role, so robots are made from the very text that the model wrote. Runs and policies
go to build/manual; the same command continues with the first task that is not done. The table goes to trained.md, or to
trained_from_probe.md with --from-probe.
"""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

import aidsr
from aidsr.api import find_scene
from aidsr.core.artifacts import Evaluation
from aidsr.core.config import BUDGET_STEPS
from aidsr.core.rates import Rate
from aidsr.learn.rl.recipe import Recipe
from aidsr.learn.rl.trained import evaluate_training
from aidsr.learn.rl.training import train
from aidsr.runs import Run, read_status
from aidsr.runs.folders import DesignFolder

HERE = Path(__file__).parent
TRANSCRIPTS = HERE / "transcripts"
HOME = Path("build/manual")


@dataclass(frozen=True)
class Row:
    """Result of one design."""

    task: str
    concept: str
    steps: int
    wall_s: float
    verdict: Evaluation | None
    """Evaluation of the policy; None if the design has no scene to learn in."""


def main() -> None:
    """Do the remaining tasks, and write the table after each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=60_000, help="control steps a policy, at most")
    parser.add_argument("--from-probe", action="store_true", help="policies begin with the probe's best motion")
    parser.add_argument("--tasks", nargs="+", default=sorted(home.name for home in TRANSCRIPTS.iterdir()))
    asked = parser.parse_args()
    rows: list[Row] = []
    page = HERE / f"trained{'_from_probe' * asked.from_probe}.md"
    command = f"python benchmarks/manual/trained.py {' '.join(sys.argv[1:])}"
    for task in asked.tasks:
        run = made_again(TRANSCRIPTS / task)
        rows += [_learned(run, design, asked.steps, Recipe(from_probe=asked.from_probe)) for design in run.designs]
        page.write_text(table(rows, command), encoding="utf-8")


def made_again(recorded: Path) -> Run:
    """Return the run that is made from a task's recorded replies; run the design unless a finished run exists."""
    runs, desk = HOME / recorded.name / "runs", HOME / recorded.name / "desk"
    done = [run for run in map(Run, sorted(runs.glob("*"))) if read_status(run).state == "finished"]
    if done:
        return done[0]
    clerk = threading.Thread(target=_answer, args=(recorded, desk), daemon=True)
    clerk.start()
    return aidsr.design(task=recorded.name, model=f"manual:{desk}", seed=1, runs=runs)


def _answer(recorded: Path, desk: Path) -> None:
    """Answer prompts for ever. End the program at a prompt of a role without recorded replies."""
    while True:
        for prompt in sorted(desk.glob("*.prompt.md")):
            reply = prompt.with_name(prompt.name.replace("prompt", "reply"))
            if not reply.exists():
                told = _most_alike(prompt, recorded).read_text(encoding="utf-8")
                part = reply.with_suffix(".part")
                part.write_text(told, encoding="utf-8")
                part.replace(reply)
        time.sleep(0.2)


def _most_alike(prompt: Path, recorded: Path) -> Path:
    """Return the file of the reply to the recorded prompt of the same role that shares most lines with a prompt."""
    text = prompt.read_text(encoding="utf-8")
    role, lines = _role(text), set(text.splitlines())
    if not any(_role(path.read_text(encoding="utf-8")) == role for path in recorded.glob("*.prompt.md")):
        sys.stderr.write(f"{prompt} is a question of the {role}, and {recorded} has no reply to one\n")
        os._exit(1)
    same = {
        path: len(lines & set(old.splitlines()))
        for path in recorded.glob("*.prompt.md")
        if _role(old := path.read_text(encoding="utf-8")) == role
    }
    best = max(same, key=lambda path: same[path])
    return best.with_name(best.name.replace("prompt", "reply"))


def _role(prompt: str) -> str:
    return prompt.split("a question of the ", 1)[1].split("\n", 1)[0]


def _learned(run: Run, design: DesignFolder, steps: int, recipe: Recipe) -> Row:
    """Train a design and evaluate its policy; a design without a scene is neither valid nor successful."""
    task, concept = run.asked().task, design.iterations[0].concept.read()
    assert concept is not None
    if not design.final_scene.path.exists():
        return Row(task, concept.name, 0, 0.0, None)
    folder = design.path / "training" / f"{steps}{'-from-probe' * recipe.from_probe}"
    result = train(find_scene(design).for_learning("auto"), folder, steps=steps, recipe=recipe)
    done = folder / "evaluation.json"
    known = Evaluation.model_validate_json(done.read_text(encoding="utf-8")) if done.exists() else None
    row = Row(task, concept.name, result.steps, result.wall_s, known or evaluate_training(folder))
    sys.stdout.write(_line(row) + "\n")
    sys.stdout.flush()
    return row


def table(rows: list[Row], command: str) -> str:
    """Return the page as Markdown."""
    verdicts = [row.verdict for row in rows]
    valid, successful = (Rate(sum(bool(v and getattr(v, n)) for v in verdicts), len(rows)) for n in _VERDICTS)
    lines = [
        "# What the language model's robots learn",
        "",
        f"Made by `{command}` from the recorded replies, level standard, one seed; the benchmark's budget is "
        f"{BUDGET_STEPS:,} control steps.{_judged(verdicts)}",
        "",
        "| task | concept | valid | successful | episodes won | progress | control steps | training, wall s |",
        "|---|---|---|---|---|---|---|---|",
        *(_line(row) for row in rows),
        "",
        f"Valid: {_told(valid)}. Successful: {_told(successful)}. Intervals: Wilson, 95 %.",
    ]
    return "\n".join(lines) + "\n"


def _judged(verdicts: Sequence[Evaluation | None]) -> str:
    """Return in words the versions of the benchmark and the numbers of episodes that evaluated the policies."""
    found = {(each.benchmark_version, len(each.episodes)) for each in verdicts if each}
    return "".join(f" Version {v} of the benchmark, {n} held-out episodes a policy." for v, n in sorted(found))


_VERDICTS = ("valid", "successful")


def _line(row: Row) -> str:
    verdict = row.verdict
    if verdict is None:
        return f"| {row.task} | {row.concept} | no | no | | | | |"
    progress = fmean(episode.best_progress for episode in verdict.episodes)
    said = ["yes" if getattr(verdict, name) else "no" for name in _VERDICTS]
    won = [f"{verdict.success_share:.0%}", f"{progress:.2f}", f"{row.steps:,}", f"{row.wall_s:.0f}"]
    return "| " + " | ".join([row.task, row.concept, *said, *won]) + " |"


def _told(rate: Rate) -> str:
    interval = rate.interval
    return f"{rate.hits} of {rate.of} ({interval.low:.0%} to {interval.high:.0%})"


if __name__ == "__main__":
    main()
