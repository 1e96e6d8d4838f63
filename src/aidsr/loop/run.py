"""From what a person asks for to a run folder, and from a run folder to the parts that work on it."""

from __future__ import annotations

import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from aidsr.core.artifacts import Brief
from aidsr.core.errors import MjcfError, UserError
from aidsr.loop.ablations import without
from aidsr.loop.early_stop import keep_trying, same_again
from aidsr.loop.human import DecisionFile, Said, approve_at_once
from aidsr.loop.parts import Parts, Person
from aidsr.loop.runner import Listen, work
from aidsr.loop.task_trial import check_trial, trial_of
from aidsr.loop.teams import BUILTIN, check_model, from_anywhere, team_of
from aidsr.runs import Budget, EventLog, Run, RunConfig, RunRecord, new_run
from aidsr.runs.files import replace_file

if TYPE_CHECKING:
    from aidsr.tasks import Level

__all__ = ["BUILTIN", "brief_for", "design", "give_budget", "parts_of", "resume", "start"]


_VERSIONS_OF = ("aidsr", "mujoco", "numpy", "pydantic-ai-slim")


def design(
    objective: str = "",
    *,
    task: str = "",
    level: Level = "standard",
    environment: str | Path = "",
    robot: str | Path = "",
    goal: str | Path = "",
    model: str = BUILTIN,
    concepts: int = 3,
    iterations: int = 8,
    max_output_tokens: int = 20_000,
    seed: int = 0,
    repairs: bool = True,
    early_stop: bool = True,
    judge_pictures: bool = False,
    task_feedback: bool = False,
    task_rounds: int = 2,
    task_training: int = 0,
    human: bool = False,
    budget: Budget | None = None,
    runs: str | Path = "runs",
    listen: Listen = lambda _design, _event: None,
) -> Run:
    """Design robots for a task, or for an objective in words, and return the finished run.

        run = aidsr.design(task="button_pushing", seed=1)
        print(run.summary)                              # the page to open
        scene = run.design(1).final_scene.read()        # MJCF, None if design 1 was not approved

    Args:
        objective: What the robot should do, in plain words; needs `environment`.
        task: Name of a benchmark task instead; it brings objective and environment.
        level: Level of the task.
        environment: The environment without a robot: a path, or the MJCF itself.
        robot: A robot to start from: a path, or the MJCF itself.
        goal: File that says how success is measured in that environment (docs/environments.md); kept with the run.
        model: "builtin" for the rules, or a language model's name, for example "openai:gpt-5" (see docs/models.md).
        concepts: How many designs to grow.
        iterations: Repairs allowed after the first attempt, per concept and round.
        max_output_tokens: Cap on the output of one call to a language model.
        seed: Seed of the built-in rules.
        repairs: Put right by code what can mean only one thing in a robot (see docs/validation.md), before it is
            validated; neither a call nor an iteration is spent on that.
        early_stop: End a design when a role is asked for the same again and nothing got better, before its iterations
            are used up.
        judge_pictures: Show the Judge pictures of the scene, which must be a language model that takes images.
        task_feedback: Try each scene that the Judge passed on its task by open-loop motions, and send it back to the
            role to blame where it falls short (see docs/learning.md); needs a task or a goal.
        task_rounds: How often a design may go back for that.
        task_training: Control steps of a policy's training whose result is told beside each trial; 0 trains none.
        budget: What a language model may use, in tokens and money, for the run and for each design; without a limit by
            default. A call that could exceed it is not made, and its design ends as "out_of_budget".
        human: Wait for a person's decision.json after each scene the Judge passed.
        runs: Folder in which the run's folder is made.
        listen: Told of every event as it happens: number of the design (0 for the run), event.

    Raises:
        UserError: Something asked for does not exist or does not fit together.
        ModelError: The language model could not be reached before there were concepts.
    """
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
        budget=budget or Budget(),
    )
    brief = brief_for(objective, task=task, level=level, environment=environment, robot=robot, goal=goal)
    run = start(brief, config, level=level if task else "", runs=runs, goal=goal)
    return work(run, parts_of(run), listen)


def resume(run: str | Path, listen: Listen = lambda _design, _event: None, *, budget: Budget | None = None) -> Run:
    """Go on with a run that was stopped or killed, and return it. No answered call is asked again.

    Args:
        run: Folder of the run.
        listen: As for `design`.
        budget: Holds from now on, what was spent before included; designs that ran out of budget go on.

    Raises:
        UserError: The folder is not a run, another process is at work on it, or the budget cannot be kept.
        ModelError: The language model could not be reached before there were concepts.
    """
    found = Run(Path(run))
    if budget is not None:
        give_budget(found, budget)
    return work(found, parts_of(found), listen)


