"""Generations of designs: design, try without learning, keep as lessons, tell the next; train the few best.

folder/evolve.json        what was asked
folder/environment.xml    of a job in words, and goal.toml
folder/runs/              the run of each generation
folder/trained/HASH.json  what a short training made of a scene, on development variations
folder/archive.jsonl      the lessons, a memory like any other
folder/report.md          generations and archive, computed from the rest
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from aidsr.core.artifacts import SUCCESSFUL_SHARE, Artifact, Evaluation
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import IsolationError, MjcfError, UserError
from aidsr.core.extras import require_extra
from aidsr.evolution.report import report
from aidsr.loop.run import create_run, make_brief, mjcf_text, parts_of
from aidsr.loop.runner import Listen, run_designs
from aidsr.memory import Lesson, Memory
from aidsr.memory.collecting import lessons_of
from aidsr.runs import Run, read_status
from aidsr.runs.files import BytesFile, JsonFile, replace_file
from aidsr.runs.library import Library
from aidsr.runs.status import newest

_DONE = 0.995
"""Progress of a trial that is done in every search, rounded as it is shown."""


class Plan(Artifact):
    """What is evolved, and how much it may take."""

    objective: str = ""
    """A job in words; its environment and goal are kept beside the plan."""
    task: str = ""
    level: Literal["standard", "hard"] = "standard"
    generations: Annotated[int, Field(ge=1, le=1000)] = 5
    config: RunConfig = RunConfig()
    """Of each generation; its seed grows by 1 with each, and its budget is that of all together."""
    train: Annotated[int, Field(ge=0)] = 0
    """Designs of a generation that get a short training: the best of those whose trial reached the decisive stage."""
    steps: Annotated[int, Field(ge=1)] = 60_000
    """Control steps of such a training."""

    def done_by(self, lesson: Lesson) -> bool:
        """Whether a body does the job: its policy wins half of its episodes, or without trainings every search does.

        What a designer measured in one variation alone does not count.
        """
        if self.train:
            return (lesson.policy_success or 0.0) >= SUCCESSFUL_SHARE
        return lesson.least >= _DONE and (lesson.searches > 1 or not lesson.how)


@dataclass(frozen=True)
class Evolution:
    """The folder of an evolution."""

    path: Path

    @property
    def plan(self) -> JsonFile[Plan]:
        """What was asked."""
        return JsonFile(self.path / "evolve.json", Plan)

    @property
    def archive(self) -> Memory:
        """What all generations measured."""
        return Memory(self.path / "archive.jsonl")

    @property
    def goal(self) -> Path:
        """The goal of a job in words, where one was given."""
        return self.path / "goal.toml"

    def asked(self) -> Plan:
        """Return the plan.

        Raises:
            UserError: The folder is no evolution.
        """
        plan = self.plan.read()
        if plan is None:
            raise UserError(f"{self.path} is not the folder of an evolution: evolve.json not found")
        return plan

    def generation(self, number: int) -> Run | None:
        """Return the run of a generation, counted from 1; None while there is none."""
        seed = self.asked().config.seed + number - 1
        runs = Library(self.path / "runs").runs()
        return next((run for run in runs if run.asked().config.seed == seed), None)

    def training(self, lesson: Lesson) -> JsonFile[Evaluation]:
        """Return what a short training made of the scene of a lesson."""
        return JsonFile(self.path / "trained" / f"{lesson.scene_sha256[:16]}.json", Evaluation)

    def lessons(self, run: Run) -> tuple[Lesson, ...]:
        """Return what a generation measured, with the trainings that were made since."""
        return tuple(
            lesson.model_copy(update={"policy_success": trained.success_share})
            if (trained := self.training(lesson).read())
            else lesson
            for lesson in lessons_of(run)
        )


def begin(folder: Path, plan: Plan, *, environment: str | Path = "", goal: str | Path = "") -> Evolution:
    """Make the folder of an evolution; with an equal plan it is gone on with.

    Args:
        folder: Where.
        plan: What is asked.
        environment: Of a job in words: a path, or the MJCF itself.
        goal: File that says how its success is measured.

    Raises:
        UserError: The folder holds another evolution or something else, or what is asked does not fit together.
    """
    evolution = Evolution(folder)
    if not plan.config.task_feedback:
        raise UserError("an evolution requires task_feedback: without it nothing is measured; switch it on")
    if plan.train:
        require_extra("rl", "training")
    if (kept := evolution.plan.read()) is not None:
        if kept.model_copy(update={"generations": plan.generations}) != plan:
            raise UserError(f"{folder} holds an evolution with another plan (evolve.json); name another folder")
        replace_file(evolution.plan.path, plan.model_dump_json(indent=2).encode() + b"\n")
        return evolution
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UserError(f"{folder} is not the folder of an evolution: evolve.json not found; name a new folder")
    make_brief(plan.objective, task=plan.task, level=plan.level, environment=environment, goal=goal)
    folder.mkdir(parents=True, exist_ok=True)
    if not plan.task:
        BytesFile(folder / "environment.xml").write(mjcf_text(environment, "environment").encode())
        if goal:
            BytesFile(evolution.goal).write(Path(goal).read_bytes())
    evolution.plan.write(plan)
    return evolution


def evolve(
    evolution: Evolution,
    listen: Callable[[str], None] = lambda _line: None,
    follow: Listen = lambda _design, _event: None,
) -> Lesson | None:
    """Work on an evolution until a body does its job, its generations are over or its budget is spent.

    Call it again for one that was stopped or killed: what is finished is not done again.

    Args:
        evolution: Its folder.
        listen: Called with a line about each generation and each training.
        follow: Called with the events of the runs.

    Returns:
        The best lesson; None where nothing was measured.

    Raises:
        UserError: The folder is no evolution, or a file of it is damaged.
    """
    plan = evolution.asked()
    for number in range(1, plan.generations + 1):
        run = evolution.generation(number) or _new_generation(evolution, plan, number)
        if run is None:
            listen(f"generation {number}: the budget is spent")
            break
        run_designs(run, parts_of(run), follow)
        evolution.archive.add(evolution.lessons(run))
        for lesson in _to_train(evolution, plan, run):
            listen(_train(evolution, plan, run, lesson))
        lessons = evolution.lessons(run)
        evolution.archive.add(lessons)
        replace_file(evolution.path / "report.md", report(plan.generations, _measured(evolution, plan)).encode())
        best = _best(lessons)
        listen(f"generation {number}: " + (f"{best.name} comes to {best.progress:.2f}" if best else "nothing measured"))
        if best and plan.done_by(best):
            break
    return _best(evolution.archive.lessons())


def _new_generation(evolution: Evolution, plan: Plan, number: int) -> Run | None:
    """Return the run of a generation that has not begun; None where the budget is spent."""
    left = _left(evolution, plan, number)
    if left is None:
        return None
    brief = make_brief(
        plan.objective,
        task=plan.task,
        level=plan.level,
        environment="" if plan.task else evolution.path / "environment.xml",
        goal=evolution.goal if evolution.goal.exists() else "",
    )
    memory = evolution.archive.path
    changes = {"seed": plan.config.seed + number - 1, "memory": str(memory) if memory.exists() else "", "budget": left}
    return create_run(
        brief,
        plan.config.updated(changes),
        level=plan.level if plan.task else "",
        runs=evolution.path / "runs",
        goal=evolution.goal if evolution.goal.exists() else "",
    )


def _left(evolution: Evolution, plan: Plan, number: int) -> Budget | None:
    """Return what the generations before left of the budget; None where that is nothing."""
    budget, spent = plan.config.budget, [run for n in range(1, number) if (run := evolution.generation(n))]
    usage = [read_status(run).usage for run in spent]
    tokens, cost = budget.tokens, budget.cost_usd
    if tokens is not None:
        tokens -= sum(each.input_tokens + each.output_tokens for each in usage)
    if cost is not None:
        cost -= sum(each.cost_usd or 0.0 for each in usage)
    if (tokens is not None and tokens < 1) or (cost is not None and cost <= 0.0):
        return None
    return budget.model_copy(update={"tokens": tokens, "cost_usd": cost})


def _to_train(evolution: Evolution, plan: Plan, run: Run) -> Iterator[Lesson]:
    """Yield the scenes of a generation that are worth a training and have had none.

    A session of the measuring team trains what it finds worth it by itself.
    """
    tried = [each for each in evolution.lessons(run) if each.solved and not each.how]
    solved = sorted(tried, key=lambda each: -each.progress)
    for lesson in solved[: plan.train]:
        if evolution.training(lesson).read() is None:
            yield lesson


def _train(evolution: Evolution, plan: Plan, run: Run, lesson: Lesson) -> str:
    """Train a policy for the scene of a lesson, keep what it reached, and return it in words."""
    from aidsr.learn.rl.short_training import train_briefly

    _, _, number, iteration = lesson.evidence.split("/")
    design = run.design(int(number))
    scene = design.iteration(int(iteration)).scene.read()
    robot = newest(each.robot.read() for each in design.leading_to(int(iteration)))
    assert scene is not None
    assert robot is not None
    goal = evolution.goal if evolution.goal.exists() else None
    try:
        found = train_briefly(
            scene.mjcf, steps=plan.steps, groups=robot.actuator_groups, task=plan.task, level=plan.level, goal=goal
        )
    except (IsolationError, MjcfError) as error:
        return f"{lesson.name} could not be trained: {error}"
    evolution.training(lesson).write(found)
    return f"{lesson.name}: a policy wins {found.success_share:.0%} of {len(found.episodes)} development episodes"


def _measured(evolution: Evolution, plan: Plan) -> list[tuple[int, tuple[Lesson, ...]]]:
    """Return the generations so far with what each measured."""
    numbered = ((number, evolution.generation(number)) for number in range(1, plan.generations + 1))
    return [(number, evolution.lessons(run)) for number, run in numbered if run]


def _best(lessons: tuple[Lesson, ...]) -> Lesson | None:
    return max(lessons, key=lambda each: each.worth, default=None)
