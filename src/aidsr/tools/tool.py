"""The record of a tool: a name, a sentence, typed arguments and a function; used alike by teams, MCP and Python."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, get_type_hints

from pydantic import BaseModel, ConfigDict, ValidationError, create_model

from aidsr.core.artifacts import Artifact
from aidsr.core.calls import Png
from aidsr.core.errors import UserError
from aidsr.tools.workspace import Workspace

MOST_LINES = 60
"""Lines of a result. Our choice: what a designer reads at once; what is longer goes to a file."""


class Result(Artifact):
    """What a tool found."""

    text: str
    pictures: tuple[Png, ...] = ()


@dataclass(frozen=True)
class Tool:
    """One tool.

    Attributes:
        name: By which it is called.
        description: What it does, for whoever calls it.
        arguments: Their names, types, defaults and descriptions.
        function: Takes a workspace, and the arguments by name.
    """

    name: str
    description: str
    arguments: type[BaseModel]
    function: Callable[..., Result]

    @classmethod
    def of(cls, function: Callable[..., Result]) -> Tool:
        """Return the tool that a function is: its name, the first paragraph of its docstring, its annotations."""
        hints = get_type_hints(function, include_extras=True)
        fields: dict[str, Any] = {
            name: (hints[name], ... if parameter.default is inspect.Parameter.empty else parameter.default)
            for name, parameter in list(inspect.signature(function).parameters.items())[1:]
        }
        model = create_model(function.__name__, __config__=ConfigDict(extra="forbid"), **fields)
        text = " ".join((inspect.getdoc(function) or "").partition("\n\n")[0].split())
        return cls(function.__name__, text, model, function)

    @property
    def schema(self) -> dict[str, Any]:
        """JSON schema of the arguments."""
        return {key: value for key, value in self.arguments.model_json_schema().items() if key != "title"}

    def call(self, workspace: Workspace, arguments: Mapping[str, Any]) -> Result:
        """Check the arguments and call the function.

        Raises:
            UserError: An argument is unknown, missing, or of another type; or what the function raises.
            MjcfError: A robot or scene cannot be loaded.
            IsolationError: It ran past its limits.
        """
        try:
            checked = self.arguments.model_validate(dict(arguments))
        except ValidationError as error:
            told = "; ".join(_told(each) for each in error.errors())
            names = ", ".join(self.arguments.model_fields)
            raise UserError(f"{self.name} cannot take these arguments: {told}. Its arguments: {names}") from None
        values = {name: getattr(checked, name) for name in self.arguments.model_fields}
        return self.function(workspace, **values)


def _told(error: Any) -> str:
    """Return what is wrong with one argument."""
    where = ".".join(str(part) for part in error["loc"]) or "arguments"
    return f"{where}: {error['msg'].lower()}"


def shortened(text: str, workspace: Workspace) -> str:
    """Return a result of at most `MOST_LINES` lines; one that is longer is kept as a file, which is named."""
    lines = text.splitlines()
    if len(lines) <= MOST_LINES:
        return text
    name = workspace.add_file(text + "\n", "txt")
    return "\n".join([*lines[: MOST_LINES - 1], f"… {len(lines) - MOST_LINES + 1} more lines: read {name}"])
