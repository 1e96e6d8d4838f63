"""MJCF schema of the installed MuJoCo version, and the check of a document against it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache, lru_cache

from aidsr.core.artifacts import Fault
from aidsr.core.suggestions import closest_name
from aidsr.mjcf.elements import Element, join, load_fault
from aidsr.mjcf.forbidden import FORBIDDEN_ELEMENTS

_ROW = re.compile(
    r'padding-left:(?P<indent>\d+)"[^>]*class="el">(?P<name>[^<]*)</td>\s*'
    r'<td class="ty">(?P<times>.)</td>\s*<td class="at">(?P<attributes>.*?)</td>',
    re.DOTALL,
)
_NO_ATTRIBUTES = re.compile(r"<span.*")
_FIRST_INDENT, _INDENT = 5, 15

_ORIENTATION = frozenset({"quat", "axisangle", "xyaxes", "zaxis", "euler"})
_LIKE_BODY = {
    "frame": frozenset({"name", "childclass", "pos", "scale", "scaling", "massscale"}) | _ORIENTATION,
    "replicate": frozenset({"count", "offset", "euler", "sep", "childclass"}),
}
"""Elements that MuJoCo allows wherever a body is allowed, and their attributes. MuJoCo ignores unknown attributes of
these elements, so this is the only part of the schema that must be defined here.

Source: MuJoCo XML reference, "frame", "replicate", version 3.17.
"""


@dataclass(frozen=True, eq=False)
class ElementSchema:
    """Allowed attributes and children of an element."""

    name: str
    """Tag of the element."""
    once: bool
    """Whether it may occur at most once in its parent."""
    attributes: frozenset[str]
    children: dict[str, ElementSchema] = field(default_factory=dict)

    def walk(self) -> Iterator[ElementSchema]:
        """Yield this schema and the schemas of all possible descendants, each once."""
        seen: set[ElementSchema] = set()
        waiting = [self]
        while waiting:
            schema = waiting.pop()
            if schema not in seen:
                seen.add(schema)
                waiting.extend(schema.children.values())
                yield schema


@cache
def mjcf_schema() -> ElementSchema:
    """Return the schema of a whole document, from its root <mujoco>.

    Source: `mujoco.mj_printSchema` of the installed version.
    """
    import mujoco

    path: list[ElementSchema] = []
    for row in _ROW.finditer(mujoco.mj_printSchema(True, True)):
        del path[(int(row["indent"]) - _FIRST_INDENT) // _INDENT :]
        attributes = frozenset(_NO_ATTRIBUTES.sub("", row["attributes"]).split())
        schema = ElementSchema(row["name"].replace("(world)", ""), row["times"] in "!?", attributes)
        if path:
            path[-1].children[schema.name] = schema
        if row["times"] == "R":
            schema.children[schema.name] = schema
        path.append(schema)
    root = path[0]
    body = root.children.pop("body")
    for name, attributes in _LIKE_BODY.items():
        body.children[name] = ElementSchema(name, once=False, attributes=attributes, children=body.children)
    root.children["worldbody"] = ElementSchema(
        "worldbody", once=False, attributes=body.attributes, children=body.children
    )
    return root


@cache
def childless() -> frozenset[str]:
    """Return the tags of elements that never have children, apart from plugins, which are forbidden here."""
    holding = {schema.name for schema in mjcf_schema().walk() if schema.children.keys() - {"plugin"}}
    return frozenset(schema.name for schema in mjcf_schema().walk()) - holding - FORBIDDEN_ELEMENTS.keys()


@cache
def actuator_elements() -> tuple[str, ...]:
    """Return the tags of actuator elements, sorted, without plugins."""
    return tuple(sorted(mjcf_schema().children["actuator"].children.keys() - {"plugin"}))


@cache
def range_flags() -> dict[tuple[str, str], str]:
    """Return the attribute that switches a range on, by (tag, range attribute), such as limited for a joint's range."""
    return {
        (schema.name, name): flag
        for schema in mjcf_schema().walk()
        for name in schema.attributes
        if name.endswith("range") and (flag := name.removesuffix("range") + "limited") in schema.attributes
    }


# --- the check -------------------------------------------------------------------------------------------------------


def check_schema(root: Element) -> Iterator[Fault]:
    """Yield a fault for each element, attribute and repeated element that the schema of MJCF does not allow."""
    yield from _check(root, mjcf_schema())


def _check(element: Element, schema: ElementSchema) -> Iterator[Fault]:
    for attribute in element.attrib:
        if attribute not in schema.attributes:
            yield _unknown_attribute(element, str(attribute), schema)
    seen: set[str] = set()
    for child in element:
        if not isinstance(child.tag, str) or child.tag in FORBIDDEN_ELEMENTS:
            continue
        inside = schema.children.get(child.tag)
        if inside is None:
            yield _unknown_element(child, schema)
            continue
        if inside.once and child.tag in seen:
            yield load_fault("bad_value", child, f"stands more than once in <{element.tag}>", cure="keep one of them")
        seen.add(child.tag)
        yield from _check(child, inside)


_RENAMED = {("camera", "orthographic"): 'write projection="orthographic" for true'}
"""Corrections for attributes that MuJoCo has renamed. Source: XML reference, camera/projection."""


def _unknown_attribute(element: Element, attribute: str, schema: ElementSchema) -> Fault:
    cure = _RENAMED.get((schema.name, attribute)) or _cure_of_attribute(attribute, schema)
    return load_fault("unknown_attribute", element, f"has no attribute '{attribute[:100]}'", cure=cure)


@lru_cache(1000)
def _cure_of_attribute(attribute: str, schema: ElementSchema) -> str:
    everywhere = {name for other in mjcf_schema().walk() for name in other.attributes}
    near = _nearest(attribute, schema.attributes)
    elsewhere = _nearest(attribute, everywhere)
    if near and attribute not in everywhere:
        return f"did you mean '{near}'?"
    if elsewhere:
        homes = sorted({other.name for other in mjcf_schema().walk() if elsewhere in other.attributes})
        return f"'{elsewhere}' belongs to {_tags(homes)}"
    return "remove it; no element of MJCF has such an attribute"


def _unknown_element(element: Element, schema: ElementSchema) -> Fault:
    tag = str(element.tag)
    homes = sorted({other.name for other in mjcf_schema().walk() if tag in other.children})
    if homes:
        return load_fault(
            "unknown_element", element, f"cannot stand in <{schema.name}>", cure=f"it belongs in {_tags(homes)}"
        )
    return load_fault("unknown_element", element, "is not an element of MJCF", cure=_cure_of_element(tag, schema))


@lru_cache(1000)
def _cure_of_element(tag: str, schema: ElementSchema) -> str:
    near = _nearest(tag, schema.children) or _nearest(tag, {other.name for other in mjcf_schema().walk()})
    return f"did you mean <{near}>?" if near else f"<{schema.name}> may hold {_tags(sorted(schema.children))}"


def _nearest(name: str, right: Iterable[str]) -> str:
    """Return the name among `right` that a misspelt name most likely stands for, or "".

    Our choice: with a cutoff of 0.75, ctrl_range matches ctrlrange and stifness matches stiffness, but mass does not
    match class.
    """
    return closest_name(name.lower().replace("_", ""), right, cutoff=0.75)


def _tags(names: list[str]) -> str:
    return join(f"<{name}>" for name in names)
