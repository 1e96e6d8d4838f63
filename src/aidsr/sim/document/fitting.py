"""Attributes that do not fit what they stand on, also from a default class, and numbers that are none."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from aidsr.artifacts import Fault
from aidsr.sim.document.naming import REFERENCES
from aidsr.sim.document.place import Element, attributes, elements, load_fault, numbers

__all__ = ["not_finite", "wrong_for_type"]

_STRETCHED = frozenset({"capsule", "cylinder", "box", "ellipsoid"})
"""Shapes that `fromto` can span. Source: MuJoCo XML reference, body/geom/fromto."""
_TEXT = frozenset({"name", "prefix", "sep", "model", "data", "objname", "refname", *REFERENCES})


@dataclass(frozen=True)
class _Setting:
    value: str
    origin: str
    """Words for where the value comes from; empty for the element itself."""


def wrong_for_type(root: Element) -> Iterator[Fault]:
    """Yield a fault for each geom or site whose `fromto` does not fit its type or meets a `pos`."""
    classes = _classes(root)
    for element in elements(root, "geom", "site"):
        if not _is_placed(element):
            continue
        fromto, pos = (_setting(element, name, classes) for name in ("fromto", "pos"))
        shape = _setting(element, "type", classes) or _Setting("sphere", "")
        if fromto and shape.value not in _STRETCHED:
            yield load_fault(
                "wrong_for_type",
                element,
                f"has fromto{fromto.origin} and is a {shape.value}{shape.origin}, which has no two ends",
                cure='use pos, or type="capsule" with one radius in size',
            )
        elif fromto and pos:
            yield load_fault(
                "wrong_for_type",
                element,
                f"has both fromto{fromto.origin} and pos{pos.origin}",
                cure="keep one of them: fromto already says where it is",
            )


def not_finite(root: Element) -> Iterator[Fault]:
    """Yield a fault for each NaN, and for each infinity that is not the open end of a range."""
    for element in elements(root):
        for attribute, value in attributes(element):
            if attribute in _TEXT:
                continue
            found = numbers(value)
            if any(map(math.isnan, found)) or (not attribute.endswith("range") and any(map(math.isinf, found))):
                yield load_fault("bad_value", element, f'{attribute}="{value[:60]}" is not a finite number')


def _is_placed(element: Element) -> bool:
    """Whether a geom or site is one of a body, not a default, a tendon's waypoint or a composite's pattern."""
    holders = {str(ancestor.tag) for ancestor in element.iterancestors()}
    return "worldbody" in holders and not holders & {"composite", "flexcomp"}


def _classes(root: Element) -> Mapping[str, Element]:
    return {element.get("class", "main"): element for element in elements(root, "default")}


def _setting(element: Element, attribute: str, classes: Mapping[str, Element]) -> _Setting | None:
    """Return an attribute as MuJoCo sees it: the element's own, else that of its default class and those around it."""
    if attribute in element.attrib:
        return _Setting(element.get(attribute, ""), "")
    default = classes.get(_class_of(element))
    while default is not None and default.tag == "default":
        for described in default.findall(str(element.tag)):
            if attribute in described.attrib:
                return _Setting(described.get(attribute, ""), f" (from default class '{default.get('class', 'main')}')")
        default = default.getparent()
    return None


def _class_of(element: Element) -> str:
    if element.get("class"):
        return element.get("class", "")
    for ancestor in element.iterancestors("body", "frame", "replicate", "worldbody"):
        if ancestor.get("childclass"):
            return ancestor.get("childclass", "")
    return "main"
