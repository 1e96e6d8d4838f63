"""Repairs of shapes given by their two ends, and of the guides of tendons."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from aidsr.mjcf.defaults import default_classes, is_placed, setting
from aidsr.mjcf.location import Element, elements, numbers
from aidsr.validation.repairs.telling import told

__all__ = ["fromto_and_pos", "fromto_without_shape", "inherited_fromto", "repeated_guides"]

_LENGTHS = {"capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}
"""Shapes that fromto can span, and the numbers in size without it. Source: MuJoCo XML reference, body/geom."""


def fromto_without_shape(root: Element) -> Iterator[str]:
    """Make a capsule of what has two ends and a radius, and no type of its own that could have them."""
    classes = default_classes(root)
    for element in _shapes(root):
        kind, size = setting(element, "type", classes), setting(element, "size", classes)
        if "fromto" not in element.attrib or "type" in element.attrib or size is None:
            continue
        if (kind is None or kind.value not in _LENGTHS) and len(numbers(size.value)) <= _LENGTHS["capsule"]:
            element.set("type", "capsule")
            yield told(element, "made a capsule, since it has two ends and a radius")


def inherited_fromto(root: Element) -> Iterator[str]:
    """Take fromto out of a default class for elements whose own type has no two ends; the others get it written out."""

    def clashes(element: Element) -> bool:
        return "type" in element.attrib and element.get("type") not in _LENGTHS

    yield from _take_out(root, "fromto", clashes)


def fromto_and_pos(root: Element) -> Iterator[str]:
    """Keep what an element says itself, and of both its own fromto, where pos says nothing else.

    Its own pos says nothing else when it is the middle or an end of fromto; anything else may have been meant as a
    shift and is left alone. A pos of zeros is no fault: MuJoCo takes it for one that was not given.
    """
    for element in _shapes(root):
        if "fromto" in element.attrib and any(numbers(element.get("pos", ""))) and _says_nothing_else(element):
            del element.attrib["pos"]
            yield told(element, "dropped pos, since fromto already says where it is")
    classes = default_classes(root)

    def has_own_place(element: Element) -> bool:
        kind, size = setting(element, "type", classes), setting(element, "size", classes)
        length = len(numbers(size.value)) if size else 0
        return any(numbers(element.get("pos", ""))) and length >= _LENGTHS.get(kind.value if kind else "sphere", 1)

    def is_shifted(element: Element) -> bool:
        place = setting(element, "pos", classes)
        return "fromto" in element.attrib and place is not None and any(numbers(place.value))

    yield from _take_out(root, "pos", is_shifted)
    yield from _take_out(root, "fromto", has_own_place)


def repeated_guides(root: Element) -> Iterator[str]:
    """Drop a site that a tendon names twice in a row: the cable between the two has no length."""
    for tendon in elements(root, "spatial"):
        if next(tendon.iterancestors("default"), None) is not None:
            continue
        before: Element | None = None
        for guide in list(elements(tendon)):
            if guide.tag == "site" and before is not None and before.get("site") == guide.get("site"):
                tendon.remove(guide)
                yield told(tendon, f"dropped site '{guide.get('site')}', which stood twice in a row")
            elif guide is not tendon:
                before = guide if guide.tag == "site" else None


def _shapes(root: Element) -> list[Element]:
    return [element for element in elements(root, "geom", "site") if is_placed(element)]


def _says_nothing_else(element: Element) -> bool:
    ends, place = numbers(element.get("fromto", "")), numbers(element.get("pos", ""))
    if len(ends) != 6 or len(place) != 3:
        return False
    middle = [(ends[axis] + ends[axis + 3]) / 2.0 for axis in range(3)]
    return any(
        all(abs(given - other) <= 1e-6 for given, other in zip(place, point, strict=True))
        for point in (middle, ends[:3], ends[3:])
    )


def _take_out(root: Element, attribute: str, clashes: Callable[[Element], bool]) -> Iterator[str]:
    """Take an attribute out of the default classes that give it to elements it clashes with.

    Every other element that got it from there has it written out, so that nothing else changes.
    """
    classes = default_classes(root)
    for element in _shapes(root):
        found = setting(element, attribute, classes)
        while found is not None and not found.own and clashes(element):
            holder, value = found.holder, found.value
            for other in _shapes(root):
                theirs = setting(other, attribute, classes)
                if theirs is not None and theirs.holder is holder and not clashes(other):
                    other.set(attribute, value)
            del holder.attrib[attribute]
            yield told(element, f"dropped {attribute}{found.origin}, which does not fit what it says itself")
            found = setting(element, attribute, classes)
