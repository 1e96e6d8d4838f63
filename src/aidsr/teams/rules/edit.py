"""Reading and changing an MJCF text that somebody else may have written."""

from __future__ import annotations

from collections.abc import Iterator

from lxml import etree

from aidsr.mjcf.defaults import default_classes, setting
from aidsr.mjcf.read import parse_document
from aidsr.teams.rules.mjcf_builder import written

__all__ = [
    "Element",
    "damping_gain",
    "effective",
    "effective_numbers",
    "exclude",
    "gain_sign",
    "numbers",
    "of",
    "parse",
    "section",
    "set_numbers",
    "to_text",
    "without_prefix",
]

Element = etree._Element

_ROBOT_PREFIX = "robot/"
"""What scene assembly puts before a robot's names; a report about a scene names parts with it."""

_GAINS = ("kp", "kv", "dampratio", "gainprm", "biasprm")
"""What only descriptions of an actuator's own tag set. Source: seen in MuJoCo 3.17."""


def parse(mjcf: str) -> Element:
    """Return the root of a document.

    Raises:
        MjcfError: It is no MJCF document.
    """
    return parse_document(mjcf).root


def to_text(root: Element) -> str:
    """Return the document, indented."""
    etree.indent(root, space="  ")
    return etree.tostring(root, encoding="unicode") + "\n"


def without_prefix(name: str) -> str:
    """Return a robot's own name for a part that a scene's report names."""
    return name.removeprefix(_ROBOT_PREFIX)


def section(root: Element, tag: str) -> Element:
    """Return the document's section of this tag, added if it is missing."""
    found = root.find(tag)
    return etree.SubElement(root, tag) if found is None else found


def of(root: Element, *tags: str) -> Iterator[Element]:
    """Yield the elements of these tags, also those that describe a default class."""
    yield from root.iter(*tags)


def numbers(element: Element, attribute: str) -> list[float]:
    """Return the numbers of an attribute, empty where it is missing or holds something else."""
    return _parsed(element.get(attribute))


def effective_numbers(root: Element, element: Element, attribute: str) -> list[float]:
    """Return the numbers an attribute has after default classes, empty where nothing sets it or they are none."""
    return _parsed(effective(root, element, attribute))


def _parsed(value: str | None) -> list[float]:
    try:
        return [float(word) for word in (value or "").split()]
    except ValueError:
        return []


def set_numbers(element: Element, attribute: str, *values: float) -> None:
    """Write numbers into an attribute."""
    element.set(attribute, written(values))


def effective(root: Element, element: Element, attribute: str) -> str | None:
    """Return the value an attribute has after default classes, or None where nothing sets it.

    Source: MuJoCo manual, Modeling, default settings. What actuators of all kinds have comes from descriptions of any
    kind, their gains only from those of their own.
    """
    if _inside_default(element):
        return element.get(attribute)
    found = setting(element, attribute, default_classes(root))
    if found is None or (attribute in _GAINS and found.holder.tag != element.tag):
        return None
    return found.value


def _inside_default(element: Element) -> bool:
    return any(ancestor.tag == "default" for ancestor in element.iterancestors())


def gain_sign(root: Element, actuator: Element) -> int:
    """Return the sign of the force a positive control makes: -1 pulls on a tendon, 1 pushes, 0 does nothing."""
    product = 1.0
    for name in ("gear", "gainprm"):
        words = (effective(root, actuator, name) or "1").split()
        product *= float(words[0]) if words else 1.0
    return (product > 0) - (product < 0)


def damping_gain(root: Element, servo: Element) -> list[float]:
    """Return a servo's kv, empty where nothing sets it or a damping ratio stands in its place."""
    if servo.get("kv") is None and effective(root, servo, "dampratio"):
        return []
    return effective_numbers(root, servo, "kv")


def exclude(root: Element, first: str, second: str) -> bool:
    """Let two bodies pass through each other; say whether they could collide before."""
    contact = section(root, "contact")
    pairs = [{pair.get("body1"), pair.get("body2")} for pair in contact.iter("exclude")]
    if {first, second} in pairs:
        return False
    etree.SubElement(contact, "exclude", body1=first, body2=second)
    return True
