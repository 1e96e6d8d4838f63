"""Reading replies: tolerant of what surrounds an answer, strict about the answer itself.

Every error is a sentence for the model that wrote the reply.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from aidsr.core.errors import ReplyError

__all__ = ["Block", "blocks", "documents_in", "has_json", "json_in", "mjcf_in", "names_of", "read_as"]

T = TypeVar("T", bound=BaseModel)

_FENCE = re.compile(r"^[ \t]*```[ \t]*([\w+-]*)[ \t]*\n(.*?)(?:^[ \t]*```[ \t]*$|\Z)", re.MULTILINE | re.DOTALL)
_LINE_OPENING_OBJECT = re.compile(r"^[ \t]*(?=\{)", re.MULTILINE)
_OBJECT_OF_KEYS = re.compile(r"(?=\{\s*[\"'])")
_ANY_OBJECT = re.compile(r"(?=\{)")
_LONGEST_SHOWN = 60
"""Characters of a wrong value that are repeated to the model. Our choice: enough to find it."""
_MOST_PROBLEMS = 6
"""Problems named in one complaint. Our choice: more are rarely independent."""


@dataclass(frozen=True)
class Block:
    """A fenced block of a reply."""

    language: str
    text: str


def blocks(reply: str) -> tuple[Block, ...]:
    """Return the fenced blocks; one that is never closed runs to the end of the reply."""
    return tuple(Block(match[1].lower(), match[2]) for match in _FENCE.finditer(reply))


def documents_in(text: str, root: str) -> list[str]:
    """Return the XML documents with that root; a tag named in a sentence, which no element follows, begins none."""
    likeliest_first = (rf"<{root}\b[^>]*>(?=\s*<).*?</{root}\s*>", rf"<{root}\b[^>]*>.*</{root}\s*>")
    found = ([match[0] for match in re.finditer(pattern, text, re.DOTALL)] for pattern in likeliest_first)
    return next(filter(None, found), [])


def read_as(kind: type[T], value: object) -> T:
    """Return a value as an artifact.

    Raises:
        ReplyError: Fields are missing, unknown or of the wrong kind; a sentence for each.
    """
    try:
        return kind.model_validate_json(json.dumps(value))
    except ValidationError as error:
        problems = error.errors()
    shown = [_sentence(kind, problem) for problem in problems[:_MOST_PROBLEMS]]
    rest = len(problems) - len(shown)
    raise ReplyError(" ".join(shown) + (f" And {rest} more of the kind." if rest else ""))


def has_json(reply: str) -> bool:
    """Whether a reply has what was meant as JSON, well-formed or not; braces of prose, as in `{name}`, are none."""
    rest = _FENCE.sub("\n", reply)
    fenced = any(block.language.startswith("json") or _opens(block.text, "{") for block in blocks(reply))
    return fenced or bool(_LINE_OPENING_OBJECT.search(rest) or _OBJECT_OF_KEYS.search(rest))


def json_in(reply: str) -> dict[str, Any]:
    """Return the one JSON object of a reply, fenced or bare, with prose around it or not.

    Raises:
        ReplyError: There is none, more than one, or it is not well-formed.
    """
    fenced = [block.text for block in blocks(reply) if block.language in {"json", ""} and _opens(block.text, "{")]
    found = fenced or _bare_objects(reply)
    if not found:
        raise ReplyError("It has no JSON object; one was asked for in a fenced block.")
    if len(found) > 1:
        raise ReplyError(f"It has {len(found)} JSON objects; exactly one was asked for.")
    return _decoded(found[0])


def mjcf_in(reply: str) -> str | None:
    """Return the one MJCF document of a reply, fenced or bare; None when there is none.

    Raises:
        ReplyError: There are several, or it has no end.
    """
    fenced = [block.text.strip() for block in blocks(reply) if _opens(block.text, "<")]
    found = fenced or documents_in(reply, "mujoco")
    if len(found) > 1:
        raise ReplyError(f"It has {len(found)} XML blocks; exactly one was asked for.")
    if not found:
        return None
    if not found[0].endswith("</mujoco>"):
        raise ReplyError("The MJCF does not end with </mujoco>; it must be complete, in one block.")
    return found[0] + "\n"


def names_of(mjcf: str, *elements: str) -> frozenset[str]:
    """Return the names given to elements of these kinds, whether the document is well-formed or not."""
    text = re.sub(r"<!--.*?-->", "", mjcf, flags=re.DOTALL)
    kinds = "|".join(elements)
    return frozenset(re.findall(rf"<(?:{kinds})\b[^>]*?\sname\s*=\s*[\"']([^\"']+)[\"']", text))


def _opens(text: str, sign: str) -> bool:
    return text.lstrip().startswith(sign)


def _bare_objects(reply: str) -> list[str]:
    """Return the objects outside of fences: those that begin a line if any do, else those with a key, else any."""
    rest = _FENCE.sub("\n", reply)
    likeliest_first = (_LINE_OPENING_OBJECT, _OBJECT_OF_KEYS, _ANY_OBJECT)
    opening = next((pattern for pattern in likeliest_first if pattern.search(rest)), _ANY_OBJECT)
    found: list[str] = []
    while start := opening.search(rest):
        rest = rest[start.end() :]
        try:
            _, end = json.JSONDecoder(strict=False).raw_decode(rest)
        except (ValueError, RecursionError):
            return found or [rest]  # so that the caller says what is wrong with the only one
        found.append(rest[:end])
        rest = rest[end:]
    return found


def _decoded(text: str) -> dict[str, Any]:
    try:
        value = json.loads(text, strict=False, parse_constant=_no_such_number)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno} of it"
        raise ReplyError(f"The JSON is not well-formed: {error.msg} at {where}.") from None
    except (ValueError, RecursionError):  # Python's bounds on digits and on depth
        raise ReplyError("The JSON has a number too long, or brackets nested too deep, to be read.") from None
    if not isinstance(value, dict):
        raise ReplyError("The JSON must be one object.")
    return value


def _no_such_number(word: str) -> float:
    raise ReplyError(f"The JSON has {word}, which is not a JSON number.")


def _sentence(kind: type[BaseModel], problem: Any) -> str:
    """Return one of pydantic's findings as a sentence."""
    where = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in problem["loc"]).lstrip(".")
    match problem["type"]:
        case "missing":
            return f'The field "{where}" is missing.'
        case "extra_forbidden":
            return f'The field "{where}" is not known.' + _known_fields(kind, problem["loc"])
        case "value_error":
            said = str(problem["ctx"]["error"])
            return f"{said[0].upper()}{said[1:]}."
        case _:
            shown = json.dumps(problem["input"])
            shown = shown if len(shown) <= _LONGEST_SHOWN else shown[:_LONGEST_SHOWN] + "…"
            return f'The field "{where}" is wrong: {problem["msg"]}, found {shown}.'


def _known_fields(kind: type[BaseModel], location: tuple[int | str, ...]) -> str:
    """Return what the outermost object may hold; inner ones are shown by the example in the prompt."""
    return f" Known are {', '.join(kind.model_fields)}." if len(location) == 1 else ""
