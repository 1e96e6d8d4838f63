"""`design` and `resume`: create a run folder from a request, and the parts of the loop from a run folder."""

from __future__ import annotations

import platform
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from aidsr.core.arguments import check_type
from aidsr.core.artifacts import Brief
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import MjcfError, UserError
from aidsr.core.text_files import read_text_file
from aidsr.loop.ablations import ablate
from aidsr.loop.early_stop import never_stop, no_progress
from aidsr.loop.human import DecisionFile, PresetFeedback, approve
from aidsr.loop.parts import Parts, Person
from aidsr.loop.runner import Listen, run_designs
from aidsr.loop.scene_pictures import motion_view
from aidsr.loop.task_trial import check_trial, measure_again, trial_of
from aidsr.loop.teams import check_effects, check_model, model_name, require_object, team_of
from aidsr.memory import Memory
from aidsr.runs import EventLog, Run, RunRecord, new_run
from aidsr.runs.files import replace_file
from aidsr.runs.folders import as_run
from aidsr.runs.origin import require_ours
from aidsr.teams.providers import absolute_name, connect, destination
from aidsr.teams.providers.replay import REPLAY, ReplayedModel

if TYPE_CHECKING:
    from aidsr.core.model import Model
    from aidsr.tasks import Level

_NEEDED_BY_WORKERS = ("aidsr.sim.environment_summary", "aidsr.fixes", "aidsr.validation.engine", "aidsr.sim.assembly")
_VERSIONS_OF = ("aidsr", "mujoco", "numpy", "pydantic-ai-slim")


def design(
    objective: str = "",
    *,
    task: str = "",
    level: Level = "standard",
    environment: str | Path = "",
    robot: str | Path = "",
    goal: str | Path = "",
    model: str | Model | None = None,
    config: RunConfig | None = None,
    runs: str | Path = "runs",
    listen: Listen = lambda _design, _event: None,
    **settings: Any,
) -> Run:
    """Design robots for a task, or for an objective in words, and return the finished run.

        run = aidsr.design(task="button_pushing", seed=1, concepts=2)
        print(run.summary)                              # the page to open
        scene = run.design(1).final_scene.read()        # MJCF, None if design 1 was not approved

    Args:
        objective: What the robot should do, in plain words; requires `environment`.
        task: Name of a benchmark task instead; it defines objective and environment.
        level: Level of the task.
        environment: The environment without a robot: a path, or the MJCF itself.
        robot: A robot to start from: a path, or the MJCF itself.
        goal: File that defines how success is measured in that environment (docs/goals.md); stored with the run.
        model: "builtin" for the rules, a language model's name, for example "openai:gpt-5" (see docs/models.md), or any
            object with a `name` and a method `ask` (see `aidsr.Model`).
        config: Settings of the run; default settings if None.
        runs: Folder in which the run's folder is created.
        listen: Called with every event as it happens: number of the design (0 for the run), event.
        **settings: Fields of `RunConfig` that replace those of `config`.

    Raises:
        UserError: Something requested does not exist or is not compatible.
        ModelError: The language model could not be reached before there were concepts.
    """
    config = (config or RunConfig()).updated(settings)
    if model is not None:
        config = config.updated({"model": model if isinstance(model, str) else model_name(model)})
    config = config.updated({"model": absolute_name(config.model)})
    client = None if model is None or isinstance(model, str) else model
    check_effects(config, client)
    brief = make_brief(objective, task=task, level=level, environment=environment, robot=robot, goal=goal)
    run = create_run(brief, config, level=level if task else "", runs=runs, goal=goal, model=client)
    return run_designs(run, parts_of(run, client, trust=True), listen)


def resume(
    run: str | Path | Run,
    listen: Listen = lambda _design, _event: None,
    *,
    budget: Budget | None = None,
    model: str | Model | None = None,
    trust: bool = False,
) -> Run:
    """Continue a run that was stopped or killed, and return it. Answered model calls are not repeated.

        run = aidsr.resume("runs/2026-01-31_1002_button_pushing_7f3a")

    Args:
        run: The run, or its folder.
        listen: As for `design`.
        budget: New budget of the run, which includes what was already spent; designs that ran out of budget continue.
        model: Model object, required for a run that was designed by one: the same object, or another with the same
            name.
        trust: Whether a run that was not made on this machine may send its prompts, and a key, to the address in its
            run.json; see docs/safety.md.

    Raises:
        ForeignFolderError: The run was not made on this machine, its prompts leave this process, and `trust` is false.
        UserError: The folder is not a run, another process works on it, the budget cannot be enforced, or the model is
            not that of the run.
        ModelError: The language model could not be reached before there were concepts.
    """
    found = as_run(run)
    client = _same_model(found, model)
    require_object(found, client)
    if client is None:
        require_run_is_ours(found, trust=trust)
    if budget is not None:
        replace_budget(found, budget, client)
    return run_designs(found, parts_of(found, client, trust=trust), listen)


