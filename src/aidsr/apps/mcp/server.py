"""The MCP server, which offers the tools of `aidsr.tools`. All arguments are untrusted."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import anyio
from mcp.server.mcpserver import MCPServer
from mcp.server.mcpserver.exceptions import UnexpectedToolError
from mcp.server.mcpserver.tools import Tool as McpTool
from mcp.server.mcpserver.utilities.func_metadata import ArgModelBase, FuncMetadata
from mcp.types import CallToolResult, ImageContent, TextContent

from aidsr import __version__
from aidsr.apps.mcp.resources import add_resources
from aidsr.core.errors import AidsrError
from aidsr.core.storage_errors import storage_problem
from aidsr.teams.fitting.tool import CHECK
from aidsr.tools import OWNER_TOOLS, TOOLS, Tool, Workspace

_INSTRUCTIONS = """\
Design tendon-driven continuum robots with measured physics. A usual order: list_tasks, read_task, or make_task for an
environment and a goal of your own, which check tries; then write MJCF as the resource aidsr://mjcf-guide says; validate
it until it is stable; assemble places it in the task's environment and validates it there; look shows it. Then measure:
gaits, probe, play a script, sweep a number, edit, and measure again; train what does its job under a script, and
evaluate it at the end. Fix the causes of faults, not their symptoms: each says what was measured, the limit, and the
usual cure. The resource aidsr://docs lists the pages of the manual, aidsr://examples environments with
goals to begin with, aidsr://runs the runs of aidsr design."""


def build_server(folder: Path, runs: Path) -> MCPServer:
    """Return the MCP server.

    Args:
        folder: Folder in which the agent's robots, scenes and own tasks are stored.
        runs: Folder of the runs that the agent may read.
    """
    workspace = Workspace(folder)
    offered = (*OWNER_TOOLS.values(), CHECK, *TOOLS.values())
    tools: list[McpTool] = [_Offered.of(tool, workspace) for tool in offered]
    server = MCPServer("aidsr", version=__version__, instructions=_INSTRUCTIONS, log_level="WARNING", tools=tools)
    add_resources(server, runs)
    return server


class _Offered(McpTool):
    """MCP wrapper of a tool: the tool itself checks its arguments, and its error messages are returned as results."""

    fn: Callable[[dict[str, Any]], CallToolResult]

    @classmethod
    def of(cls, tool: Tool, workspace: Workspace) -> _Offered:
        def call(arguments: dict[str, Any]) -> CallToolResult:
            try:
                result = tool.call(workspace, _parsed(arguments, tool.schema["properties"]))
            except Exception as error:
                sentence = str(error) if isinstance(error, AidsrError) else storage_problem(error)
                if sentence is None:  # a bug: the server logs it with its traceback
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
        """Call the tool in a thread, so that a long measurement does not block the server."""
        del context, convert_result
        return await anyio.to_thread.run_sync(self.fn, arguments)


def _parsed(arguments: dict[str, Any], properties: dict[str, Any]) -> dict[str, Any]:
    """Return arguments with objects and lists parsed from JSON text, because some clients send them as text."""

    def parsed(name: str, value: Any) -> Any:
        is_text = properties.get(name, {}).get("type") == "string"
        if is_text or not (isinstance(value, str) and value[:1] in ("{", "[")):
            return value
        try:
            return json.loads(value)
        except (ValueError, RecursionError):
            return value

    return {name: parsed(name, value) for name, value in arguments.items()}
