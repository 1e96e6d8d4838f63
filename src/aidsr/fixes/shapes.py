"""Fixes of geoms and sites given by their two ends, of contradicting attributes, and of the paths of tendons."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence

from lxml import etree

from aidsr.fixes.record import EditDocument, Fix, Request, note
from aidsr.mjcf.defaults import default_classes, is_placed, setting
from aidsr.mjcf.elements import Element, elements, numbers

_LENGTHS = {"capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}
"""Types that can be given by fromto, and how many numbers their size has without it. Source: MuJoCo XML reference,
body/geom."""

_WORD = re.compile(r"[0-9]+|[^\W0-9_]+|[\W_]+")
"""Words into which names are split for a comparison: letters, numbers, and the characters between them."""

_ORIENTATIONS = ("quat", "axisangle", "xyaxes", "zaxis", "euler")


def fromto_without_shape(root: Element, _: Request) -> Iterator[str]:
    """Make a capsule of what has `fromto` and a radius, and no type of its own that has two ends."""
    classes = default_classes(root)
    for element in _shapes(root):
        kind, size = setting(element, "type", classes), setting(element, "size", classes)
        if "fromto" not in element.attrib or "type" in element.attrib or size is None:
            continue
        if (kind is None or kind.value not in _LENGTHS) and len(numbers(size.value)) <= _LENGTHS["capsule"]:
            element.set("type", "capsule")
            yield note(element, "made a capsule, since it has two ends and a radius")


def inherited_fromto(root: Element, _: Request) -> Iterator[str]:
    """Remove `fromto` from a default class if an element's own type has no two ends; write it on the other elements."""

    def clashes(element: Element) -> bool:
        return "type" in element.attrib and element.get("type") not in _LENGTHS

    yield from _take_out(root, "fromto", clashes)


def fromto_and_pos(root: Element, _: Request) -> Iterator[str]:
    """Drop a `pos` that agrees with `fromto`; if only one of the two is from a default class, drop that one.

    An element's own pos agrees with fromto if it is the middle or an end of it. Any other pos may be meant as a shift
    and is left alone. A pos of zeros is no fault, since MuJoCo treats it as absent.
    """
    for element in _shapes(root):
        if "fromto" in element.attrib and any(numbers(element.get("pos", ""))) and _says_nothing_else(element):
            del element.attrib["pos"]
            yield note(element, "dropped pos, since fromto already says where it is")
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


def contradicting_attributes(root: Element, _: Request) -> Iterator[str]:
    """Drop `pos` beside `fromto` and all orientations but the first; a sphere with two ends becomes a capsule.

    Other types that have no two ends lose `fromto`.
    """
    for element in elements(root, "geom", "site"):
        kind = element.get("type")
        if "fromto" in element.attrib and any(numbers(element.get("pos", ""))):
            del element.attrib["pos"]
            yield note(element, "dropped pos, which contradicts fromto")
        if "fromto" in element.attrib and kind == "sphere":
            element.set("type", "capsule")
            yield note(element, "made a capsule, since it has two ends")
        elif "fromto" in element.attrib and kind is not None and kind not in _LENGTHS:
            del element.attrib["fromto"]
            yield note(element, f"dropped fromto, which a {kind} cannot have")
    yield from _classes_without_ends(root)
    for element in elements(root):
        for orientation in [name for name in _ORIENTATIONS if name in element.attrib][1:]:
            del element.attrib[orientation]
            yield note(element, f"dropped {orientation}, a second orientation")


def _classes_without_ends(root: Element) -> Iterator[str]:
    """Drop the class of an element with `fromto` if the class gives it a type without two ends and no size."""
    classes = default_classes(root)
    for element in _shapes(root):
        kind, size = setting(element, "type", classes), setting(element, "size", classes)
        if "fromto" not in element.attrib or "type" in element.attrib or kind is None or kind.value in _LENGTHS:
            continue
        if size is None and "class" in element.attrib:
            left = element.get("class", "")
            del element.attrib["class"]
            yield note(element, f"left the class '{left}', which makes it a {kind.value} without size")


