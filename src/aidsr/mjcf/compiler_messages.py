"""Parser for MuJoCo's error messages: fault code, line, attribute and names."""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True)
class CompilerMessage:
    """One error message of MuJoCo's parser or compiler."""

    code: str
    """Fault code; "load_error" for a message of unknown kind."""
    problem: str
    """The message without its location."""
    line: int | None
    """Line in the text that MuJoCo compiled; None if not reported."""
    index: int | None
    """MuJoCo's id of the reported element among those of its kind; None if not reported."""
    attribute: str
    """Name of the reported attribute, "" if there is none."""
    quoted: tuple[str, ...]
    """All quoted words of the message, such as names and keywords."""


_KINDS: tuple[tuple[str, str], ...] = (
    ("unknown_element", r"unrecognized (model )?element"),
    ("unknown_attribute", r"unrecognized attribute"),
    (
        "wrong_for_type",
        r"fromto requires|both pos and fromto|at most one of|must be specified together|multiple orient",
    ),
    (
        "wrong_for_type",
        r"multiple orientation|requires attribute|cannot be used|must be (ball|hinge|slide)|should not be defined",
    ),
    ("missing_asset", r"(mesh|hfield|texture|skin) '.*' not found"),
    ("invalid_joint_placement", r"free joint can only|more than 6 dofs|World body cannot have|joints? .* (free|mocap)"),
    ("duplicate_name", r"repeated (name|default class)|already exists"),
    ("tendon_path_invalid", r"path (must|ends|starts|begins)|not bracketed|site \d+ is repeated|pulley|wrap object at"),
    ("undefined_reference", r"not found|unrecognized (name|object)|missing (transmission target|name of|base site)"),
    (
        "undefined_reference",
        r"unknown (default (child)?class|transmission target|element|body|target|geom|site|joint|tendon)",
    ),
    ("joint_range_invalid", r"range\[0\] should be .* joint"),
    ("ctrlrange_invalid", r"control range|ctrlrange"),
    ("keyframe_size", r"keyframe"),
    ("zero_mass", r"mass and inertia of moving bodies"),
    ("bad_value", r"too much data|enough data|bad format|problem reading|invalid keyword|required attribute|must be"),
    (
        "bad_value",
        r"should be|invalid (force |act )?(range|limits)|too (large|small|close)|required|inertia",
    ),
    ("bad_value", r"negative|positive|expected|empty (class|name)|unique element|\bnan\b"),
)
"""Fault codes and the patterns of their messages; the first match counts. Source: messages of MuJoCo 3.17, tried one by
one."""
_PATTERNS = tuple((re.compile(pattern, re.IGNORECASE), code) for code, pattern in _KINDS)

_MOST_READ = 2000
"""Largest number of characters of a message that are read; it may quote long values of the document. Our choice."""
_PREFIX = re.compile(r"^((XML )?Error:\s*|Schema violation:\s*|engine error:\s*)+")
_LINE = re.compile(r"\bline (\d+)\s*$")
_INDEX = re.compile(r"\bid (\d+)")
_ATTRIBUTE = re.compile(r"(?:attribute|attribute missing):? '([^']*)'")
_QUOTED = re.compile(r"'([^']*)'")
_NUMBERING = re.compile(r"\s*\(id = \d+\)|\b(tendon|keyframe) ''\s*(?=[:(])|(?<=actuator) id = \d+")
_TRAILING_NUMBER = re.compile(r"(\bin \w+(?: \w+)?) \d+$")
"""MuJoCo's ids of unnamed elements, which the reader of a document cannot see; removed from messages."""


def parse_message(message: str) -> CompilerMessage:
    """Parse an error message of MuJoCo's parser or compiler."""
    problem, _, place = message[:_MOST_READ].strip().partition("\n")
    problem = _PREFIX.sub("", problem)
    line = _LINE.search(place)
    index = _INDEX.search(place)
    attribute = _ATTRIBUTE.search(problem)
    code = next((code for pattern, code in _PATTERNS if pattern.search(problem)), "load_error")
    return CompilerMessage(
        code=code,
        problem=_TRAILING_NUMBER.sub(r"\1", _NUMBERING.sub("", problem)).strip(" :"),
        line=int(line[1]) if line else None,
        index=int(index[1]) if index else None,
        attribute=attribute[1] if attribute else "",
        quoted=tuple(name for name in _QUOTED.findall(problem) if name),
    )
