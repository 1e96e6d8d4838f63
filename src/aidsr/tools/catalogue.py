"""All tools by name, in the order in which a designer meets them."""

from __future__ import annotations

from aidsr.tools import building, measuring
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


def tools_table() -> str:
    """Return the tools as a Markdown table, for the docs: name, arguments, what it does."""
    rows = ["| tool | takes | does |", "|---|---|---|"]
    for tool in TOOLS.values():
        takes = ", ".join(f"`{name}`" for name in tool.arguments.model_fields)
        rows.append(f"| `{tool.name}` | {takes} | {tool.description.rstrip('.')} |")
    return "\n".join(rows) + "\n"
