"""Generations of designs.

Each generation designs robots, tries them without learning, stores the results as lessons for the next generation, and
optionally trains its best scenes.

folder/evolve.json        the plan
folder/environment.xml    the environment of an objective in words
folder/goal.toml          its goal
folder/runs/              the run of each generation
folder/trained/HASH.json  evaluation of a short training of a scene, on development variations
folder/archive.jsonl      the lessons, a memory file like any other
folder/report.md          generations and archive, computed from the other files
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from aidsr.core.arguments import check_type
from aidsr.core.artifacts import SUCCESSFUL_SHARE, Artifact, Evaluation
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import AidsrError, BudgetError, IsolationError, MjcfError, UserError
from aidsr.core.extras import require_extra
from aidsr.evolution.report import report
from aidsr.loop.run import create_run, make_brief, mjcf_text, parts_of, replace_budget, require_run_is_ours
from aidsr.loop.runner import Listen, run_designs
from aidsr.memory import Lesson, Memory
from aidsr.memory.collecting import lessons_of
from aidsr.memory.lesson import policy_results
from aidsr.runs import Run, read_status
from aidsr.runs.files import BytesFile, JsonFile, replace_file
from aidsr.runs.library import Library
from aidsr.runs.status import newest

_DONE = 0.995
"""Least progress of a search that counts as done: progress that is displayed as 1.00."""


class Plan(Artifact):
    """Job and budget of an evolution."""

    objective: str = ""
    """Objective in words, empty for a benchmark task; its environment and goal are stored beside the plan."""
    task: str = ""
    level: Literal["standard", "hard"] = "standard"
    generations: Annotated[int, Field(ge=1, le=1000)] = 5
    config: RunConfig = RunConfig()
    """Settings of each generation's run. The seed grows by 1 with each; the budget is shared by all generations."""
    train: Annotated[int, Field(ge=0)] = 0
    """Number of designs per generation that get a short training: the best whose trial reached the decisive stage."""
    steps: Annotated[int, Field(ge=1)] = 60_000
    """Control steps of each short training."""

    def done_by(self, lesson: Lesson) -> bool:
        """Whether a robot does the job.

        With trainings, a valid policy must succeed in half of the development episodes; without, every search must
        reach the goal. A designer's own measurement in a single variation does not count.
        """
        if self.train:
            return (lesson.valid_success or 0.0) >= SUCCESSFUL_SHARE
        return lesson.least >= _DONE and (lesson.searches > 1 or not lesson.how)

    def is_done(self, lessons: Iterable[Lesson]) -> bool:
        """Whether one of the robots does the job; it need not be the one with the most progress."""
        return any(self.done_by(lesson) for lesson in lessons)


@dataclass(frozen=True, init=False)
class Evolution:
    """The folder of an evolution.

        evolution = aidsr.Evolution("evolution")
        print(evolution.done, evolution.best.text())
        lessons = [lesson.model_dump() for lesson in evolution.archive.lessons()]   # records for a table

    Raises:
        TypeError: `path` has another type.
    """

    path: Path
    """Folder with the runs of the generations (runs/), the archive and report.md."""

    def __init__(self, path: str | Path) -> None:
        check_type(path, (str, Path), "an evolution must be given as the path of its folder")
        object.__setattr__(self, "path", Path(path))

    @property
    def plan(self) -> JsonFile[Plan]:
        """File of the plan."""
        return JsonFile(self.path / "evolve.json", Plan)

    @property
    def archive(self) -> Memory:
        """Memory with the lessons of all generations."""
        return Memory(self.path / "archive.jsonl")

    @property
    def environment(self) -> BytesFile:
        """MJCF of the environment of an objective in words; absent for a benchmark task."""
        return BytesFile(self.path / "environment.xml")

    @property
    def goal(self) -> Path:
        """Goal file of an objective in words; absent if no goal was given."""
        return self.path / "goal.toml"

    def asked(self) -> Plan:
        """Return the plan.

        Raises:
            UserError: The folder is not the folder of an evolution.
        """
        plan = self.plan.read()
        if plan is None:
            raise UserError(f"{self.path} is not the folder of an evolution: evolve.json not found")
        return plan

    def generations(self) -> dict[int, Run]:
        """Return the runs of the generations that have begun, by number in ascending order; the first is 1.

        The seed of a run tells its generation; if several runs have the same seed, the newest counts.
        """
        first = self.asked().config.seed
        oldest_first = reversed(Library(self.path / "runs").runs())
        return dict(sorted({run.asked().config.seed - first + 1: run for run in oldest_first}.items()))

    @property
    def best(self) -> Lesson | None:
        """The best lesson of all generations; None if nothing was measured."""
        return _best(self.archive.lessons())

    @property
    def done(self) -> bool:
        """Whether a robot does the job, see `Plan.done_by`."""
        return self.asked().is_done(self.archive.lessons())

    def training(self, lesson: Lesson) -> JsonFile[Evaluation]:
        """Return the file with the evaluation of a short training of the scene of a lesson."""
        return JsonFile(self.path / "trained" / f"{lesson.scene_sha256[:16]}.json", Evaluation)

    def lessons(self, run: Run) -> tuple[Lesson, ...]:
        """Return the lessons of a generation, including the results of short trainings so far."""
        return tuple(
            lesson.model_copy(update=policy_results(self.training(lesson).read())) for lesson in lessons_of(run)
        )


