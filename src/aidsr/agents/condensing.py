"""A robot's MJCF made short for a reader: of what repeats, only the pattern is shown.

Limbs are chains of nearly equal links, hands have several equal fingers, and tendons pass dozens of sites. A model
that judges, places or mends a robot needs the pattern, not every copy. Comments say what was left out: which names, and
which numbers of theirs differ. Looks (materials, colours) are left out without a word.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator, Sequence

import numpy as np
from lxml import etree

from aidsr.errors import MjcfError
from aidsr.sim.document.place import Element, attributes
from aidsr.sim.mjcf import parse_document

__all__ = ["condense"]

_LEAST_LEFT_OUT = 2
"""A comment in place of fewer elements would save nothing. Our choice."""
_NUMBERS = re.compile(r"\s*[-+]?\.?\d[-+.\deE]*(\s+[-+]?\.?\d[-+.\deE]*)*\s*")
_COUNTED = re.compile(
    r"([a-z]|(?<=[A-Z_]))\d+[a-z]?(?![a-z])|(?<=_)[a-z](?![a-z])"
    r"|(?<![a-z])(left|right|front|rear|middle|back|top|bottom|upper|lower)(?![a-z])"
)
"""What tells copies of one thing apart in their names: numbers and a letter beside them, single letters, sides."""
_MOST_UNEVEN = 8
"""Copies that differ in more numbers than this, other than steadily, are shown whole. Our choice: the comment would be
as hard to read."""
_LOOKS = {"material", "rgba", "group"}
_UNORDERED = ("sensor", "contact", "actuator", "tendon")
"""Sections whose elements may be shown in another order."""
_WHOLE = ("body", "spatial", "fixed", "default")
"""Elements with parts of their own: one of them shows what the others are like."""


def condense(mjcf: str) -> str | None:
    """Return an MJCF text without its repetitions and looks; None when it cannot be read."""
    try:
        root = copy.deepcopy(parse_document(mjcf).root)
    except MjcfError:
        return None
    _drop_looks(root)
    for body in list(root.iter("body")):
        _shorten_chain(body)
    for section in root.iter(*_UNORDERED):
        section[:] = sorted(section, key=lambda element: (str(element.tag), repr(_shape(element))))
    for element in list(root.iter(etree.Element)):
        for row in list(_rows(element)):
            _shorten_row(row)
    etree.indent(root, space=" ")
    return str(etree.tostring(root, encoding="unicode")) + "\n"


def _drop_looks(root: Element) -> None:
    for element in [*root.iter(etree.Comment), *root.iter("visual", "material", "texture")]:
        _remove(element)
    for element in root.iter(etree.Element):
        for key in _LOOKS & set(element.attrib):
            del element.attrib[key]
    for element in list(root.iter("asset", "default")):
        emptied = [child for child in element if child.tag in ("geom", "site") and not child.attrib]
        for child in emptied:  # elsewhere, one without attributes is all that its class says
            element.remove(child)
        if element.tag == "asset" and not len(element):
            _remove(element)


def _shorten_chain(first: Element) -> None:
    """Leave out the links of a chain that are like the one after the first; what follows them moves there."""
    chain = [first]
    while (link := _next_link(chain[-1])) is not None and (len(chain) == 1 or _own(link) == _own(chain[1])):
        chain.append(link)
    left_out = chain[2:]
    if len(left_out) < _LEAST_LEFT_OUT:
        return
    pattern, following = chain[1], chain[-1].findall("body")
    differences = _differences(_own_elements(pattern), [_own_elements(link) for link in left_out])
    if differences is None:
        return
    said = f"{len(left_out)} more, {_named(left_out)}: each inside the one before and like {pattern.get('name')}"
    left_out[0].addprevious(etree.Comment(_comment(said + differences)))
    _remove(left_out[0])
    pattern.extend(following)


def _shorten_row(row: Sequence[Element]) -> None:
    """Leave out what is like the first of a row; of elements that only differ in name and numbers the last is kept."""
    pattern, whole = row[0], row[0].tag in _WHOLE
    left_out = row[1:] if whole else row[1:-1]
    if len(left_out) < (1 if whole else _LEAST_LEFT_OUT):
        return
    said = f"{_named(left_out)}: like {_label(pattern)}" if whole else f"{len(left_out)} more: {_named(left_out)}"
    differences = _differences(_elements(pattern), [_elements(element) for element in left_out])
    if differences is None:
        return
    if differences and any(True for _ in pattern.iter(etree.Comment)):
        differences += ", and likewise in the parts that are like these"
    left_out[0].addprevious(etree.Comment(_comment(said + differences)))
    for element in left_out:
        _remove(element)


def _rows(parent: Element) -> Iterator[list[Element]]:
    """Yield the neighbouring children that have one shape."""
    row: list[Element] = []
    for child in parent:
        if row and _shape(child) != _shape(row[0]):
            yield row
            row = []
        if not isinstance(child, etree._Comment):
            row.append(child)
    if row:
        yield row


def _next_link(link: Element) -> Element | None:
    """Return the one body inside a link, if there is one only."""
    inside = link.findall("body")
    return inside[0] if len(inside) == 1 else None


def _shape(element: Element) -> tuple[object, ...]:
    """Return everything of an element but its numbers and what counts its copies."""
    if isinstance(element, etree._Comment):
        return (_COUNTED.sub("#", element.text or ""),)
    return (*_opening(element), *(_shape(child) for child in element))


def _own(link: Element) -> tuple[object, ...]:
    """Return the shape of a link without the links inside it."""
    return (*_opening(link), *(_shape(child) for child in link if child.tag != "body"))


def _opening(element: Element) -> tuple[object, ...]:
    words = {k: "#" if _NUMBERS.fullmatch(v) else _COUNTED.sub("#", v) for k, v in attributes(element)}
    return (element.tag, tuple(sorted(words.items())))


def _elements(element: Element) -> list[Element]:
    return list(element.iter(etree.Element))


def _own_elements(link: Element) -> list[Element]:
    return [link, *(element for child in link if child.tag != "body" for element in _elements(child))]


def _differences(pattern: Sequence[Element], others: Sequence[Sequence[Element]]) -> str | None:
    """Say which numbers of the elements left out are not those of the one that is shown; None when that takes long."""
    steady, uneven = list[str](), list[str]()
    for index, element in enumerate(pattern):
        for key, value in attributes(element):
            values = [other[index].get(key, "") for other in others]
            if _NUMBERS.fullmatch(value) and any(each != value for each in values):
                own = "its own" if index == 0 else f"{element.tag} {element.get('name', '')}".rstrip()
                change = f"{own} {key}"
                if len(set(values)) == 1:
                    steady.append(f"{change} {values[0]}")
                elif len(values) > 2 and _is_steady(values):
                    steady.append(f"{change} {values[0]} … {values[-1]}")
                else:
                    uneven.append(f"{change} {' | '.join(values)}")
    if len(uneven) > _MOST_UNEVEN:
        return None
    return f", but {', '.join([*uneven, *steady])}" if uneven or steady else ""


def _is_steady(values: Sequence[str]) -> bool:
    """Whether every number only grows or only shrinks along a row, as in a limb that tapers."""
    try:
        rows = np.array([[float(word) for word in value.split()] for value in values])
    except ValueError:
        return False
    steps = np.diff(rows, axis=0)
    return bool(np.all(np.all(steps >= 0, axis=0) | np.all(steps <= 0, axis=0)))


def _named(elements: Sequence[Element]) -> str:
    names = [_label(element) for element in elements]
    return ", ".join(names) if len(names) <= 2 else f"{names[0]}, {names[1]} … {names[-1]}"


def _label(element: Element) -> str:
    words = [value for _, value in attributes(element) if not _NUMBERS.fullmatch(value)]
    return element.get("name") or " ".join(words) or str(element.tag)


def _comment(text: str) -> str:
    return f" {text.replace('--', '- -')} "


def _remove(element: Element) -> None:
    parent = element.getparent()
    if parent is not None:
        parent.remove(element)
