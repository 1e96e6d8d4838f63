"""Attributes as MuJoCo sees them: the element's own, else those of its default class and the classes around it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from aidsr.mjcf.elements import Element, elements
from aidsr.mjcf.schema import mjcf_schema


@dataclass(frozen=True, eq=False)
class Setting:
    """A value and the element it is written on: the element itself, or a description of its kind in a default."""

    value: str
    holder: Element
    own: bool

    @property
    def origin(self) -> str:
        """Words for where the value comes from; empty for the element itself."""
        default = self.holder.getparent()
        return "" if self.own or default is None else f" (from default class '{default.get('class', 'main')}')"


def default_classes(root: Element) -> Mapping[str, Element]:
    """Return the <default> element of each class by name; of the outermost class, which may have several, the last."""
    return {element.get("class", "main"): element for element in elements(root, "default")}


def setting(element: Element, attribute: str, classes: Mapping[str, Element]) -> Setting | None:
    """Return an attribute as MuJoCo sees it, or None where nothing sets it."""
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
    """Whether a geom, site or joint is one of a body, not a default, a tendon's waypoint or a composite's pattern."""
    holders = {str(ancestor.tag) for ancestor in element.iterancestors()}
    return "worldbody" in holders and not holders & {"composite", "flexcomp"}


def described(element: Element, classes: Mapping[str, Element]) -> Iterator[Element]:
    """Yield the descriptions of an element's kind in its default class and the classes around that, nearest first.

    Those of an element that is itself a description in a default begin there.
    """
    holder, kinds = element.getparent(), _kinds(str(element.tag))
    default = holder if holder is not None and holder.tag == "default" else classes.get(class_of(element))
    while default is not None:
        yield from default.iterchildren(*kinds, reversed=True)
        default = _around(default)


def _kinds(tag: str) -> Iterable[str]:
    """Return the tags that describe an element in a default: all actuators share one description, and all tendons.

    Source: MuJoCo XML reference, default; of several tags for one description the last holds.
    """
    sections = mjcf_schema().children
    if tag in sections["actuator"].children:
        return sections["actuator"].children
    return ("tendon",) if tag in sections["tendon"].children else (tag,)


def _around(default: Element) -> Element | None:
    """Return the <default> whose values hold where this one sets none: the one around it, or the outermost one before.

    Source: MuJoCo merges repeated top-level sections in their order, and a class starts as a copy of the one around it.
    """
    around = default.getparent()
    if around is not None and around.tag == "default":
        return around
    return next(default.itersiblings("default", preceding=True), None)
