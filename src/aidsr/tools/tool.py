"""Definition of a tool: name, description, typed arguments and function; used by teams, over MCP and from Python."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from aidsr.core.artifacts import Artifact
from aidsr.core.calls import Png
from aidsr.core.errors import UserError
from aidsr.core.formatting import excerpt
from aidsr.core.suggestions import closest_name
from aidsr.tools.workspace import Workspace

MOST_LINES = 60
"""Largest number of lines of a result. Our choice: readable at once; longer results are stored as a file."""
MOST_CHARACTERS = 10_000
"""Largest length of a text argument, unless its field has another bound. Our choice: prose and scripts are shorter."""
_MOST_ENTRIES = 1_000
"""Largest number of entries of a list or object argument. Our choice: more than the names of a robot."""
_LARGEST = 2**53
"""Largest magnitude of integers, up to which all JSON libraries agree. Source: RFC 8259, section 6."""
_SHOWN = 3
"""Number of mistakes listed in an error message."""


class Result(Artifact):
    """Result of a tool."""

    text: str
    pictures: tuple[Png, ...] = ()
    figures: dict[str, float] = Field(default_factory=dict)
    """Numbers by which code can compare scenes, by name; all of them are also in the text."""


@dataclass(frozen=True)
class Tool:
    """One tool.

    Attributes:
        name: Name by which it is called.
        description: What the tool does, for the caller.
        arguments: Model of the arguments, with names, types, defaults and descriptions.
        function: Function that takes a workspace, and the arguments by name.
    """

    name: str
    description: str
    arguments: type[BaseModel]
    function: Callable[..., Result]

    @classmethod
    def of(cls, function: Callable[..., Result]) -> Tool:
        """Return the tool for a function: the function's name, its docstring as one paragraph, and its annotations."""
        hints = get_type_hints(function, include_extras=True)
        fields: dict[str, Any] = {
            name: (hints[name], ... if parameter.default is inspect.Parameter.empty else parameter.default)
            for name, parameter in list(inspect.signature(function).parameters.items())[1:]
        }
        model = create_model(function.__name__, __config__=ConfigDict(extra="forbid"), **fields)
        text = " ".join((inspect.getdoc(function) or "").split())
        return cls(function.__name__, text, model, function)

    @cached_property
    def schema(self) -> dict[str, Any]:
        """JSON schema of the arguments."""
        return {key: value for key, value in self.arguments.model_json_schema().items() if key != "title"}

    def call(self, workspace: Workspace, arguments: Mapping[str, Any]) -> Result:
        """Check the arguments and call the function.

        Raises:
            UserError: An argument is unknown, missing, of a wrong type, too long or not finite, or the function raised
                it.
            MjcfError: A robot or scene cannot be loaded.
            IsolationError: The function exceeded a limit.
        """
        self._refuse_boundless(arguments)
        try:
            checked = self.arguments.model_validate(dict(arguments))
        except ValidationError as error:
            raise self._refused([self._told(each) for each in error.errors()]) from None
        self._refuse_boundless(checked.model_dump())  # validation may have converted text to a number
        values = {name: getattr(checked, name) for name in self.arguments.model_fields}
        return self.function(workspace, **values)

    def _refuse_boundless(self, arguments: Mapping[str, Any]) -> None:
        if mistakes := [mistake for name in arguments for mistake in self._boundless(name, arguments[name])]:
            raise self._refused(mistakes)

    def _boundless(self, name: str, value: Any) -> Iterator[str]:
        """Yield mistakes that no function needs to handle: texts or lists too long, numbers too large or not finite."""
        bound = self.schema["properties"].get(name, {}).get("maxLength", MOST_CHARACTERS)
        left = [(excerpt(name), value)]
        while left:
            place, one = left.pop()
            if isinstance(one, str) and len(one) > bound:
                yield f"{place} has {len(one):,} characters, at most {bound:,} are allowed"
            elif isinstance(one, float) and not math.isfinite(one):
                yield f"{place} should be a finite number, not {one}"
            elif isinstance(one, int) and abs(one) > _LARGEST:
                yield f"{place} is too large"
            elif isinstance(one, (Mapping, list, tuple)):
                if len(one) > _MOST_ENTRIES:
                    yield f"{place} has {len(one):,} entries, at most {_MOST_ENTRIES:,} are allowed"
                    continue
                inside = one.items() if isinstance(one, Mapping) else enumerate(one)
                left += [(f"{place}.{excerpt(str(key))}", each) for key, each in inside]

    def _refused(self, mistakes: list[str]) -> UserError:
        more = f"; and {len(mistakes) - _SHOWN} more" if len(mistakes) > _SHOWN else ""
        names = ", ".join(self.arguments.model_fields) or "none"
        return UserError(
            f"{self.name} cannot take these arguments: {'; '.join(mistakes[:_SHOWN])}{more}. Its arguments: {names}"
        )

    def _told(self, error: Any) -> str:
        """Return a validation error of one argument in words."""
        *above, last = (excerpt(str(part)) for part in error["loc"])
        where = ".".join([*above, last])
        match error["type"]:
            case "missing":
                return f"{where} is missing"
            case "extra_forbidden":
                near = "" if above else closest_name(last, self.arguments.model_fields)
                return f'there is no argument "{where}"' + (f' (did you mean "{near}"?)' if near else "")
            case "too_short":
                return f"{where} needs at least {error['ctx']['min_length']} of its kind"
            case "too_long":
                return f"{where} has {error['ctx']['actual_length']} entries, at most {error['ctx']['max_length']} fit"
            case "model_type":
                return f"{where} should be an object"
            case _:
                what = str(error["msg"]).removeprefix("Value error, ").removeprefix("Input ")
                return f"{where} {what[:1].lower()}{what[1:]}"


def shortened(text: str, workspace: Workspace) -> str:
    """Return a text of at most `MOST_LINES` lines; a longer one is stored as a file, whose name is in the last line."""
    lines = text.splitlines()
    if len(lines) <= MOST_LINES:
        return text
    name = workspace.add_file(text + "\n", "txt")
    return "\n".join([*lines[: MOST_LINES - 1], f"… {len(lines) - MOST_LINES + 1} more lines: read {name}"])
