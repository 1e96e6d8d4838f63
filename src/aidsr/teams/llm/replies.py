"""Parsing of replies: tolerant of what surrounds an answer, strict about the answer itself.

The message of every error is a sentence for the model that wrote the reply.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from aidsr.core.artifacts import ActuatorGroup
from aidsr.core.errors import ReplyError
from aidsr.mjcf.schema import actuator_elements
from aidsr.mjcf.spans import COMMENT, without

T = TypeVar("T", bound=BaseModel)

_FENCE = re.compile(r"^[ \t]*+```[ \t]*+([\w+-]*+)[ \t]*+\n(.*?)(?:^[ \t]*+```[ \t]*+$|\Z)", re.MULTILINE | re.DOTALL)
_LINE_OPENING_OBJECT = re.compile(r"^[ \t]*(?=\{)", re.MULTILINE)
_OBJECT_OF_KEYS = re.compile(r"(?=\{\s*[\"'])")
_ANY_OBJECT = re.compile(r"(?=\{)")
_NEXT_OBJECT = re.compile(r"[ \t]*+(?=\{)")
_ELEMENT_NEXT = re.compile(r"\s*+<")
_NAME = re.compile(r"\sname\s*+=\s*+[\"']([^\"']+)[\"']")
MAX_CHARACTERS = 1_000_000
"""Maximum length of a reply that is read [characters]. Our choice: ten times the length of 20,000 tokens."""
_MAX_VALUE_LENGTH = 60
"""Maximum length of a wrong value in a complaint [characters]. Our choice: enough to find it."""
_MAX_PROBLEMS = 6
"""Maximum number of problems in one complaint. Our choice: more are rarely independent."""


@dataclass(frozen=True)
class Block:
    """A fenced block of a reply."""

    language: str
    text: str


def fenced_blocks(reply: str) -> tuple[Block, ...]:
    """Return the fenced blocks; one that is never closed runs to the end of the reply."""
    return tuple(Block(match[1].lower(), match[2]) for match in _FENCE.finditer(reply))


def find_documents(text: str, root: str) -> list[str]:
    """Return the XML documents with the root element `root`.

    A tag that no other element follows, such as a tag named in a sentence, does not begin a document.
    """
    tags = list(_opening_tags(text, root))
    closings = list(re.finditer(rf"</{root}\s*+>", text))
    found, end, number = list[str](), 0, 0
    for start, inside in tags:
        while number < len(closings) and closings[number].start() < inside:
            number += 1
        if start >= end and number < len(closings) and _ELEMENT_NEXT.match(text, inside):
            end = closings[number].end()
            found.append(text[start:end])
    if not found and tags and closings and closings[-1].start() >= tags[0][1]:
        return [text[tags[0][0] : closings[-1].end()]]
    return found


def validate_as(kind: type[T], value: object) -> T:
    """Return a value as an artifact.

    Raises:
        ReplyError: Fields are missing, unknown or of the wrong type; the message has a sentence for each.
    """
    try:
        return kind.model_validate_json(json.dumps(value))
    except ValidationError as error:
        problems = error.errors()
    shown = [_describe_problem(kind, problem) for problem in problems[:_MAX_PROBLEMS]]
    rest = len(problems) - len(shown)
    raise ReplyError(" ".join(shown) + (f" And {rest} more of the kind." if rest else ""))


def has_json(reply: str) -> bool:
    """Whether a reply has JSON, well-formed or not; braces in prose, as in `{name}`, do not count."""
    rest = _FENCE.sub("\n", reply)
    fenced = any(block.language.startswith("json") or _starts_with(block.text, "{") for block in fenced_blocks(reply))
    return fenced or bool(_LINE_OPENING_OBJECT.search(rest) or _OBJECT_OF_KEYS.search(rest))


def parse_json(reply: str) -> dict[str, Any]:
    """Return the only JSON object in a reply, fenced or not, with or without prose around it.

    Raises:
        ReplyError: The reply has no JSON object or more than one, or the object is not well-formed.
    """
    fenced = [
        block.text for block in fenced_blocks(reply) if block.language in {"json", ""} and _starts_with(block.text, "{")
    ]
    found = fenced or _bare_objects(reply)
    if not found:
        raise ReplyError("It has no JSON object; one was asked for in a fenced block.")
    if len(found) > 1:
        raise ReplyError(f"It has {len(found)} JSON objects; exactly one was asked for.")
    return _decode(found[0])


def extract_mjcf(reply: str) -> str | None:
    """Return the only MJCF document in a reply, fenced or not; None if there is none.

    Raises:
        ReplyError: The reply has several documents, or the document has no end.
    """
    fenced = [block.text.strip() for block in fenced_blocks(reply) if _starts_with(block.text, "<")]
    found = fenced or find_documents(reply, "mujoco")
    if len(found) > 1:
        raise ReplyError(f"It has {len(found)} XML blocks; exactly one was asked for.")
    if not found:
        return None
    if not found[0].endswith("</mujoco>"):
        raise ReplyError("The MJCF does not end with </mujoco>; it must be complete, in one block.")
    return found[0] + "\n"


def element_names(mjcf: str, *elements: str) -> frozenset[str]:
    """Return the names of the elements with these tags; the document need not be well-formed."""
    tags = re.findall(rf"<(?:{'|'.join(elements)})\b([^<>]*+)", without(mjcf, COMMENT))
    return frozenset(name[1] for tag in tags if (name := _NAME.search(tag)))


def check_part(mjcf: str, functional_part: str) -> None:
    """Check that a robot's MJCF has its functional part; the document need not be well-formed.

    Raises:
        ReplyError: It has not; the message lists the bodies and sites that it has.
    """
    parts = element_names(mjcf, "body", "site")
    if functional_part not in parts:
        raise ReplyError(_unknown_name("functional_part", functional_part, "body or site", parts))


def check_groups(mjcf: str, groups: Sequence[ActuatorGroup]) -> None:
    """Check that a robot's MJCF has the actuators of groups; the document need not be well-formed.

    Raises:
        ReplyError: An actuator is missing, with a list of those that exist, or is in two groups.
    """
    actuators, used = element_names(mjcf, *actuator_elements()), set[str]()
    for name in (name for group in groups for name in group.actuators):
        if name not in actuators:
            raise ReplyError(_unknown_name("actuator_groups", name, "actuator", actuators))
        if name in used:
            raise ReplyError(f'The actuator "{name}" is in two places of actuator_groups; it can be in one.')
        used.add(name)


def _unknown_name(field: str, name: str, kind: str, known: frozenset[str]) -> str:
    return f"{field} names {json.dumps(name)}, but no {kind} of the MJCF has that name; it has {_join_names(known)}."


def _join_names(names: frozenset[str]) -> str:
    """Return names as a list for a sentence, at most 40 of them."""
    shown = sorted(names)[:40]
    return (", ".join(shown) or "none") + (f" and {len(names) - 40} more" if len(names) > 40 else "")


def _starts_with(text: str, prefix: str) -> bool:
    return text.lstrip().startswith(prefix)


def _opening_tags(text: str, root: str) -> Iterator[tuple[int, int]]:
    """Yield the start and the end of each opening tag of an element; of tags with the same end only the first."""
    end = 0
    for match in re.finditer(rf"<{root}\b", text):
        if match.end() > end:
            end = text.find(">", match.end()) + 1
            if not end:
                return
            yield match.start(), end


def _bare_objects(reply: str) -> list[str]:
    """Return the objects outside of fenced blocks: those that begin a line, else those with a key, else all."""
    rest = _FENCE.sub("\n", reply)
    likeliest_first = (_LINE_OPENING_OBJECT, _OBJECT_OF_KEYS, _ANY_OBJECT)
    opening = next((pattern for pattern in likeliest_first if pattern.search(rest)), _ANY_OBJECT)
    found, end = list[str](), 0
    while True:
        beside = _NEXT_OBJECT.match(rest, end) if found and opening is _LINE_OPENING_OBJECT else None
        start = beside or opening.search(rest, end)
        if start is None:
            return found
        try:
            _, end = json.JSONDecoder(strict=False).raw_decode(rest, start.end())
        except (ValueError, RecursionError):
            return found or [rest[start.end() :]]  # the caller reports what is wrong with a single object
        found.append(rest[start.end() : end])


def _decode(text: str) -> dict[str, Any]:
    try:
        value = json.loads(text, strict=False, parse_constant=_reject_constant)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno} of it"
        raise ReplyError(f"The JSON is not well-formed: {error.msg} at {where}.") from None
    except (ValueError, RecursionError):  # Python's limits on the digits of a number and on nesting
        raise ReplyError("The JSON has a number too long, or brackets nested too deep, to be read.") from None
    if not isinstance(value, dict):
        raise ReplyError("The JSON must be one object.")
    return value


def _reject_constant(word: str) -> float:
    raise ReplyError(f"The JSON has {word}, which is not a JSON number.")


def _describe_problem(kind: type[BaseModel], problem: Any) -> str:
    """Return one of pydantic's validation errors as a sentence."""
    where = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in problem["loc"]).lstrip(".")
    match problem["type"]:
        case "missing":
            return f'The field "{where}" is missing.'
        case "extra_forbidden":
            return f'The field "{where}" is not known.' + _known_fields(kind, problem["loc"])
        case "value_error":
            message = str(problem["ctx"]["error"])
            return f"{message[0].upper()}{message[1:]}."
        case _:
            shown = json.dumps(problem["input"])
            shown = shown if len(shown) <= _MAX_VALUE_LENGTH else shown[:_MAX_VALUE_LENGTH] + "…"
            return f'The field "{where}" is wrong: {problem["msg"]}, found {shown}.'


def _known_fields(kind: type[BaseModel], location: tuple[int | str, ...]) -> str:
    """Return a sentence with the fields of the outermost object; "" for inner ones, which the prompt's example has."""
    return f" Known are {', '.join(kind.model_fields)}." if len(location) == 1 else ""
