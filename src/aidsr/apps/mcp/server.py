"""The MCP server: the tools of `aidsr.tools`, and what an agent reads first. All arguments are untrusted."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import anyio
from mcp.server.mcpserver import MCPServer
from mcp.server.mcpserver.exceptions import UnexpectedToolError
from mcp.server.mcpserver.tools import Tool as McpTool
from mcp.server.mcpserver.utilities.func_metadata import ArgModelBase, FuncMetadata
from mcp.types import CallToolResult, ImageContent, TextContent
from pydantic import Field, TypeAdapter

from aidsr import __version__
from aidsr.core.artifacts import Artifact, EnvironmentSummary
from aidsr.core.errors import AidsrError
from aidsr.core.storage_errors import storage_problem
from aidsr.tasks import Level, load_task, task_names
from aidsr.teams.llm.prompts import render
from aidsr.tools import TOOLS, Result, Tool, Workspace

_INSTRUCTIONS = """\
Design tendon-driven continuum robots with measured physics. A usual order: list_tasks, read_task, then write MJCF as
the resource aidsr://mjcf-guide says; validate it until it is stable; assemble places it in the task's environment and
validates it there; look shows it. Then measure: gaits, probe, play a script, sweep a number, edit, and measure again;
train what does its job under a script. Fix the causes of faults, not their symptoms: each says what was measured, the
limit, and the usual cure."""


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


def list_tasks(_workspace: Workspace) -> Result:
    """List the benchmark tasks with their objectives."""
    lines = [TaskLine(name=name, objective=load_task(name).objective) for name in task_names()]
    return Result(text=TypeAdapter(list[TaskLine]).dump_json(lines, indent=2).decode())


def read_task(
    _workspace: Workspace,
    task: Annotated[str, Field(max_length=500, description="Name of a task as list_tasks returns it.")],
    level: Annotated[Level, Field(description="How hard the task is.")] = "standard",
) -> Result:
    """Return what a designer needs to know about a task: objective, environment, stages to success."""
    found = load_task(task, level)
    brief = found.brief()
    description = TaskDescription(
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
    return Result(text=description.model_dump_json(indent=2))


def build_server(folder: Path) -> MCPServer:
    """Return the server.

    Args:
        folder: Folder of the robots and scenes.
    """
    workspace = Workspace(folder)
    tools: list[McpTool] = [
        _Offered.of(tool, workspace) for tool in (Tool.of(list_tasks), Tool.of(read_task), *TOOLS.values())
    ]
    server = MCPServer("aidsr", version=__version__, instructions=_INSTRUCTIONS, log_level="WARNING", tools=tools)

    @server.resource("aidsr://mjcf-guide", mime_type="text/markdown")
    def mjcf_guide() -> str:
        """How to write a tendon-driven robot in MJCF, with one complete limb."""
        return render("mjcf_guide")

    return server


class _Offered(McpTool):
    """A tool as the server offers it: arguments are checked by the tool itself, and errors are its sentences."""

    fn: Callable[[dict[str, Any]], CallToolResult]

    @classmethod
    def of(cls, tool: Tool, workspace: Workspace) -> _Offered:
        def call(arguments: dict[str, Any]) -> CallToolResult:
            try:
                result = tool.call(workspace, _parsed(arguments, tool.schema["properties"]))
            except Exception as error:
                sentence = str(error) if isinstance(error, AidsrError) else storage_problem(error)
                if sentence is None:  # the server logs it with its traceback
                    raise UnexpectedToolError(
                        f"{tool.name} failed by a bug of AID-SR; the server's log tells"
                    ) from error
                return CallToolResult(content=[TextContent(text=sentence)], is_error=True)
            drawn = [
                ImageContent(data=base64.b64encode(png).decode(), mime_type="image/png") for png in result.pictures
            ]
            return CallToolResult(content=[TextContent(text=result.text), *drawn])

        return cls(
            fn=call,
            name=tool.name,
            description=tool.description,
            parameters=tool.schema,
            fn_metadata=FuncMetadata(arg_model=ArgModelBase),
            is_async=False,
        )

    async def run(self, arguments: dict[str, Any], context: Any, convert_result: bool = False) -> CallToolResult:
        """Call the tool in a thread: a long measurement must not keep the server from answering."""
        del context, convert_result
        return await anyio.to_thread.run_sync(self.fn, arguments)


def _parsed(arguments: dict[str, Any], properties: dict[str, Any]) -> dict[str, Any]:
    """Return arguments with their objects and lists: some clients send those as text."""

    def parsed(name: str, value: Any) -> Any:
        is_text = properties.get(name, {}).get("type") == "string"
        if is_text or not (isinstance(value, str) and value[:1] in ("{", "[")):
            return value
        try:
            return json.loads(value)
        except (ValueError, RecursionError):
            return value

    return {name: parsed(name, value) for name, value in arguments.items()}