def begin(folder: Path, plan: Plan, *, environment: str | Path = "", goal: str | Path = "") -> Evolution:
    """Create the folder of an evolution, or reopen it if it holds the same plan; `generations` may differ.

    Args:
        folder: Folder of the evolution.
        plan: Job and budget.
        environment: Environment of an objective in words: MJCF text or the path of its file. To reopen a folder it may
            be left out.
        goal: Goal file of an objective in words. To reopen a folder it may be left out.

    Raises:
        UserError: The folder holds another evolution or other files, or parts of the plan contradict each other.
    """
    evolution = Evolution(folder)
    if not plan.config.task_feedback:
        raise UserError("an evolution requires task_feedback: without it nothing is measured; switch it on")
    if plan.train:
        require_extra("rl", "training")
    if (kept := evolution.plan.read()) is not None:
        if kept.model_copy(update={"generations": plan.generations}) != plan:
            raise _holds_another(folder, "plan", evolution.plan.path)
        _check_same_job(evolution, environment, goal)
        replace_file(evolution.plan.path, plan.model_dump_json(indent=2).encode() + b"\n")
        return evolution
    if not (plan.task or goal):
        raise UserError("an evolution requires a measure of success; name a task, or give a goal file")
    if plan.config.memory or plan.config.human:
        raise UserError("an evolution keeps a memory of its own and asks no person; leave out memory and human")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UserError(f"{folder} is not the folder of an evolution: evolve.json not found; name a new folder")
    make_brief(plan.objective, task=plan.task, level=plan.level, environment=environment, goal=goal)
    folder.mkdir(parents=True, exist_ok=True)
    if not plan.task:
        evolution.environment.write(mjcf_text(environment, "environment").encode())
        if goal:
            BytesFile(evolution.goal).write(Path(goal).read_bytes())
    evolution.plan.write(plan)
    return evolution


def _check_same_job(evolution: Evolution, environment: str | Path, goal: str | Path) -> None:
    """Refuse to reopen an evolution with another environment or goal than those in its folder.

    Raises:
        UserError: One of them differs, or cannot be read.
    """
    from aidsr.tasks import read_goal

    kept = evolution.environment
    if environment and kept.read() != mjcf_text(environment, "environment").encode():
        raise _holds_another(evolution.path, "environment", kept.path)
    if goal and (not evolution.goal.exists() or read_goal(goal) != read_goal(evolution.goal)):
        raise _holds_another(evolution.path, "goal", evolution.goal)


def _holds_another(folder: Path, what: str, file: Path) -> UserError:
    return UserError(f"{folder} holds an evolution with another {what} ({file.name}); name another folder")


