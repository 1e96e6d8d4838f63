"""`evolve`: design over several generations, each told what the earlier ones measured."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aidsr.core.arguments import check_type, check_whole_number
from aidsr.core.config import RunConfig, checked
from aidsr.evolution.generations import Evolution, Plan, begin, run_generations
from aidsr.loop.runner import Listen
from aidsr.loop.teams import check_effects
from aidsr.teams.providers import absolute_name, is_offline

if TYPE_CHECKING:
    from aidsr.tasks import Level

_NO_LESSONS = (
    "The built-in rules read no lessons: each generation only searches with another seed. "
    "Name a language model to use what was measured"
)


def evolve(
    objective: str = "",
    *,
    task: str = "",
    level: Level = "standard",
    environment: str | Path = "",
    goal: str | Path = "",
    config: RunConfig | None = None,
    generations: int = 5,
    train: int = 0,
    steps: int = 60_000,
    out: str | Path = "evolution",
    listen: Callable[[str], None] = lambda _line: None,
    follow: Listen = lambda _design, _event: None,
    **settings: Any,
) -> Evolution:
    """Design over several generations, each told what the earlier ones measured, and return the evolution.

    Every stable scene is tested on its task without learning. The evolution ends when a robot succeeds in every search
    (with `train`: when a valid policy succeeds in half of its development episodes), after the last generation, or when
    the budget is spent. Repeat the same call to continue a stopped evolution; `generations` may then be larger.

        evolution = aidsr.evolve(task="gap", model="openai:gpt-5", generations=3)
        print(evolution.done, evolution.best.text())
        run = aidsr.design(task="gap", model="openai:gpt-5", memory=str(evolution.archive.path))

    Args:
        objective: What the robot should do, in plain words; requires `environment` and `goal`.
        task: Name of a benchmark task instead; it defines objective, environment and goal.
        level: Level of the task.
        environment: The environment without a robot: a path, or the MJCF itself.
        goal: File that defines how success is measured in that environment (docs/goals.md).
        config: Settings of each generation's run; default settings if None. `task_feedback` is always on, the seed
            grows by 1 with each generation, and the budget is shared by all.
        generations: Maximum number of generations.
        train: Number of designs per generation that get a short training, among those whose trial reaches the decisive
            stage.
        steps: Control steps of each short training.
        out: Folder of the evolution: its runs, its archive (a memory for `design`) and report.md.
        listen: Called with a line of text about each generation and each short training.
        follow: Called with every event of the runs, as `listen` of `design`.
        **settings: Fields of `RunConfig` that replace those of `config`, among them `model`.

    Raises:
        TypeError: An argument has the wrong type.
        UserError: Something requested does not exist or is not compatible, or `out` holds another evolution.
        AidsrError: A generation stopped before it was finished, as when a language model could not be reached.
    """
    check_type(task, str, "task must be the name of a task")
    check_type(out, (str, Path), "out must be the path of a folder")
    for name, number, least in (("generations", generations, 1), ("train", train, 0), ("steps", steps, 1)):
        check_whole_number(name, number, least=least)
    config = (config or RunConfig()).updated(settings)
    config = config.updated({"model": absolute_name(config.model), "task_feedback": True})
    check_effects(config)
    asked = {"objective": objective, "task": task, "level": level, "generations": generations}
    plan = checked(Plan, {**asked, "config": config, "train": train, "steps": steps})
    evolution = begin(Path(out), plan, environment=environment, goal=goal)
    if is_offline(config.model):
        listen(_NO_LESSONS)
    run_generations(evolution, listen, follow)
    return evolution