def require_run_is_ours(run: Run, *, trust: bool) -> None:
    """Refuse to resume a run that was not made on this machine and sends prompts elsewhere, unless its user trusts it.

    Raises:
        ForeignFolderError: It is such a run, and `trust` is false.
        UserError: The folder is not a run.
    """
    require_ours(run.record.path, [destination(run.asked().config.model)], trust=trust)


def _same_model(run: Run, model: str | Model | None) -> Model | None:
    """Return the model object with which to resume a run; None if its recorded name is enough.

    Raises:
        UserError: The model is not that of the run.
    """
    if model is None:
        return None
    name, recorded = model if isinstance(model, str) else model_name(model), run.asked().config.model
    if name not in (recorded, absolute_name(recorded)) and absolute_name(name) != recorded:
        raise UserError(f"{run.path} was designed by {recorded}, not by {name}; resume it with the same model")
    return None if isinstance(model, str) else model


def replace_budget(run: Run, budget: Budget, model: Model | None = None) -> None:
    """Replace the budget of a run, and reopen the designs that ran out of the previous budget.

    Args:
        run: The run.
        budget: New budget, which includes what was already spent.
        model: Model object that designs, if the run was started with one.

    Raises:
        UserError: Cost is limited and the model's price is unknown, or a process works on the run.
    """
    require_object(run, model)
    check_model(run.asked().config, budget, model)
    with EventLog(run.events):
        replace_file(run.larger_budget, budget.model_dump_json(indent=2).encode() + b"\n")
        for design in run.designs:
            design.reopen()


def make_brief(
    objective: str = "",
    *,
    task: str = "",
    level: Level = "standard",
    environment: str | Path = "",
    robot: str | Path = "",
    goal: str | Path = "",
) -> Brief:
    """Return the brief of a run; the arguments are those of `design`.

    Raises:
        UserError: Something requested does not exist or is not compatible.
    """
    from aidsr.sandbox.pool import warm_up

    warm_up(2, _NEEDED_BY_WORKERS)  # the workers start while the rest is imported
    from aidsr.sim.environment_summary import summarize_environment
    from aidsr.tasks import goal_task, load_task, read_goal

    starting_robot = mjcf_text(robot, "robot") if robot else ""
    if robot and not starting_robot.strip():
        raise UserError(f"the robot {robot} is empty; give the MJCF of a robot, or leave it out")
    if robot and "<mujoco" not in starting_robot:
        name = "" if starting_robot == robot else f" {robot}"
        raise UserError(f"the robot{name} is not MJCF: it has no element <mujoco>; give the MJCF of a robot")
    if task:
        if objective or environment or goal:
            raise UserError(
                f'the task "{task}" has its own objective, environment and goal; give either the task or your own'
            )
        return load_task(task, level).brief().model_copy(update={"starting_robot": starting_robot})
    if not objective.strip():
        raise UserError("no task and no objective given; name a task of `aidsr tasks`, or say what the robot should do")
    if not environment:
        raise UserError("an objective in words requires an environment; give its MJCF without a robot")
    mjcf = mjcf_text(environment, "environment")
    try:
        summary = summarize_environment(mjcf)
    except MjcfError as error:
        name = "" if mjcf == environment else f" {environment}"
        raise UserError(f"the environment{name} cannot be loaded: {error}") from None
    brief = Brief(objective=objective.strip(), environment=mjcf, summary=summary, starting_robot=starting_robot)
    if not goal:
        return brief
    aim = goal_task(read_goal(goal), mjcf)
    return brief.model_copy(update={"base": aim.base, "needs_contact": aim.needs_contact, "judging": aim.judging()})


