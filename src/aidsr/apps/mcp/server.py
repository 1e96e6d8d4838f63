"""The MCP server: the tools of `aidsr.tools`, and what an agent reads first. All arguments are untrusted."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

from mcp.server.mcpserver import Image, MCPServer
from mcp.server.mcpserver.exceptions import ToolError
from pydantic import Field

from aidsr import __version__
from aidsr.core.artifacts import Artifact, EnvironmentSummary
from aidsr.core.errors import AidsrError
from aidsr.tasks import Level, load_task, task_names
from aidsr.teams.llm.prompts import render
from aidsr.tools import TOOLS, Tool, Workspace

_INSTRUCTIONS = """\
Design tendon-driven continuum robots with measured physics. A usual order: list_tasks, read_task, then write MJCF as
the resource aidsr://mjcf-guide says; validate it until it is stable; assemble places it in the task's environment and
validates it there; look shows it. Then measure: gaits, probe, play a script, sweep a number, edit, and measure again;
train what does its job under a script. Fix the causes of faults, not their symptoms: each says what was measured, the
limit, and the usual cure."""

TaskName = Annotated[str, Field(description="Name of a task as list_tasks returns it.")]


class TaskLine(Artifact):
    """One task of the list."""

    name: str
    objective: str


class TaskDescription(Artifact):
    """What a designer needs to know about a task."""

    name: str
    objective: str
    base: str
    """"fixed" to a mount, "moving" with one, "free", or "any"."""
    needs_contact: bool
    time_limit_s: float
    hold_s: float
    stages: tuple[str, ...]
    """What is reached on the way to success, in order."""
    judging: dict[str, str]
    """What differs between episodes, what success is, and what counts against it."""
    environment: EnvironmentSummary
    environment_mjcf: str


def build_server(folder: Path) -> MCPServer:
    """Return the server.

    Args:
        folder: Folder of the robots and scenes.
    """
    server = MCPServer("aidsr", version=__version__, instructions=_INSTRUCTIONS, log_level="WARNING")
    _add_task_tools(server)
    workspace = Workspace(folder)
    for tool in TOOLS.values():
        server.add_tool(_function(tool, workspace), tool.name, description=tool.description, structured_output=False)
    return server


def _add_task_tools(server: MCPServer) -> None:
    @server.tool()
    def list_tasks() -> list[TaskLine]:
        """List the benchmark tasks with their objectives."""
        return [TaskLine(name=name, objective=load_task(name).objective) for name in task_names()]

    @server.tool()
    def read_task(task: TaskName, level: Level = "standard") -> TaskDescription:
        """Return what a designer needs to know about a task: objective, environment, stages to success."""
        try:
            found = load_task(task, level)
        except AidsrError as error:
            raise ToolError(str(error)) from None
        brief = found.brief()
        return TaskDescription(
            name=found.name,
            objective=brief.objective,
            base=brief.base,
            needs_contact=brief.needs_contact,
            time_limit_s=found.time_limit_s,
            hold_s=found.hold_s,
            stages=tuple(words for _, words in found.stages),
            judging=brief.judging,
            environment=brief.summary,
            environment_mjcf=brief.environment,
        )

    @server.resource("aidsr://mjcf-guide", mime_type="text/markdown")
    def mjcf_guide() -> str:
        """How to write a tendon-driven robot in MJCF, with one complete limb."""
        return render("mjcf_guide")


def _function(tool: Tool, workspace: Workspace) -> Callable[..., Any]:
    """Return a tool as the function that the server asks for, with the signature of its arguments."""

    def call(**arguments: Any) -> list[str | Image]:
        try:
            result = tool.call(workspace, arguments)
        except AidsrError as error:
            raise ToolError(str(error)) from None
        return [result.text, *(Image(data=png, format="png") for png in result.pictures)]

    parameters = [
        inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.is_required() else field.default,
            annotation=Annotated[field.annotation, field],
        )
        for name, field in tool.arguments.model_fields.items()
    ]
    call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return call
