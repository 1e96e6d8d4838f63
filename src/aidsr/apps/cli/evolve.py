"""`aidsr evolve`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from aidsr.apps.cli.options import Options, options_for
from aidsr.apps.cli.spending import Limits
from aidsr.core.config import RunConfig, run_settings

_SET_HERE = ("task_feedback", "memory", "human")
"""Settings that are not options of `aidsr evolve`, because an evolution sets them itself."""
if TYPE_CHECKING:
    Settings = Options[RunConfig]
else:
    Settings = options_for(RunConfig, {name: field for name, field in run_settings().items() if name not in _SET_HERE})


def evolve(
    objective: str | None = None,
    /,
    *,
    task: str | None = None,
    level: Literal["standard", "hard"] = "standard",
    environment: Path | None = None,
    goal: Path | None = None,
    settings: Settings | None = None,
    limits: Limits | None = None,
    generations: Annotated[int, Parameter(validator=Number(gte=1, lte=1000))] = 5,
    train: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    steps: Annotated[int, Parameter(validator=Number(gte=1))] = 60_000,
    out: Path = Path("evolution"),
) -> int:
    """Design over several generations: each one uses the measurements of the best and most informative earlier robots.

    Every stable scene is tested on its task without learning. The evolution ends when a robot succeeds in every search
    (with --train: when a valid policy succeeds in half of its development episodes), after the last generation, or when
    the budget is used up. To continue a stopped evolution, repeat the command; --generations may then be larger. Exit
    code 0: a robot succeeds. 1: none does.

        aidsr evolve --task gap --generations 3 --model openai:gpt-5

        aidsr evolve --task tunnel --model openai:gpt-5 --train 1 --max-tokens 500000

    Parameters
    ----------
    objective
        What the robot should do, in plain words and in quotes; requires --environment and --goal. Leave it out with
        --task.
    task
        Benchmark task, with its own objective, environment and goal; `aidsr tasks` lists the tasks.
    level
        Level of the task.
    environment
        MJCF of the environment, without a robot.
    goal
        TOML file that defines how success is measured in the environment.
    generations
        Maximum number of generations.
    train
        Number of designs per generation that get a short training, among those that did the decisive part of their task
        when they were tested without learning.
    steps
        With --train: maximum control steps (actions) for each policy.
    out
        Folder of the evolution: its runs, its archive (for `aidsr design --memory`) and report.md.
    """
    from aidsr.apps.cli.mailbox import Mailbox
    from aidsr.apps.cli.progress import Lines
    from aidsr.apps.cli.terminal import make_console, write
    from aidsr.evolution import evolve as work_on
    from aidsr.teams.providers import absolute_name

    config = (settings or Settings()).value(budget=(limits or Limits()).value())
    console = make_console()
    try:
        with Lines(console) as lines, Mailbox(console, absolute_name(config.model)):
            evolution = work_on(
                objective or "",
                task=task or "",
                level=level,
                environment=environment or "",
                goal=goal or "",
                config=config,
                generations=generations,
                train=train,
                steps=steps,
                out=out,
                listen=lambda line: write(f"{line}\n"),
                follow=lines.on_event,
            )
    except KeyboardInterrupt:
        write(f"\nInterrupted. Finished work is kept in {out}; repeat the command to continue\n")
        return 130
    if evolution.best is None:
        write(f"Nothing was measured: no scene was stable. See {out}/runs\n")
        return 1
    write(f"Best result: {evolution.best.text()}\n")
    write(f"Report: {out}/report.md; lessons: {out}/archive.jsonl\n")
    return 0 if evolution.done else 1