def give_budget(run: Run, budget: Budget) -> None:
    """Let another budget hold for a run, and take its designs that ran out of the last one up again.

    Raises:
        UserError: Money is limited and the model's price is not known, or a process is at work on the run.
    """
    check_model(run.asked().config, budget)
    with EventLog(run.events):
        replace_file(run.larger_budget, budget.model_dump_json(indent=2).encode() + b"\n")
        for design in run.designs:
            design.reopen()


def brief_for(
    objective: str = "",
    *,
    task: str = "",
    level: Level = "standard",
    environment: str | Path = "",
    robot: str | Path = "",
    goal: str | Path = "",
) -> Brief:
    """Return the job to be given to a team; the arguments are those of `design`.

    Raises:
        UserError: Something asked for does not exist or does not fit together.
    """
    from aidsr.sandbox.pool import warm_up

    warm_up()  # a worker starts while the rest is imported
    from aidsr.sim.environment_summary import summarize_environment
    from aidsr.tasks import goal_task, load_task, read_goal

    starting_robot = _mjcf(robot, "robot") if robot else ""
    if task:
        if objective or environment or goal:
            raise UserError(
                f'the task "{task}" brings its own objective, environment and goal; give either it or yours'
            )
        return load_task(task, level).brief().model_copy(update={"starting_robot": starting_robot})
    if not objective.strip():
        raise UserError("a task or an objective in words was expected; name one of `aidsr tasks`, or say what to do")
    if not environment:
        raise UserError(
            "an objective in words needs a place; give an environment, the MJCF of everything but the robot"
        )
    mjcf = _mjcf(environment, "environment")
    try:
        summary = summarize_environment(mjcf)
    except MjcfError as error:
        raise UserError(f"the environment cannot be loaded: {error}") from None
    brief = Brief(objective=objective.strip(), environment=mjcf, summary=summary, starting_robot=starting_robot)
    if not goal:
        return brief
    aim = goal_task(read_goal(goal), mjcf)
    return brief.model_copy(update={"base": aim.base, "needs_contact": aim.needs_contact, "judging": aim.judging()})


def start(
    brief: Brief,
    config: RunConfig,
    *,
    level: Level | Literal[""] = "",
    runs: str | Path = "runs",
    goal: str | Path = "",
) -> Run:
    """Make the folder of a new run; `work` then does it.

    Raises:
        UserError: The model's name is not understood or lacks its key, there is no task to give feedback, or the
            folder cannot be made.
    """
    check_model(config, config.budget)
    check_trial(config, measured=bool(brief.task or goal))
    record = RunRecord(
        objective=brief.objective,
        task=brief.task,
        level=level,
        config=config,
        started=datetime.now(UTC).astimezone().isoformat(timespec="seconds"),
        versions={"python": platform.python_version(), **{name: _version(name) for name in _VERSIONS_OF}},
    )
    return new_run(Path(runs), record, brief, Path(goal).read_bytes() if goal else b"")


def parts_of(run: Run) -> Parts:
    """Return the real parts for a run, as its run.json asks for them.

    Raises:
        UserError: The folder is not a run, or its model lacks its key.
    """
    from aidsr.render.pictures import filmstrip, picture
    from aidsr.sim.assembly import assemble
    from aidsr.tasks import load_task
    from aidsr.validation import validate
    from aidsr.validation.repairs import leave_as_written, repair

    record = run.asked()
    team_for, interrupt = team_of(run, record.config)
    sensors = load_task(record.task, record.level or "standard").sensors if record.task else ()
    parts = Parts(
        team_for=team_for,
        repair=repair if record.config.repairs else leave_as_written,
        validate=validate,
        assemble=lambda robot, environment, placement: assemble(robot, environment, placement, sensors),
        picture=picture,
        filmstrip=filmstrip,
        person=_person(record.config),
        try_out=trial_of(run) if record.config.task_feedback else None,
        task_rounds=record.config.task_rounds,
        stalled=same_again if record.config.early_stop else keep_trying,
        interrupt=interrupt,
    )
    return without(parts, record.config.method)


def _person(config: RunConfig) -> Person:
    if config.human:
        return DecisionFile()
    return Said(config.feedback) if config.feedback else approve_at_once


def _mjcf(source: str | Path, what: str) -> str:
    """Return the MJCF that `source` is or names."""
    if isinstance(source, str) and source.lstrip().startswith("<"):
        return source
    try:
        return Path(source).read_text(encoding="utf-8")
    except FileNotFoundError:
        raise UserError(f"the {what} {source} does not exist; give the path of an MJCF file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"the {what} {source} cannot be read as text ({error}); give an MJCF file") from None


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
