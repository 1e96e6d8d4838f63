"""Fixes of names: of attributes, default classes and elements, and of references to them."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterator, Sequence

from aidsr.core.suggestions import one_slip_away, only_close_name
from aidsr.fixes.record import EditDocument, Fix, Request, note
from aidsr.mjcf.defaults import default_classes
from aidsr.mjcf.elements import Element, attributes, elements
from aidsr.mjcf.names import known_names, named_elements, references
from aidsr.mjcf.schema import ElementSchema, mjcf_schema

_SURE = 0.8
"""Smallest similarity with which a name counts as a misspelling of another. Our choice: one wrong letter in six."""

_SHORT = {"position": "pos", "direction": "dir", "quaternion": "quat", "reference": "ref"}
"""Words that MJCF abbreviates. Other words may begin with the name of an attribute and have another meaning, such as
damping_ratio or size_mm."""

_NUMBERS = re.compile(r"[0-9]+")

_OPTIONAL = ("sensor", "contact", "equality")
"""Sections whose entries are not essential for a robot."""


def misspelt_attributes(root: Element, _: Request) -> Iterator[str]:
    """Rename an attribute that no element of MJCF has to the only one of its element that is one slip away.

    A slip is a letter too many, too few, wrong or swapped with its neighbour; letter case, "_" and "-" do not count.
    """
    everywhere = _all_attributes()
    for element, schema in _with_schema(root, mjcf_schema()):
        for attribute in [str(name) for name in element.attrib]:
            if attribute in schema.attributes or attribute in everywhere:
                continue
            meant = one_slip_away(attribute, schema.attributes)
            if meant and meant not in element.attrib:
                _rename(element, attribute, meant)
                yield note(element, f"wrote {meant} for {attribute}")


def unknown_attributes(root: Element, _: Request) -> Iterator[str]:
    """Rename an attribute that no element of MJCF has to the one most like it, or that abbreviates it; else drop it.

    One that belongs to another element was not misspelt, and is dropped.
    """
    everywhere = _all_attributes()
    for element, schema in _with_schema(root, mjcf_schema()):
        for attribute in [str(name) for name in element.attrib if name not in schema.attributes]:
            plain = attribute.lower().replace("_", "")
            near = ""
            if attribute not in everywhere:
                near = only_close_name(plain, schema.attributes, cutoff=_SURE) or _SHORT.get(plain, "")
            if near in schema.attributes and near not in element.attrib:
                _rename(element, attribute, near)
                yield note(element, f"wrote {near} for {attribute}")
            else:
                del element.attrib[attribute]
                yield note(element, f"dropped {attribute}, which it does not have")


def missing_classes(root: Element, _: Request) -> Iterator[str]:
    """Drop a reference to a default class that does not exist: such a class gives nothing.

    A name one slip away from exactly one class means that class.
    """
    classes = default_classes(root)
    for element in elements(root):
        for attribute in ("class", "childclass"):
            name = element.get(attribute, "")
            if not name or name in classes or name == "main" or element.tag == "default":
                continue
            meant = one_slip_away(name, classes)
            if meant:
                element.set(attribute, meant)
                yield note(element, f"wrote {attribute} '{meant}' for '{name}', which does not exist")
            else:
                del element.attrib[attribute]
                yield note(element, f"dropped {attribute} '{name}', which does not exist")


def undefined_references(root: Element, request: Request) -> Iterator[str]:
    """Replace a name that does not exist by the most similar name of its kind, or by the only unused one.

    A name is unused if no other reference of the same kind names it: no tendon goes through it, no actuator drives it.
    Without such a name, a reference to a material is dropped, and so are sensors, contacts and equalities.
    """
    known = known_names(root)
    for element, kind, name in list(references(root)):
        if name not in request.names or name in known[kind] or kind == "default class":
            continue
        attribute = next((key for key, value in attributes(element) if value == name and key != "name"), None)
        parent = element.getparent()
        if attribute is None or parent is None:  # one of several names in a list, or dropped before
            continue
        near = only_close_name(name, known[kind], cutoff=_SURE) or _left_over(element, attribute, known[kind])
        if near:
            element.set(attribute, near)
            yield note(element, f"wrote {kind} '{near}' for '{name}', which does not exist")
        elif attribute == "material":
            del element.attrib[attribute]
            yield note(element, f"dropped material '{name}', which does not exist")
        elif parent.tag in _OPTIONAL:
            parent.remove(element)
            yield note(element, f"dropped, since it names {kind} '{name}', which does not exist")


def _left_over(user: Element, attribute: str, known: Collection[str]) -> str:
    """Return the only known name that no other reference of the same kind uses; "" if there is none or more than one.

    Names that differ from that of the reference only in their numbers take precedence; for entries of `_OPTIONAL`
    sections only these are considered.
    """
    parent = user.getparent()
    section = parent.getparent() if parent is not None and parent.tag == "spatial" else parent
    alike = section.iter(str(user.tag)) if section is not None else ()
    named_too = {each.get(attribute) for each in alike}
    pattern = _NUMBERS.sub("0", user.get(attribute, ""))
    free = [name for name in known if name not in named_too and name != "world"]
    likely = [name for name in free if _NUMBERS.sub("0", name) == pattern]
    if not likely and parent is not None and parent.tag not in _OPTIONAL:
        likely = free
    return likely[0] if len(likely) == 1 else ""


def duplicate_names(root: Element, request: Request) -> Iterator[str]:
    """Rename a thing whose name another of its kind bears, where nothing refers to that name."""
    referred = {(kind, name) for _, kind, name in references(root)}
    yield from _rename_duplicates(root, lambda kind, name: (kind, name) in referred or name in request.kept_names)


def duplicate_names_in_use(root: Element, _: Request) -> Iterator[str]:
    """Rename a thing whose name another of its kind bears; references mean the first from then on.

    The path of a tendon instead refers to the site that is nearest to the sites before and after it, counted in bodies.
    """
    shared = {name: sites for name, sites in _sites(root).items() if len(sites) > 1}
    yield from _rename_duplicates(root, lambda _kind, _name: False)
    for name, sites in shared.items():
        yield from _reroute(root, name, sites)


def _sites(root: Element) -> dict[str, list[Element]]:
    found = defaultdict(list)
    for element, kind in named_elements(root):
        if kind == "site" and not _is_replicated(element):
            found[element.get("name", "")].append(element)
    return found


def _reroute(root: Element, name: str, sites: Sequence[Element]) -> Iterator[str]:
    """Change the paths of tendons through a site whose name was ambiguous to the nearest of these sites."""
    alone = {name: sites[0] for name, sites in _sites(root).items() if len(sites) == 1}
    for path in root.iterfind("tendon/spatial"):
        stops = [stop for stop in path if stop.tag == "site"]
        for k, stop in enumerate(stops):
            if stop.get("site") != name:
                continue
            beside = [
                alone[other.get("site", "")]
                for other in (*stops[max(k - 1, 0) : k], *stops[k + 1 : k + 2])
                if other.get("site") in alone and other.get("site") != name
            ]
            nearest = min(sites, key=lambda site: sum(_bodies_between(site, other) for other in beside))
            if nearest is not sites[0]:
                stop.set("site", nearest.get("name", ""))
                yield note(
                    path, f"goes through '{nearest.get('name')}' instead of '{name}', which is farther off its way"
                )


def _bodies_between(one: Element, other: Element) -> int:
    """Return the number of steps between parent and child from the body of one element to that of another."""
    above = [set(each.iterancestors("body")) for each in (one, other)]
    return len(above[0] ^ above[1])


def _rename_duplicates(root: Element, keeps: Callable[[str, str], bool]) -> Iterator[str]:
    taken: dict[str, set[str]] = defaultdict(set)
    for element, kind in named_elements(root):
        taken[kind].add(element.get("name", ""))
    for _, kind, name in references(root):
        taken[kind].add(name)
    seen: Counter[tuple[str, str]] = Counter()
    for element, kind in list(named_elements(root)):
        name = element.get("name", "")
        seen[kind, name] += 1
        number = seen[kind, name]
        if number == 1 or keeps(kind, name) or _is_replicated(element):
            continue
        while f"{name}_{number}" in taken[kind]:
            number += 1
        taken[kind].add(f"{name}_{number}")
        sentence = note(element, f"renamed to '{name}_{number}', since another {kind} bears this name")
        element.set("name", f"{name}_{number}")
        yield sentence


def _is_replicated(element: Element) -> bool:
    return next(element.iterancestors("replicate"), None) is not None


def _all_attributes() -> Collection[str]:
    return {name for schema in mjcf_schema().walk() for name in schema.attributes}


def _with_schema(element: Element, schema: ElementSchema) -> Iterator[tuple[Element, ElementSchema]]:
    """Yield each element that MJCF allows in its place, with its schema."""
    yield element, schema
    for child in element:
        inside = schema.children.get(child.tag) if isinstance(child.tag, str) else None
        if inside is not None:
            yield from _with_schema(child, inside)


def _rename(element: Element, attribute: str, right: str) -> None:
    """Rename an attribute and keep its position among the attributes, for the reader of the document."""
    written = attributes(element)
    element.attrib.clear()
    for name, value in written:
        element.set(right if name == attribute else name, value)


FIXES: tuple[Fix[EditDocument], ...] = (
    Fix(misspelt_attributes, cures=("unknown_attribute",), safe=True),
    Fix(missing_classes, cures=("undefined_reference",), safe=True),
    Fix(duplicate_names, cures=("duplicate_name",), safe=True),
    Fix(unknown_attributes, cures=("unknown_attribute",)),
    Fix(undefined_references, cures=("undefined_reference",)),
    Fix(duplicate_names_in_use, cures=("duplicate_name",)),
)