def repeated_guides(root: Element, _: Request) -> Iterator[str]:
    """Drop a site that a tendon names twice in a row: the cable between the two has no length."""
    for tendon in _placed_paths(root):
        before: Element | None = None
        for guide in list(elements(tendon)):
            if guide.tag == "site" and before is not None and before.get("site") == guide.get("site"):
                tendon.remove(guide)
                yield note(tendon, f"dropped site '{guide.get('site')}', which stood twice in a row")
            elif guide is not tendon:
                before = guide if guide.tag == "site" else None


def unbracketed_guides(root: Element, _: Request) -> Iterator[str]:
    """Drop a shape that a tendon wraps around without a site on each side, and a pulley that nothing follows."""
    for tendon in _placed_paths(root):
        while (wrong := _first_unbracketed(list(elements(tendon))[1:])) is not None:
            tendon.remove(wrong)
            yield note(tendon, f"dropped <{wrong.tag}>, which stood without a site on each side")


def _first_unbracketed(path: Sequence[Element]) -> Element | None:
    for k, stop in enumerate(path):
        before, after = path[k - 1] if k else None, path[k + 1] if k + 1 < len(path) else None
        if stop.tag == "pulley":
            alone = after is None or after.tag == "pulley"
        else:
            alone = stop.tag == "geom" and any(each is None or each.tag != "site" for each in (before, after))
        if alone:
            return stop
    return None


def cut_paths(root: Element, _: Request) -> Iterator[str]:
    """Complete the path of a tendon with a single site like that of another tendon, through sites with similar names.

    The names of the two first sites may differ in one word or number. This word is replaced in all names of the other
    path; the resulting names must be those of sites that no tendon uses.
    """
    sites = {site.get("name", "") for site in elements(root, "site") if is_placed(site)}
    paths = [[stop.get("site", "") for stop in elements(tendon, "site")] for tendon in _placed_paths(root)]
    taken = {name for path in paths for name in path}
    for tendon, path in zip(_placed_paths(root), paths, strict=True):
        if len(path) != 1 or len(list(elements(tendon))) != 2:
            continue
        led = [_led_alike(other, path[0]) for other in paths if len(other) > 1]
        found = {tuple(each) for each in led if len(each) > 1 and set(each[1:]) <= sites - taken}
        if len(found) == 1:
            for name in next(iter(found))[1:]:
                etree.SubElement(tendon, "site", site=name)
            yield note(tendon, f"led through {', '.join(next(iter(found)))}, as another tendon is")


def _led_alike(path: Sequence[str], first: str) -> list[str]:
    """Return the names of a path with the word replaced in which the first one differs from `first`.

    Empty if the first names differ in more than one word, or if the word is not at the same place in all names.
    """
    one, other = (_WORD.findall(name) for name in (path[0], first))
    apart = [k for k, (word, wanted) in enumerate(zip(one, other, strict=False)) if word != wanted]
    if len(one) != len(other) or len(apart) != 1:
        return []
    # the place of the word is counted from the beginning of every name, or from its end
    for place in (apart[0], apart[0] - len(one)):
        words = [_WORD.findall(name) for name in path]
        if all(-len(each) <= place < len(each) and each[place] == one[place] for each in words):
            return ["".join([*each[:place], other[place], *each[place:][1:]]) for each in words]
    return []


def _placed_paths(root: Element) -> list[Element]:
    return [each for each in elements(root, "spatial") if next(each.iterancestors("default"), None) is None]


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
    """Remove an attribute from the default classes that give it to elements that it does not fit.

    It is written on every other element that inherited it from there, so that these elements do not change.

    Args:
        root: Root of the document; changed in place.
        attribute: Attribute to remove.
        clashes: Function that returns whether the inherited attribute does not fit an element.
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
            yield note(element, f"dropped {attribute}{found.origin}, which does not fit what it says itself")
            found = setting(element, attribute, classes)


FIXES: tuple[Fix[EditDocument], ...] = (
    Fix(fromto_without_shape, cures=("wrong_for_type",), safe=True),
    Fix(inherited_fromto, cures=("wrong_for_type",), safe=True),
    Fix(fromto_and_pos, cures=("wrong_for_type",), safe=True),
    Fix(repeated_guides, cures=("tendon_path_invalid",), safe=True),
    Fix(unbracketed_guides, cures=("tendon_path_invalid",)),
    Fix(cut_paths, cures=("tendon_path_invalid",)),
    Fix(contradicting_attributes, cures=("wrong_for_type",)),
)
