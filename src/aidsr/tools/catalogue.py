"""All tools by name, in the order in which a designer uses them, and the tools that only the owner of a job has."""

from __future__ import annotations

from aidsr.tools import building, jobs, measuring
from aidsr.tools.tool import Tool

TOOLS: dict[str, Tool] = {
    tool.name: tool
    for tool in (
        Tool.of(function)
        for function in (
            building.validate,
            building.edit,
            building.fix,
            building.assemble,
            measuring.play,
            measuring.probe,
            measuring.measure,
            measuring.sweep,
            building.look,
            measuring.train,
            building.read,
        )
    )
}

OWNER_TOOLS: dict[str, Tool] = {
    tool.name: tool
    for tool in (
        Tool.of(function) for function in (jobs.list_tasks, jobs.read_task, jobs.make_task, measuring.evaluate)
    )
}
"""Tools of the owner of a job, who defines it and measures success; a team inside a run has none of them."""


def tools_table(tools: dict[str, Tool] = TOOLS) -> str:
    """Return tools as a Markdown table for the docs, with names, arguments and descriptions."""
    rows = ["| tool | takes | does |", "|---|---|---|"]
    for tool in tools.values():
        takes = ", ".join(f"`{name}`" for name in tool.arguments.model_fields)
        rows.append(f"| `{tool.name}` | {takes} | {tool.description.rstrip('.')} |")
    return "\n".join(rows) + "\n"
