"""`aidsr design`."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from aidsr.apps.cli.flag import Flag
from aidsr.apps.cli.options import Options, options_for
from aidsr.apps.cli.spending import Limits, print_estimate
from aidsr.core.config import BUDGET_STEPS, BUILTIN, RunConfig, run_settings

if TYPE_CHECKING:
    Settings = Options[RunConfig]
else:
    Settings = options_for(RunConfig, run_settings())


def design(
    objective: str | None = None,
    /,
    *,
    task: str | None = None,
    level: Literal["standard", "hard"] = "standard",
    environment: Path | None = None,
    robot: Path | None = None,
    goal: Path | None = None,
    settings: Settings | None = None,
    limits: Limits | None = None,
    train: Flag = False,
    steps: Annotated[int, Parameter(validator=Number(gte=1))] = BUDGET_STEPS,
    seeds: Annotated[int, Parameter(validator=Number(gte=1, lte=100))] = 1,
    dry_run: Flag = False,
    runs: Path = Path("runs"),
) -> int:
    """Design robots for a task or for an objective in words.

    Exit code 0: at least one design was approved (with --train: at least one policy is successful). 1: none. 2: a
    mistake in the command.

        aidsr design --task button_pushing

        aidsr design --task simple_grasping --model openai:gpt-5 --human

        aidsr design "turn the knob by a quarter" --environment knob.xml

    Parameters
    ----------
    objective
        What the robot should do, in plain words and in quotes; requires --environment. Leave it out with --task.
    task
        Benchmark task, with its own objective, environment and goal; `aidsr tasks` lists the tasks.
    level
        Level of the task.
    environment
        MJCF of the environment, without a robot.
    robot
        MJCF of a robot to start from.
    goal
        TOML file that defines how success is measured in the environment; needed to probe and train the designs.
    train
        Train and evaluate a policy for each approved design.
    steps
        With --train: maximum control steps (actions) for each policy.
    seeds
        With --train: number of policies to train for each approved design.
    dry_run
        Check the command, print the estimated cost and exit.
    runs
        Folder in which the run folder is created.
    """
    from aidsr.apps.cli.progress import follow_run
    from aidsr.apps.cli.training import train_designs
    from aidsr.core.extras import require_extra
    from aidsr.loop.run import check_memory, create_run, make_brief, parts_of
    from aidsr.loop.task_trial import check_trial
    from aidsr.loop.teams import check_effects, check_model
    from aidsr.teams.providers import absolute_name

    _check_measure(task, level, goal, train=train)
    if train:
        require_extra("rl", "training")
    config = (settings or Settings()).value(budget=(limits or Limits()).value())
    config = config.updated({"model": absolute_name(config.model)})
    check_effects(config)
    brief = make_brief(
        objective or "", task=task or "", level=level, environment=environment or "", robot=robot or "", goal=goal or ""
    )
    if config.model != BUILTIN or dry_run:
        check_model(config, config.budget)
        check_memory(config)
        check_trial(config, measured=bool(brief.task or goal))
        print_estimate(config, runs)
    if dry_run:
        return 0
    run = create_run(brief, config, level=level if brief.task else "", runs=runs, goal=goal or "")
    training = ["aidsr", "train", str(run.path / "designs" / "N"), "--steps", str(steps), "--seeds", str(seeds)]
    code = follow_run(run, parts_of(run, trust=True), then=shlex.join(training) if train else "")
    return train_designs(run, steps=steps, seeds=seeds) if train and code == 0 else code


def _check_measure(task: str | None, level: str, goal: Path | None, *, train: bool) -> None:
    """Check, before designing, options that would otherwise fail only afterwards.

    Raises:
        UserError: A training has no measure of success, or a level is given without a task.
    """
    from aidsr.core.errors import UserError

    if train and not (task or goal):
        raise UserError(
            "--train requires a measure of success; name a task with --task, or give a goal file with --goal"
        )
    if level == "hard" and not task:
        raise UserError("--level requires a task; name one with --task, or leave --level out")
