"""Effective attributes: an element's own ones, else those of its default class and the enclosing classes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from aidsr.mjcf.elements import Element, elements
from aidsr.mjcf.schema import mjcf_schema


@dataclass(frozen=True, eq=False)
class Setting:
    """The effective value of an attribute and its origin."""

    value: str
    """Effective value."""
    holder: Element
    """Element that has the attribute: the element itself, or the entry for its kind in a <default>."""
    own: bool
    """Whether the holder is the element itself."""

    @property
    def origin(self) -> str:
        """Text that names the default class of the value; empty if the value is the element's own."""
        default = self.holder.getparent()
        return "" if self.own or default is None else f" (from default class '{default.get('class', 'main')}')"


def default_classes(root: Element) -> Mapping[str, Element]:
    """Return the <default> element of each class by name; for several <default> elements of a class, the last one."""
    return {element.get("class", "main"): element for element in elements(root, "default")}


def setting(element: Element, attribute: str, classes: Mapping[str, Element]) -> Setting | None:
    """Return the effective value of an attribute, or None if neither the element nor a default class sets it."""
    if attribute in element.attrib:
        return Setting(element.get(attribute, ""), element, own=True)
    for holder in described(element, classes):
        if attribute in holder.attrib:
            return Setting(holder.get(attribute, ""), holder, own=False)
    return None


def class_of(element: Element) -> str:
    """Return the name of the default class an element belongs to."""
    if element.get("class"):
        return element.get("class", "")
    for ancestor in element.iterancestors("body", "frame", "replicate", "worldbody"):
        if ancestor.get("childclass"):
            return ancestor.get("childclass", "")
    return "main"


def is_placed(element: Element) -> bool:
    """Return whether a geom, site or joint belongs to a body, not to a default, a tendon, a composite or a flexcomp."""
    holders = {str(ancestor.tag) for ancestor in element.iterancestors()}
    return "worldbody" in holders and not holders & {"composite", "flexcomp"}


def described(element: Element, classes: Mapping[str, Element]) -> Iterator[Element]:
    """Yield the entries for an element's kind in its default class and the enclosing classes, nearest first.

    For an element that is itself an entry in a <default>, the entries begin with those of this <default>.
    """
    holder, kinds = element.getparent(), _kinds(str(element.tag))
    default = holder if holder is not None and holder.tag == "default" else classes.get(class_of(element))
    while default is not None:
        yield from default.iterchildren(*kinds, reversed=True)
        default = _around(default)


def _kinds(tag: str) -> Iterable[str]:
    """Return the tags of the <default> entries that apply to an element with this tag.

    All actuators share one set of defaults, and so do all tendons.

    Source: MuJoCo XML reference, default; of several entries for the same defaults, the last one holds.
    """
    sections = mjcf_schema().children
    if tag in sections["actuator"].children:
        return sections["actuator"].children
    return ("tendon",) if tag in sections["tendon"].children else (tag,)


def _around(default: Element) -> Element | None:
    """Return the <default> from which this one inherits: the enclosing one, or the preceding top-level one.

    Source: MuJoCo merges repeated top-level sections in order, and a class starts as a copy of its enclosing class.
    """
    around = default.getparent()
    if around is not None and around.tag == "default":
        return around
    return next(default.itersiblings("default", preceding=True), None)
