"""Elements of a document: iteration, attributes, lines, and faults located at an element."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from typing import cast

from lxml import etree

from aidsr.core.artifacts import Fault

Element = etree._Element

_MAX_LISTED = 12  # names in a message; our choice: more would be hard to read, so the rest is only counted
_HEXADECIMAL = re.compile(r"[-+]?0x", re.IGNORECASE)
_NAN = re.compile(r"[-+]?nan(\(\w*\)?)?", re.IGNORECASE)
_LONGEST_WORD = 100  # characters of a tag in a message; our choice: no MJCF tag is longer, XML allows 50,000 characters


def elements(root: Element, *tags: str) -> Iterator[Element]:
    """Yield an element and all elements inside it in document order, without comments; only these tags, if given."""
    wanted = tags or ("*",)
    for element in root.iter(*wanted):
        if isinstance(element.tag, str):
            yield element


def attributes(element: Element) -> list[tuple[str, str]]:
    """Return the names and values of an element's attributes in document order."""
    return [(str(name), str(value)) for name, value in element.attrib.items()]


def line_of(element: Element) -> int | None:
    """Return the number of the line in which the element's tag ends, None if not known."""
    return cast("int | None", element.sourceline)


def numbers(text: str) -> list[float]:
    """Return the numbers in an attribute as MuJoCo reads them; empty if a word is not a number (MuJoCo refuses it)."""
    try:
        return [_number(word) for word in text.split()]
    except ValueError:
        return []


def _number(word: str) -> float:
    """Parse a number as C does, including forms such as 0x1p-3 and nan(...).

    Source: ISO C, strtod, with which MuJoCo reads numbers.

    Raises:
        ValueError: The word is not a number.
    """
    if _HEXADECIMAL.match(word):
        try:
            return float.fromhex(word)
        except OverflowError:
            return math.inf
    return math.nan if _NAN.fullmatch(word) else float(word)


def describe(element: Element) -> str:
    """Return a description by which a reader finds the element: its tag and name, or the nearest named ancestor."""
    name, tag = element.get("name") or element.get("class"), str(element.tag)[:_LONGEST_WORD]
    if name:
        return f"<{tag}> '{name}'"
    holder = _nearest_named(element)
    return f"<{tag}>" if holder is None else f"<{tag}> in <{holder.tag}> '{holder.get('name')}'"


def load_fault(code: str, element: Element, problem: str, *, names: Iterable[str] = (), cure: str = "") -> Fault:
    """Return a fault located at one element of the document.

    Args:
        code: Fault code.
        element: Faulty element.
        problem: Description of the problem; the message is this text after a description of the element.
        names: Names of the parts concerned; by default the name of the element or of its nearest named ancestor.
        cure: Recommended correction.
    """
    named = tuple(names)
    if not named:
        holder = element if element.get("name") else _nearest_named(element)
        named = () if holder is None else (holder.get("name", ""),)
    return Fault(
        code=code,
        layer="load",
        severity="error",
        names=named,
        message=f"{describe(element)}: {problem}",
        cure=cure,
        line=line_of(element),
    )


def join(names: Iterable[str]) -> str:
    """Return names as a comma-separated list; names beyond the first `_MAX_LISTED` are only counted."""
    every = list(names)
    listed = ", ".join(every[:_MAX_LISTED])
    return listed if len(every) <= _MAX_LISTED else f"{listed} and {len(every) - _MAX_LISTED} more"


def _nearest_named(element: Element) -> Element | None:
    for ancestor in element.iterancestors():
        if ancestor.get("name"):
            return ancestor
    return None