def run_generations(
    evolution: Evolution,
    listen: Callable[[str], None] = lambda _line: None,
    follow: Listen = lambda _design, _event: None,
) -> None:
    """Run an evolution until a robot does the job, the last generation is finished or the budget is spent.

    Call it again to continue an evolution that was stopped or killed; finished work is not repeated.

    Args:
        evolution: The evolution.
        listen: Called with a line of text about each generation and each short training.
        follow: Called with the events of the runs.

    Raises:
        ForeignFolderError: The run of a generation was not made on this machine, and its prompts leave this process.
        UserError: The folder is not the folder of an evolution, or one of its files is damaged.
        AidsrError: A generation stopped before it was finished, as when a model cannot be reached.
    """
    plan = evolution.asked()
    for number in range(1, plan.generations + 1):
        begun = evolution.generations()
        run = _begin_or_continue(evolution, plan, number, begun)
        if run is None:
            listen(f"generation {number}: the budget is spent")
            break
        try:
            run_designs(run, parts_of(run, trust=number not in begun), follow)
        except BudgetError as error:  # what is left is too little for the first call
            listen(f"generation {number}: the budget is spent. {error}")
            break
        if (status := read_status(run)).state != "finished":
            raise AidsrError(f"generation {number} stopped: {status.why_unfinished}; repeat the command to continue")
        evolution.archive.add(evolution.lessons(run))
        for lesson in _to_train(evolution, plan, run):
            listen(_train(evolution, plan, run, lesson))
        lessons = evolution.lessons(run)
        evolution.archive.add(lessons)
        replace_file(evolution.path / "report.md", report(plan.generations, _measured(evolution, plan)).encode())
        best = _best(lessons)
        listen(f"generation {number}: " + (f"{best.name} comes to {best.progress:.2f}" if best else "nothing measured"))
        if plan.is_done(lessons):
            break


def _begin_or_continue(evolution: Evolution, plan: Plan, number: int, begun: Mapping[int, Run]) -> Run | None:
    """Return the run of a generation; None if the budget is spent.

    Unless the run is finished, its budget is what the other generations left.

    Raises:
        ForeignFolderError: The run is unfinished, was not made on this machine, and its prompts leave this process.
    """
    run = begun.get(number)
    if run is not None and read_status(run).state == "finished":
        return run
    left = _left(plan, [run for other, run in begun.items() if other >= 1 and other != number])
    if left is None:
        return None
    if run is None:
        return _new_generation(evolution, plan, number, left)
    require_run_is_ours(run, trust=False)
    if left != run.budget():  # an earlier version began the next generation when this one had stopped
        replace_budget(run, left)
    return run


def _new_generation(evolution: Evolution, plan: Plan, number: int, left: Budget) -> Run:
    """Create the run of a generation with the budget that is left, and return it."""
    brief = make_brief(
        plan.objective,
        task=plan.task,
        level=plan.level,
        environment="" if plan.task else evolution.environment.path,
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


def _left(plan: Plan, spent: Iterable[Run]) -> Budget | None:
    """Return the budget that the other generations left; None if it is spent."""
    budget, usage = plan.config.budget, [read_status(run).usage for run in spent]
    tokens, cost = budget.tokens, budget.cost_usd
    if tokens is not None:
        tokens -= sum(each.input_tokens + each.output_tokens for each in usage)
    if cost is not None:
        cost -= sum(each.cost_usd or 0.0 for each in usage)
    if (tokens is not None and tokens < 1) or (cost is not None and cost <= 0.0):
        return None
    return budget.model_copy(update={"tokens": tokens, "cost_usd": cost})


def _to_train(evolution: Evolution, plan: Plan, run: Run) -> Iterator[Lesson]:
    """Yield the lessons of the best designs of a generation that have not been trained yet, one scene of each.

    Scenes of the measuring team are left out: that team decides itself which scenes to train.
    """
    tried = [each for each in evolution.lessons(run) if each.solved and not each.how]
    best: dict[int, Lesson] = {}
    for lesson in sorted(tried, key=lambda each: -each.progress):
        best.setdefault(lesson.design_and_iteration[0], lesson)
    for lesson in list(best.values())[: plan.train]:
        if evolution.training(lesson).read() is None:
            yield lesson


def _train(evolution: Evolution, plan: Plan, run: Run, lesson: Lesson) -> str:
    """Train a policy for the scene of a lesson, store its evaluation, and return the result as a sentence."""
    from aidsr.learn.rl.short_training import train_briefly

    number, iteration = lesson.design_and_iteration
    design = run.design(number)
    scene = design.iteration(iteration).scene.read()
    robot = newest(each.robot.read() for each in design.leading_to(iteration))
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
    won = f"{lesson.name}: a policy wins {found.success_share:.0%} of {len(found.episodes)} development episodes"
    return won + lesson.model_copy(update=policy_results(found)).reservation


def _measured(evolution: Evolution, plan: Plan) -> list[tuple[int, tuple[Lesson, ...]]]:
    """Return the number and the lessons of each generation so far."""
    begun = evolution.generations()
    return [(number, evolution.lessons(run)) for number, run in begun.items() if 1 <= number <= plan.generations]


def _best(lessons: tuple[Lesson, ...]) -> Lesson | None:
    return max(lessons, key=lambda each: each.worth, default=None)
