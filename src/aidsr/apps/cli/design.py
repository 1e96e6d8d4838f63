"""`aidsr design`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from aidsr.apps.cli.spending import Limits, print_estimate

__all__ = ["design"]


def design(
    objective: str | None = None,
    /,
    *,
    task: str | None = None,
    level: Literal["standard", "hard"] = "standard",
    environment: Path | None = None,
    robot: Path | None = None,
    goal: Path | None = None,
    model: str = "builtin",
    concepts: Annotated[int, Parameter(validator=Number(gte=1, lte=20))] = 3,
    iterations: Annotated[int, Parameter(validator=Number(gte=0, lte=100))] = 8,
    max_output_tokens: Annotated[int, Parameter(validator=Number(gte=256))] = 20_000,
    seed: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    repairs: bool = True,
    early_stop: bool = True,
    judge_pictures: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    task_feedback: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    task_rounds: Annotated[int, Parameter(validator=Number(gte=1, lte=10))] = 2,
    task_training: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    human: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    limits: Limits | None = None,
    train: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    steps: Annotated[int, Parameter(validator=Number(gte=1))] = 300_000,
    seeds: Annotated[int, Parameter(validator=Number(gte=1, lte=100))] = 1,
    dry_run: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    runs: Path = Path("runs"),
) -> int:
    """Design robots for a task or for an objective in words.

    Exit code 0 means that at least one design was approved (with --train: is successful), 1 that none was, 2 a mistake
    in the command.

        aidsr design --task button_pushing

        aidsr design --task simple_grasping --model openai:gpt-5 --human

        aidsr design "turn the knob by a quarter" --environment knob.xml

    Parameters
    ----------
    objective
        What the robot should do, in plain words; needs --environment.
    task
        A benchmark task instead, see `aidsr tasks`; it brings objective and environment.
    level
        Level of the task.
    environment
        MJCF of the place where it is to be done, without a robot.
    robot
        MJCF of a robot to start from.
    goal
        File that says how success is measured in that environment, so that the designs can be probed and trained.
    model
        Who designs: "builtin" for the rules, which need no key, or a language model, for example openai:gpt-5,
        anthropic:…, google:…, openrouter:…, ollama:…, or MODEL@URL of a compatible server, manual:DIRECTORY to
        answer in files, replay:RUN to hear a recorded run's answers again. Only a model named here is
        ever paid for.
    concepts
        How many designs to grow side by side.
    iterations
        Repairs allowed after the first attempt of each.
    max_output_tokens
        Cap on the output of one call to a language model, reasoning included.
    seed
        Seed of the built-in rules; the same seed gives the same robots.
    repairs
        Put right by code what can mean only one thing in a robot, before it is validated; that costs neither a call
        nor an iteration.
    early_stop
        End a design when a role is asked for the same again and nothing got better, before its iterations are used up.
    judge_pictures
        Show the Judge pictures of the scene; only for a model that takes images.
    task_feedback
        Try each scene that the Judge passed on its task without learning, and send it back to the role to blame where
        it falls short; needs a task or a goal.
    task_rounds
        How often a design may go back for that.
    task_training
        Control steps of a policy's training whose result is told beside each trial; needs --task-feedback and the
        extra "rl".
    human
        Ask a person about each scene that the Judge passed: approve, refine or quit.
    train
        Then teach each approved design its task, and judge it.
    steps
        Budget of control steps of each training.
    seeds
        Policies trained for each approved design.
    dry_run
        Only check what is asked for and say what it will about cost.
    runs
        Folder in which the folder of the run is made.
    """
    from aidsr.apps.cli.following import follow
    from aidsr.apps.cli.teaching import train_designs
    from aidsr.core.extras import require_extra
    from aidsr.loop import BUILTIN, brief_for, parts_of, start
    from aidsr.loop.task_trial import check_trial
    from aidsr.loop.teams import check_model, from_anywhere
    from aidsr.runs import RunConfig

    _check_measure(task, level, goal, train=train)
    if train:
        require_extra("rl", "training")
    config = RunConfig(
        model=from_anywhere(model),
        concepts=concepts,
        iterations=iterations,
        max_output_tokens=max_output_tokens,
        seed=seed,
        repairs=repairs,
        early_stop=early_stop,
        judge_pictures=judge_pictures,
        task_feedback=task_feedback,
        task_rounds=task_rounds,
        task_training=task_training,
        human=human,
        budget=(limits or Limits()).budget(),
    )
    brief = brief_for(
        objective or "", task=task or "", level=level, environment=environment or "", robot=robot or "", goal=goal or ""
    )
    if dry_run:
        check_model(config, config.budget)
        check_trial(config, measured=bool(brief.task or goal))
    if config.model != BUILTIN or dry_run:
        print_estimate(config, runs)
    if dry_run:
        return 0
    run = start(brief, config, level=level if brief.task else "", runs=runs, goal=goal or "")
    code = follow(run, parts_of(run))
    return train_designs(run, steps=steps, seeds=seeds) if train and code == 0 else code


def _check_measure(task: str | None, level: str, goal: Path | None, *, train: bool) -> None:
    """Refuse what could only go wrong after the designs were made.

    Raises:
        UserError: Nothing measures success for a training, or a level is asked of something else than a task.
    """
    from aidsr.core.errors import UserError

    if train and not (task or goal):
        raise UserError("--train needs a measure of success; name a task with --task, or give a goal file with --goal")
    if level == "hard" and not task:
        raise UserError("only tasks come at levels, and none is named; give a --task, or leave --level out")
