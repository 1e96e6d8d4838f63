"""Tool calls in the text of a reply, for models and servers without tool support."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from aidsr.core.calls import ToolCall, ToolOutput, ToolSpec
from aidsr.core.errors import ReplyError

_FENCE = re.compile(
    r"^[ \t]*+```[ \t]*+(tool|argument)[ \t]++(\w++)[ \t]*+\n(.*?)(?:^[ \t]*+```[ \t]*+$|\Z)", re.MULTILINE | re.DOTALL
)
_LONG = ("mjcf", "patch", "script")
"""Arguments that have their own blocks."""


@dataclass(frozen=True)
class DescribedTool:
    """A tool as a prompt shows it."""

    name: str
    description: str
    arguments: tuple[str, ...]
    """One line for each argument."""


def calls_in_text(reply: str) -> tuple[ToolCall, ...]:
    """Return the tool calls in a reply, in order, numbered from 1.

    A block "tool NAME" contains the arguments as JSON; blocks "argument NAME" after it add long arguments as plain
    text.

    Raises:
        ReplyError: An argument comes before any tool, or the arguments of a call are not a JSON object.
    """
    calls: list[tuple[str, dict[str, Any]]] = []
    for kind, name, text in _FENCE.findall(reply):
        if kind == "tool":
            calls.append((name, _object(name, text)))
        elif calls:
            calls[-1][1][name] = text.removesuffix("\n")
        else:
            raise ReplyError(f"The block `argument {name}` has no block `tool NAME` before it.")
    return tuple(
        ToolCall(id=str(number), name=name, arguments=json.dumps(arguments, ensure_ascii=False))
        for number, (name, arguments) in enumerate(calls, 1)
    )


def calls_as_text(calls: Sequence[ToolCall]) -> str:
    """Return calls in the format in which a reply has them in its text, see `calls_in_text`."""
    return "\n".join(block for call in calls for block in _blocks(call))


def _blocks(call: ToolCall) -> Iterator[str]:
    arguments = json.loads(call.arguments)
    long = {name: value for name, value in arguments.items() if name in _LONG and isinstance(value, str)}
    short = {name: value for name, value in arguments.items() if name not in long}
    yield f"```tool {call.name}\n{json.dumps(short, ensure_ascii=False)}\n```"
    yield from (f"```argument {name}\n{value}\n```" for name, value in long.items())


def prose_of(reply: str) -> str:
    """Return the text of a reply without its calls and without blank lines, most of which surrounded a call."""
    return "\n".join(line for line in _FENCE.sub("", reply).splitlines() if line.strip()).strip()


def results_as_text(outputs: Sequence[ToolOutput]) -> str:
    """Return the results of calls as the text of the next message."""
    return "\n\n".join(f"## {output.id}. {output.name}\n\n{output.text}" for output in outputs)


def describe_tools(tools: Sequence[ToolSpec]) -> tuple[DescribedTool, ...]:
    """Return tools as a prompt shows them: each argument with its type, its default and its description.

    Fields of objects and descriptions of arguments that several tools have in common are shown once.
    """
    told: dict[str, str] = {}
    return tuple(DescribedTool(tool.name, tool.description, tuple(_Arguments(tool, told).lines())) for tool in tools)


def _object(name: str, text: str) -> dict[str, Any]:
    try:
        value = json.loads(text) if text.strip() else {}
    except (ValueError, RecursionError) as error:
        raise ReplyError(f"The block `tool {name}` is no JSON: {error}.") from None
    if not isinstance(value, dict):
        raise ReplyError(f"The block `tool {name}` is no JSON object; write the arguments by name.")
    return value


@dataclass(frozen=True)
class _Arguments:
    """The arguments of one tool as text."""

    tool: ToolSpec
    told: dict[str, str]
    """Objects and arguments described so far, each with the name of the tool for which it was described."""

    def lines(self) -> list[str]:
        """Return a line for each argument; for an object with its fields."""
        schema = self.tool.parameters
        return [self._line(name, field) for name, field in schema.get("properties", {}).items()]

    def _line(self, name: str, field: dict[str, Any]) -> str:
        default, about = field.get("default"), field.get("description", "")
        optional = "" if name in self.tool.parameters.get("required", ()) else "?"
        known = default not in (0, [], "", None, {}) and isinstance(default, int | float | list | str)
        given = f" = {json.dumps(default)}" * (known and not isinstance(default, dict))
        key = f"{name} {about}"
        first = self.told.setdefault(key, self.tool.name) == self.tool.name
        return f"{name}{optional} ({self._type(field)}{given})" + f": {about}".rstrip(": ") * first

    def _type(self, field: dict[str, Any]) -> str:
        """Return the type of an argument in words."""
        if "$ref" in field:
            return self._object(field["$ref"].rpartition("/")[2])
        if "enum" in field:
            return " | ".join(json.dumps(value) for value in field["enum"])
        if "anyOf" in field:
            return " or ".join(self._type(each) for each in field["anyOf"] if each.get("type") != "null")
        if "prefixItems" in field:
            return "[" + ", ".join(self._type(each) for each in field["prefixItems"]) + "]"
        if field.get("type") == "array":
            return f"list of {self._type(field.get('items', {}))}"
        return {"string": "text"}.get(field.get("type", ""), str(field.get("type", "any")))

    def _object(self, name: str) -> str:
        """Return the fields of an object with their types and descriptions; "as for …" if it was described before."""
        first = self.told.setdefault(name, self.tool.name)
        if first != self.tool.name:
            return f"{{as for {first}}}"
        fields = []
        for key, field in self.tool.parameters["$defs"][name].get("properties", {}).items():
            about = field.get("description", "").rstrip(".")
            fields.append(f"{key}: {self._type(field)}" + f" ({about})" * bool(about))
        return "{" + "; ".join(fields) + "}"
