"""Comparison of two versions of a robot, to check that parts that the user wants to keep have not changed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest

from aidsr.core.artifacts import Keep
from aidsr.mjcf.defaults import default_classes, described
from aidsr.mjcf.elements import Element, attributes, describe, elements, numbers
from aidsr.mjcf.read import parse_document
from aidsr.sandbox.isolated import isolated

_NAMES = {"name", "class", "childclass"}
"""Attributes that are not compared: only the effective values of the others matter, not the class they come from."""
_MAX_CHANGES = 6
"""Maximum number of changes of kept parts in one complaint. Our choice: they mostly have one cause."""


@isolated
def changes_to_kept_parts(before: str, after: str, keep: Sequence[Keep]) -> list[str]:
    """Return one sentence for each change of a part that should be kept; empty if there is none.

    A part is compared including everything inside it, by the effective values of all attributes, including those from
    default classes. Numbers are compared by value.

    Args:
        before: MJCF of the original robot.
        after: MJCF of the rewritten robot.
        keep: Parts that should not change.

    Raises:
        MjcfError: One of the two is not an MJCF document.
        IsolationError: The comparison exceeded its limits of time or memory.
    """
    old, new = (parse_document(text).root for text in (before, after))
    return changes_between(old, new, keep)


def changes_between(old: Element, new: Element, keep: Sequence[Keep]) -> list[str]:
    """Return one sentence for each change of a part that should be kept, see `changes_to_kept_parts`.

    Args:
        old: Root element of the original document.
        new: Root element of the changed document.
        keep: Parts that should not change.
    """
    return [sentence for each in keep for sentence in _changes_to(each, old, new)]


def parts_in(root: Element, keep: Sequence[Keep]) -> list[Keep]:
    """Return those of some parts to keep that a document has.

    Args:
        root: Root element of the document.
        keep: Parts that should not change.
    """
    return [each for each in keep if _find(root, each.name) is not None]


def changes_in_words(changes: Sequence[str]) -> str:
    """Return changes of kept parts as one text: the first ones in full, and the number of the others."""
    more = f" And {len(changes) - _MAX_CHANGES} more." if len(changes) > _MAX_CHANGES else ""
    return " ".join(changes[:_MAX_CHANGES]) + more


@isolated
def part_names(mjcf: str) -> list[str]:
    """Return the names of all parts of a robot that can be kept, each once, in the order of the document.

    Args:
        mjcf: MJCF of the robot.

    Raises:
        MjcfError: It is not an MJCF document.
        IsolationError: Reading it exceeded its limits of time or memory.
    """
    return list(dict.fromkeys(name for each in _parts(parse_document(mjcf).root) if (name := each.get("name"))))


def _changes_to(keep: Keep, old: Element, new: Element) -> Iterator[str]:
    was, now = (_find(root, keep.name) for root in (old, new))
    if was is None:
        yield f'There was no part named "{keep.name}" to keep.'
        return
    if now is None:
        yield f'"{keep.name}" is to be kept and is gone.'
        return
    classes = default_classes(old), default_classes(new)
    inside = zip_longest(elements(was), elements(now))
    for before, after in inside:
        if before is None or after is None or before.tag != after.tag or before.get("name") != after.get("name"):
            named = [describe(each) if each is not None else "nothing" for each in (before, after)]
            yield f'Of "{keep.name}", which is to be kept, {named[0]} became {named[1]}.'
            return
        one, other = _values(before, classes[0]), _values(after, classes[1])
        for key in sorted((one.keys() | other.keys()) - set(keep.but)):
            if not _same(one.get(key), other.get(key)):
                change = f"{key} was {one.get(key, 'not set')} and is {other.get(key, 'not set')}"
                yield f'Of "{keep.name}", which is to be kept, {describe(before)} changed: {change}.'


def _find(root: Element, name: str) -> Element | None:
    return next((each for each in _parts(root) if each.get("name") == name), None)


def _parts(root: Element) -> Iterator[Element]:
    return (each for each in elements(root) if each is not root)


def _values(element: Element, classes: Mapping[str, Element]) -> dict[str, str]:
    """Return the effective values of an element's attributes, including those from default classes."""
    values: dict[str, str] = {}
    for holder in (element, *described(element, classes)):
        for key, value in attributes(holder):
            values.setdefault(key, value)
    return {key: value for key, value in values.items() if key not in _NAMES}


def _same(one: str | None, other: str | None) -> bool:
    if one is None or other is None:
        return one is other
    return one.split() == other.split() or (bool(numbers(one)) and numbers(one) == numbers(other))
