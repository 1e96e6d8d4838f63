"""Tools for tasks: list_tasks, read_task, and make_task, which makes a task of a given environment and goal."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, TypeAdapter

from aidsr.core.artifacts import Artifact, EnvironmentSummary
from aidsr.core.errors import MjcfError, UserError
from aidsr.mjcf.size_limits import SizeLimits
from aidsr.render.pictures import picture
from aidsr.render.view import View
from aidsr.tasks import Level, goal_task, load_task, parse_goal, task_names
from aidsr.tasks.targets import targets_and_mounts
from aidsr.tools.tool import Result
from aidsr.tools.workspace import Workspace, is_own


class TaskLine(Artifact):
    """One task in the list of tasks."""

    name: str
    objective: str


class TaskDescription(Artifact):
    """Description of a task for a designer."""

    name: str
    objective: str
    base: str
    """How the root of the robot is held: "fixed" to a mount, "moving" with a mount, "free", or "any"."""
    needs_contact: bool
    time_limit_s: float
    hold_s: float
    judging: dict[str, str]
    """Texts by title: what varies between episodes, the definition of success, the stages towards it, and failures."""
    environment: EnvironmentSummary
    environment_mjcf: str


def list_tasks(workspace: Workspace) -> Result:
    """List the benchmark tasks, and the own ones that were made, with their objectives."""
    lines = [TaskLine(name=name, objective=load_task(name).objective) for name in task_names()]
    lines += [TaskLine(name=name, objective=workspace.objective(name)) for name in workspace.own_tasks()]
    return Result(text=TypeAdapter(list[TaskLine]).dump_json(lines, indent=2).decode())


def read_task(
    workspace: Workspace,
    task: Annotated[str, Field(max_length=500, description="Name of a task as list_tasks returns it.")],
    level: Annotated[Level, Field(description="How hard a task of the benchmark is.")] = "standard",
) -> Result:
    """Return what a designer needs to know about a task: objective, environment, stages to success."""
    name, _, found = workspace.task_of(task, level)
    if found is None:
        raise UserError("this work is for a job without a task; leave the task out")
    brief = found.brief()
    description = TaskDescription(
        name=name,
        objective=workspace.objective(name) if is_own(name) else brief.objective,
        base=brief.base,
        needs_contact=brief.needs_contact,
        time_limit_s=found.time_limit_s,
        hold_s=found.hold_s,
        judging=brief.judging,
        environment=brief.summary,
        environment_mjcf=brief.environment,
    )
    return Result(text=description.model_dump_json(indent=2))


def make_task(
    workspace: Workspace,
    objective: Annotated[str, Field(min_length=1, description="What the robot should do, in plain words.")],
    environment: Annotated[
        str,
        Field(
            max_length=SizeLimits().characters,
            description="The whole MJCF document of the surroundings, without a robot; see aidsr://docs/environments.",
        ),
    ],
    goal: Annotated[
        str, Field(description='When it is done, as TOML; see aidsr://docs/goals. Such as: kind = "reach" …')
    ],
) -> Result:
    """Keep an environment and a goal of your own as a task that all tools take, after checking that it can be met."""
    if "<" not in environment:  # loaders treat such a text as a path; a client must not make the server read files
        raise UserError(f"not an MJCF document: {environment[:80]!r}; give the text of one, not its path")
    asked = parse_goal(goal)
    task = goal_task(asked, environment)
    try:
        brief = task.brief()
    except MjcfError as error:
        raise UserError(f"the environment cannot be loaded: {error}") from None
    name = workspace.add_task(objective.strip(), environment, goal)
    mounts = ", ".join(mount.name for mount in brief.summary.mounts) or 'none: a robot stands at the origin, "world"'
    lines = [
        f"{name}: base {brief.base}, at most {task.time_limit_s:g} s, mounts: {mounts}",
        *(f"{title}: {words}" for title, words in brief.judging.items()),
    ]
    view = View(shown=targets_and_mounts(task))
    return Result(text="\n".join(lines), pictures=(picture(environment, view=view),) if workspace.draws else ())
