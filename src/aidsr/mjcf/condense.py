"""Condensed MJCF for a language model: repeated elements are shown once.

Limbs are chains of nearly equal links, hands have several equal fingers, and tendons pass dozens of sites. A language
model that judges, places or repairs a robot needs the pattern, not every copy. Comments replace the omitted elements;
they give their names and the numbers that differ. Materials and colours are removed without a comment.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator, Sequence

import numpy as np
from lxml import etree

from aidsr.core.errors import IsolationError, MjcfError
from aidsr.mjcf.elements import Element, attributes
from aidsr.mjcf.read import parse_document
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits

_LEAST_LEFT_OUT = 2
"""Smallest number of elements that a comment replaces. Our choice: for fewer, a comment saves nothing."""
_NUMBERS = re.compile(r"\s*[-+]?\.?\d[-+.\deE]*(\s+[-+]?\.?\d[-+.\deE]*)*\s*")
_COUNTED = re.compile(
    r"([a-z]|(?<=[A-Z_]))\d+[a-z]?(?![a-z])|(?<=_)[a-z](?![a-z])"
    r"|(?<![a-z])(left|right|front|rear|middle|back|top|bottom|upper|lower)(?![a-z])"
)
"""Parts of a name that differ between copies: numbers with an adjacent letter, single letters, sides."""
_MAX_COMMENT_SHARE = 0.5
"""Largest length of the differences in a comment / length of the elements it replaces. Our choice: a longer comment
saves too little."""
_DIGITS = re.compile(r"\d+")
_MOST_KINDS = 2
"""Largest number of different sets of extra parts that only some links of a chain have. Our choice: feet on some links,
a tool on another."""
_MOST_UNEVEN = 8
"""Largest number of attributes that differ between copies without growing or shrinking steadily. Our choice: with more,
the comment is as hard to read as the copies, which are shown instead."""
_VISUAL_ATTRIBUTES = {"material", "rgba", "group"}
_UNORDERED = ("sensor", "contact", "actuator", "tendon")
"""Sections whose elements may be reordered."""
_WHOLE = ("body", "spatial", "fixed", "default")
"""Elements with children, of which one shows what its copies are like."""


def condense(mjcf: str) -> str | None:
    """Return an MJCF text without its repetitions and visual attributes; None if it cannot be read in time."""
    try:
        return _condensed(mjcf)
    except (MjcfError, IsolationError):
        return None


@isolated(limits=Limits(wall_s=20.0, memory_mib=2048))
def _condensed(mjcf: str) -> str:
    """Condense a text in an isolated process: a malicious text could make the comparison of its parts slow.

    Raises:
        MjcfError: The text is not an MJCF document.
        IsolationError: The calculation exceeded its limits of time or memory.
    """
    root = copy.deepcopy(parse_document(mjcf).root)
    _drop_visuals(root)
    for body in list(root.iter("body")):
        _shorten_chain(body)
    for section in root.iter(*_UNORDERED):
        section[:] = sorted(section, key=lambda element: (str(element.tag), repr(_shape(element))))
    for element in list(root.iter(etree.Element)):
        for row in list(_rows(element)):
            _shorten_row(row)
    etree.indent(root, space=" ")
    return str(etree.tostring(root, encoding="unicode")) + "\n"


def _drop_visuals(root: Element) -> None:
    for element in [*root.iter(etree.Comment), *root.iter("visual", "material", "texture")]:
        _remove(element)
    for element in root.iter(etree.Element):
        for key in _VISUAL_ATTRIBUTES & set(element.attrib):
            del element.attrib[key]
    for element in list(root.iter("asset", "default")):
        emptied = [child for child in element if child.tag in ("geom", "site") and not child.attrib]
        for child in emptied:  # outside these sections, an element without attributes has those of its class
            element.remove(child)
        if element.tag == "asset" and not len(element):
            _remove(element)


def _shorten_chain(first: Element) -> None:
    """Replace links of a chain that are like its second link by a comment; bodies after them move into the second link.

    Args:
        first: First link of the chain; changed in place.
    """
    chain = [first]
    while (link := _next_link(chain[-1])) is not None and (len(chain) == 1 or _matched(chain[1], link)):
        chain.append(link)
    left_out = chain[2:]
    if len(left_out) < _LEAST_LEFT_OUT:
        return
    pattern, following = chain[1], chain[-1].findall("body")
    matches = [match for link in left_out if (match := _matched(pattern, link))]
    differences = _differences(
        [pattern, *_within(_own(pattern))],
        [[link, *_within(alike)] for link, (alike, _) in zip(left_out, matches, strict=True)],
    )
    also = _also([(link, more) for link, (_, more) in zip(left_out, matches, strict=True) if more])
    if differences is None or also is None:
        return
    comment = f"{len(left_out)} more, {_names_of(left_out)}: each inside the one before and like {pattern.get('name')}"
    left_out[0].addprevious(etree.Comment(_comment(comment + differences + also)))
    _remove(left_out[0])
    pattern.extend(following)


def _matched(pattern: Element, link: Element) -> tuple[list[Element], list[Element]] | None:
    """Return the parts of a link that match the parts of the pattern, and its extra parts; None if one has no match.

    The parts may be in another order; parts that differ only in the numbers of their names are matched first.
    """
    if _opening(link) != _opening(pattern):
        return None
    left, alike = _own(link), list[Element]()
    for part in _own(pattern):
        like = [other for other in left if _shape(other) == _shape(part)]
        if not like:
            return None
        alike.append(next((other for other in like if _unnumbered(other) == _unnumbered(part)), like[0]))
        left.remove(alike[-1])
    return alike, left


def _also(links: Sequence[tuple[Element, list[Element]]]) -> str | None:
    """Return text for the extra parts of some links, each kind quoted once; None if it would be too long."""
    kinds: dict[tuple[object, ...], list[tuple[Element, list[Element]]]] = {}
    for link, more in links:
        kinds.setdefault(tuple(_shape(part) for part in more), []).append((link, more))
    if len(kinds) > _MOST_KINDS:
        return None
    comment = ""
    for alike in kinds.values():
        (_, quoted), *others = alike
        differences = _differences(_within(quoted), [_within(more) for _, more in others])
        if differences is None:
            return None
        names = ", ".join(_label(link) for link, _ in alike)
        quotation = "".join(str(etree.tostring(part, encoding="unicode", with_tail=False)) for part in quoted)
        called = [_names_of(parts) for parts in zip(*(more for _, more in alike), strict=True) if parts[0].get("name")]
        own_names = f" ({'; '.join(called)})" if others and called else ""
        comment += f"; {names} also {'have' if others else 'has'} {quotation}{own_names}{differences}"
    return comment


def _shorten_row(row: Sequence[Element]) -> None:
    """Replace the elements of a row that are like its first element by a comment.

    Of elements without children (not in `_WHOLE`), the last one is kept too.
    """
    whole = row[0].tag in _WHOLE
    left_out = row[1:] if whole else row[1:-1]
    if len(left_out) < (1 if whole else _LEAST_LEFT_OUT):
        return
    if not _leave_out(row[0], left_out, whole) and whole:
        # the limbs on one side of a robot are often equal to each other
        sides: dict[tuple[str, ...], list[Element]] = {}
        for element in left_out:
            sides.setdefault(_numbers_inside(element), []).append(element)
        for side in sides.values():
            _leave_out(row[0], side, whole)


def _leave_out(pattern: Element, left_out: Sequence[Element], whole: bool) -> bool:
    """Replace elements that are like the pattern by a comment; return False and do nothing if it would be too long."""
    comment = (
        f"{_names_of(left_out)}: like {_label(pattern)}" if whole else f"{len(left_out)} more: {_names_of(left_out)}"
    )
    differences = _differences(_elements(pattern), [_elements(element) for element in left_out])
    if differences is None:
        return False
    if whole and len(differences) > sum(len(etree.tostring(element)) for element in left_out) * _MAX_COMMENT_SHARE:
        return False
    if differences and any(True for _ in pattern.iter(etree.Comment)):
        differences += ", and likewise in the parts that are like these"
    left_out[0].addprevious(etree.Comment(_comment(comment + differences)))
    for element in left_out:
        _remove(element)
    return True


def _rows(parent: Element) -> Iterator[list[Element]]:
    """Yield each sequence of neighbouring children of the same shape."""
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
    """Return the body inside a link if there is exactly one, else None."""
    inside = link.findall("body")
    return inside[0] if len(inside) == 1 else None


def _shape(element: Element) -> tuple[object, ...]:
    """Return the tag, attributes and children of an element without its numbers and the varying parts of its names."""
    if isinstance(element, etree._Comment):
        return (_COUNTED.sub("#", element.text or ""),)
    return (*_opening(element), *(_shape(child) for child in element))


def _own(link: Element) -> list[Element]:
    """Return the children of a link that are not bodies."""
    return [child for child in link if child.tag != "body"]


def _unnumbered(element: Element) -> tuple[object, ...]:
    """Return the tag, attributes and children of an element without the numbers in its names."""
    words = tuple(sorted((k, v if _NUMBERS.fullmatch(v) else _DIGITS.sub("#", v)) for k, v in attributes(element)))
    return (element.tag, words, *(_unnumbered(child) for child in element.iterchildren(etree.Element)))


def _opening(element: Element) -> tuple[object, ...]:
    words = {k: "#" if _NUMBERS.fullmatch(v) else _COUNTED.sub("#", v) for k, v in attributes(element)}
    return (element.tag, tuple(sorted(words.items())))


def _numbers_inside(element: Element) -> tuple[str, ...]:
    """Return the numeric attribute values of all elements inside an element."""
    inside = _elements(element)[1:]
    return tuple(value for each in inside for _, value in attributes(each) if _NUMBERS.fullmatch(value))


def _elements(element: Element) -> list[Element]:
    return list(element.iter(etree.Element))


def _within(parts: Sequence[Element]) -> list[Element]:
    return [element for part in parts for element in _elements(part)]


def _differences(pattern: Sequence[Element], others: Sequence[Sequence[Element]]) -> str | None:
    """Return text about the numbers in which omitted elements differ from the shown one; None if there are too many.

    Args:
        pattern: The shown element and the elements inside it.
        others: For each omitted element, the elements that correspond to those of the pattern.
    """
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
    """Return whether every number only grows or only shrinks along the values, as in a tapered limb."""
    try:
        rows = np.array([[float(word) for word in value.split()] for value in values])
    except ValueError:
        return False
    steps = np.diff(rows, axis=0)
    return bool(np.all(np.all(steps >= 0, axis=0) | np.all(steps <= 0, axis=0)))


def _names_of(elements: Sequence[Element]) -> str:
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
