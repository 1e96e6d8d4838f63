"""Elements of a document: iteration, attributes, lines, and faults located at an element."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from typing import cast

from lxml import etree

from aidsr.core.artifacts import Fault

Element = etree._Element

_MAX_LISTED = 12  # our choice: what a reader takes in; the rest is counted
_HEXADECIMAL = re.compile(r"[-+]?0x", re.IGNORECASE)
_NAN = re.compile(r"[-+]?nan(\(\w*\)?)?", re.IGNORECASE)
_LONGEST_WORD = 100  # our choice: no tag of MJCF is longer; XML allows 50,000 characters


def elements(root: Element, *tags: str) -> Iterator[Element]:
    """Yield the elements of a document in order, comments left out; only these tags when any are named."""
    wanted = tags or ("*",)
    for element in root.iter(*wanted):
        if isinstance(element.tag, str):
            yield element


def attributes(element: Element) -> list[tuple[str, str]]:
    """Return the names and values of an element's attributes, in the order of the text."""
    return [(str(name), str(value)) for name, value in element.attrib.items()]


def line_of(element: Element) -> int | None:
    """Return the line of the text in which the element's tag ends."""
    return cast("int | None", element.sourceline)


def numbers(text: str) -> list[float]:
    """Return the numbers in an attribute as MuJoCo reads them; empty when any of it is none, which MuJoCo refuses."""
    try:
        return [_number(word) for word in text.split()]
    except ValueError:
        return []


def _number(word: str) -> float:
    """Return a number as C reads it: also 0x1p-3, and nan with anything in brackets behind it.

    Source: ISO C, strtod, with which MuJoCo reads numbers.
    """
    if _HEXADECIMAL.match(word):
        try:
            return float.fromhex(word)
        except OverflowError:
            return math.inf
    return math.nan if _NAN.fullmatch(word) else float(word)


def describe(element: Element) -> str:
    """Return words by which a reader finds the element: its name, or the nearest name around it."""
    name, tag = element.get("name") or element.get("class"), str(element.tag)[:_LONGEST_WORD]
    if name:
        return f"<{tag}> '{name}'"
    holder = _nearest_named(element)
    return f"<{tag}>" if holder is None else f"<{tag}> in <{holder.tag}> '{holder.get('name')}'"


def load_fault(code: str, element: Element, problem: str, *, names: Iterable[str] = (), cure: str = "") -> Fault:
    """Return a fault of the document at one element.

    Args:
        code: The fault's code.
        element: Where it is.
        problem: What was read there; the element's name is put before it.
        names: What it concerns; the element's own or nearest name when not given.
        cure: What to do.
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
    """Return names as a list to read, the rest counted."""
    every = list(names)
    listed = ", ".join(every[:_MAX_LISTED])
    return listed if len(every) <= _MAX_LISTED else f"{listed} and {len(every) - _MAX_LISTED} more"


def _nearest_named(element: Element) -> Element | None:
    for ancestor in element.iterancestors():
        if ancestor.get("name"):
            return ancestor
    return None
