"""Checks of names: duplicate names and references to names that do not exist."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping

from aidsr.core.artifacts import Fault
from aidsr.core.suggestions import closest_name
from aidsr.mjcf.elements import Element, attributes, elements, join, line_of, load_fault

ROBOT_PREFIX = "robot/"
"""Prefix that scene assembly puts before every name of the robot. A model without such names is a robot alone."""
_SECTIONS = frozenset({"actuator", "sensor", "equality", "tendon"})
"""Sections whose elements share one namespace, whatever their tag: a <motor> and a <position> are both actuators."""
_KINDS = {kind: kind for kind in ("body", "joint", "geom", "site", "camera", "light", "frame", "skin", "flex")}
_KINDS |= {kind: kind for kind in ("mesh", "hfield", "texture", "material", "pair", "exclude", "key")}
_KINDS |= {kind: kind for kind in ("numeric", "text", "tuple")} | {"freejoint": "joint", "flexcomp": "flex"}

REFERENCES: Mapping[str, str] = {
    "joint": "joint",
    "joint1": "joint",
    "joint2": "joint",
    "jointinparent": "joint",
    "site": "site",
    "site1": "site",
    "site2": "site",
    "sidesite": "site",
    "slidersite": "site",
    "cranksite": "site",
    "refsite": "site",
    "geom": "geom",
    "geom1": "geom",
    "geom2": "geom",
    "body": "body",
    "body1": "body",
    "body2": "body",
    "subtree1": "body",
    "subtree2": "body",
    "target": "body",
    "tendon": "tendon",
    "tendon1": "tendon",
    "tendon2": "tendon",
    "actuator": "actuator",
    "camera": "camera",
    "material": "material",
    "mesh": "mesh",
    "hfield": "hfield",
    "texture": "texture",
    "flex": "flex",
    "class": "default class",
    "childclass": "default class",
}
"""Attributes that refer to an element by name, and the kind of that element.

Source: MuJoCo XML reference, version 3.17.
"""

_BY_TYPE = {"objname": "objtype", "refname": "reftype"}
LISTS = frozenset({"body", "node"})  # attributes of <flex> that hold several names
_ELSEWHERE = frozenset({"visual", "option", "compiler", "size", "statistic"})
"""Sections whose attributes are not references although they may have the same names: <rgba joint="1 0 0 1"/> is a
colour."""
_ASSETS = frozenset({"mesh", "hfield", "texture"})
_PLURALS = {"body": "bodies", "default class": "default classes", "mesh": "meshes", "flex": "flexes"}
_NUMBERED = re.compile(r"(.*?)(?<!\d)(\d{1,9})(\D*)")


def duplicate_names(root: Element) -> Iterator[Fault]:
    """Yield a fault for each element with the name of an earlier element of the same kind."""
    first: dict[tuple[str, str], Element] = {}
    for element, kind in named_elements(root):
        before = first.setdefault((kind, element.get("name", "")), element)
        if before is not element:
            problem = f"the {kind} in line {line_of(before)} has this name already"
            yield load_fault("duplicate_name", element, problem, cure=f"give each {kind} a name of its own")


def undefined_references(root: Element) -> Iterator[Fault]:
    """Yield one fault for each kind of element with references to names that do not exist."""
    known = known_names(root)
    generated = tuple(_generated(root))
    missing: dict[str, dict[str, Element]] = defaultdict(dict)
    for element, kind, name in references(root):
        if name not in known[kind] and not name.startswith(generated):
            missing[kind].setdefault(name, element)
    for kind, users in missing.items():
        names = list(users)
        what = f"a {kind} that does" if len(names) == 1 else f"{_PLURALS.get(kind, kind + 's')} that do"
        yield load_fault(
            "missing_asset" if kind in _ASSETS else "undefined_reference",
            users[names[0]],
            f"names {what} not exist: {join(names)}",
            names=names,
            cure=_cure(kind, names, known[kind]),
        )


def named_elements(root: Element) -> Iterator[tuple[Element, str]]:
    """Yield each named element and its kind, without the entries of <default>."""
    described = _inside(root, {"default"})
    for element in elements(root):
        parent = element.getparent()
        if parent is not None and element.get("name") and element not in described:
            section = str(parent.tag)
            kind = section if section in _SECTIONS else _KINDS.get(str(element.tag))
            if kind:
                yield element, kind


def known_names(root: Element) -> dict[str, set[str]]:
    """Return the names of all elements, by kind of element."""
    known: dict[str, set[str]] = defaultdict(set)
    known["body"].add("world")
    known["default class"] = {"main"} | {element.get("class", "main") for element in elements(root, "default")}
    for element, kind in named_elements(root):
        known[kind].add(element.get("name", ""))
    return known


def _generated(root: Element) -> Iterator[str]:
    """Yield the prefixes of names that MuJoCo generates; only MuJoCo can tell whether such a name exists."""
    for generator in elements(root, "composite", "flexcomp"):
        yield generator.get("prefix" if generator.tag == "composite" else "name", "")
    for replicate in elements(root, "replicate"):
        for element in elements(replicate):
            if element.get("name"):
                yield element.get("name", "")


def references(root: Element) -> Iterator[tuple[Element, str, str]]:
    """Yield each reference to a name: the referring element, the kind of the named element, and the name."""
    elsewhere = _inside(root, _ELSEWHERE)
    for element in elements(root):
        if element in elsewhere:
            continue
        for name, value in attributes(element):
            kind = _kind_of_reference(element, name)
            if kind:
                for word in value.split() if element.tag == "flex" and name in LISTS else [value]:
                    yield element, kind, word


def _kind_of_reference(element: Element, attribute: str) -> str | None:
    if attribute in _BY_TYPE:
        kind = element.get(_BY_TYPE[attribute], "").removeprefix("x")
        return kind if kind in _KINDS.values() or kind in _SECTIONS else None
    if element.tag == "default":
        return None
    return REFERENCES.get(attribute)


def _inside(root: Element, tags: Collection[str]) -> set[Element]:
    """Return the elements with these tags and all elements inside them."""
    found = set[Element]()
    for each in elements(root, *tags):
        if each not in found:
            found.update(elements(each))
    return found


def _cure(kind: str, names: list[str], known: set[str]) -> str:
    numbered = _NUMBERED.fullmatch(names[0])
    if numbered:
        alike = [match for name in known if (match := _NUMBERED.fullmatch(name))]
        series = [int(match[2]) for match in alike if (match[1], match[3]) == (numbered[1], numbered[3])]
        if series:
            first, last = (f"{numbered[1]}{number}{numbered[3]}" for number in (min(series), max(series)))
            return f"the series runs from {first} to {last}"
    if near := closest_name(names[0], known):
        return f"did you mean '{near}'?"
    return (
        f"the document has {_PLURALS.get(kind, kind + 's')}: {join(sorted(known))}"
        if known
        else f"add a {kind} of that name"
    )