def create_run(
    brief: Brief,
    config: RunConfig,
    *,
    level: Level | Literal[""] = "",
    runs: str | Path = "runs",
    goal: str | Path = "",
    model: Model | None = None,
) -> Run:
    """Create the folder of a new run; `run_designs` then works on it.

    Args:
        brief: Brief of the designs.
        config: Settings of the run.
        level: Level of the task; empty without a task.
        runs: Folder in which the run's folder is created.
        goal: File of a goal, stored with the run.
        model: Model object that designs; None if its name in `config` is enough to connect to it.

    Raises:
        UserError: The model's name is not understood or lacks its key, there is no task to give feedback, or the folder
            cannot be created.
    """
    check_model(config, config.budget, model)
    check_trial(config, measured=bool(brief.task or goal))
    brief = brief.model_copy(update={"lessons": _lessons(config, brief, level)})
    record = RunRecord(
        objective=brief.objective,
        task=brief.task,
        level=level,
        config=config,
        model_object=model is not None,
        started=datetime.now(UTC).astimezone().isoformat(timespec="seconds"),
        versions={"python": platform.python_version(), **{name: _version(name) for name in _VERSIONS_OF}},
    )
    return new_run(Path(runs), record, brief, Path(goal).read_bytes() if goal else b"")


def check_memory(config: RunConfig) -> None:
    """Refuse a memory file that does not exist.

    Raises:
        UserError: The file does not exist.
    """
    if config.memory and not Path(config.memory).is_file():
        path = config.memory
        raise UserError(f"the memory {path} does not exist; make it with aidsr memory add {path} RUN")


def _lessons(config: RunConfig, brief: Brief, level: str) -> tuple[str, ...]:
    """Return the lessons of the run's memory for its designer; a replay gets those of the recorded run.

    Raises:
        UserError: The memory does not exist, or the file is not a memory.
    """
    if isinstance(recorded := _replayed(config), ReplayedModel):
        return recorded.run.brief().lessons
    if not config.memory:
        return ()
    path = Path(config.memory)
    check_memory(config)
    without = (brief.task,) if config.memory_without_task else ()
    return Memory(path).tell(brief.objective, brief.base, level=level, without=without)


def _replayed(config: RunConfig) -> Model | None:
    """Return the model that replays a recorded run; None for another model."""
    return connect(config.model) if config.model.startswith(f"{REPLAY.prefix}:") else None


def parts_of(run: Run, model: Model | None = None, *, trust: bool = False) -> Parts:
    """Return the parts of the loop for a run, according to its run.json.

    Args:
        run: The run.
        model: Model object that designs, if the run was started with one.
        trust: Whether the caller has just created the run, or its user has confirmed where its prompts are sent.

    Raises:
        ForeignFolderError: The run was not made on this machine, its prompts leave this process, and `trust` is false.
        UserError: The folder is not a run, its model lacks its key, or it is an object that is not given.
    """
    from aidsr.fixes import fix, leave_as_written
    from aidsr.render.pictures import filmstrip, picture
    from aidsr.sim.assembly import assemble
    from aidsr.tasks import load_task
    from aidsr.validation import validate

    record = run.asked()
    team_for, interrupt = team_of(run, model, trust=trust)
    sensors = load_task(record.task, record.level or "standard").sensors if record.task else ()
    parts = Parts(
        team_for=team_for,
        repair=fix if record.config.repairs else leave_as_written,
        validate=validate,
        assemble=lambda robot, environment, placement: assemble(robot, environment, placement, sensors),
        picture=picture,
        filmstrip=partial(filmstrip, view=motion_view(run)),
        person=_person(record.config),
        try_on_task=trial_of(run) if record.config.task_feedback else None,
        measure_again=measure_again(run) if record.config.task_feedback else None,
        task_rounds=record.config.task_rounds,
        stalled=no_progress if record.config.early_stop else never_stop,
        interrupt=interrupt,
    )
    return ablate(parts, record.config.method)


def _person(config: RunConfig) -> Person:
    if config.human:
        return DecisionFile()
    return PresetFeedback(config.feedback) if config.feedback else approve


def mjcf_text(source: str | Path, what: str) -> str:
    """Return MJCF text that is given directly or as the path of a file.

    Raises:
        TypeError: `source` is neither text nor a path.
        UserError: The file cannot be read.
    """
    from aidsr.mjcf.read import SIZE_LIMITS, is_mjcf_text

    check_type(source, (str, Path), f"the {what} must be MJCF text or the path of a file")
    if is_mjcf_text(source):
        return source
    try:
        return read_text_file(Path(source), max_bytes=SIZE_LIMITS.characters)
    except FileNotFoundError:
        raise UserError(f"the {what} {source} does not exist; give the path of an MJCF file") from None
    except OSError as error:
        raise UserError(f"the {what} {source} cannot be read ({error.strerror}); give an MJCF file") from None


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
