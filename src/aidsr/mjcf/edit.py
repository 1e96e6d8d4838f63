"""Functions that read and change an MJCF document."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from lxml import etree

from aidsr.mjcf.defaults import default_classes, setting
from aidsr.mjcf.elements import Element, elements
from aidsr.mjcf.elements import numbers as parse_numbers
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.mjcf.read import parse_document

Value = str | float | bool | Sequence[float]
"""Type of the value of an MJCF attribute."""

_JOINT_USERS = ("fixed", "equality")
"""Elements in which a <joint> is a reference to a joint."""

_GAINS = ("kp", "kv", "dampratio", "gainprm", "biasprm")
"""Attributes that an actuator inherits only from default entries of its own tag. Source: seen in MuJoCo 3.17."""

_SERVO_GAINS = {"position": "kp", "intvelocity": "kp", "velocity": "kv"}
"""Attribute that determines the force of a servo; MuJoCo uses 1 if it is not set. Source: MuJoCo XML reference."""


def parse(mjcf: str) -> Element:
    """Return the root element of an MJCF text.

    Raises:
        MjcfError: The text is not an MJCF document.
    """
    return parse_document(mjcf).root


def to_text(root: Element) -> str:
    """Return the document as indented text."""
    etree.indent(root, space="  ")
    return etree.tostring(root, encoding="unicode") + "\n"


def without_prefix(name: str) -> str:
    """Return a name without the prefix that scene assembly adds to a robot's names."""
    return name.removeprefix(ROBOT_PREFIX)


def section(root: Element, tag: str) -> Element:
    """Return the document's last section with this tag, which overrides earlier ones; add one if there is none."""
    found = root.findall(tag)
    return found[-1] if found else etree.SubElement(root, tag)


def entries(root: Element, tag: str) -> list[Element]:
    """Return the child elements of all sections with this tag, such as all actuators, without comments."""
    return [entry for found in root.iterchildren(tag) for entry in found.iterchildren("*")]


def joints(root: Element) -> list[Element]:
    """Return the joints of bodies and the joint entries in defaults, not the references in tendons and equalities."""
    parents = ((joint, joint.getparent()) for joint in elements(root, "joint"))
    return [joint for joint, parent in parents if parent is not None and parent.tag not in _JOINT_USERS]


def get_numbers(element: Element, attribute: str) -> list[float]:
    """Return the numbers of an attribute; empty if it is missing or is not numeric."""
    return parse_numbers(element.get(attribute, ""))


def effective_numbers(root: Element, element: Element, attribute: str) -> list[float]:
    """Return the effective numbers of an attribute, including default classes; empty if it is unset or not numeric."""
    return parse_numbers(effective_value(root, element, attribute) or "")


def set_numbers(element: Element, attribute: str, *values: float) -> None:
    """Write numbers into an attribute."""
    element.set(attribute, format_value(values))


def format_value(value: Value) -> str:
    """Return a value as MJCF text; numbers have at most six significant digits."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return f"{round(float(value), 9) + 0.0:.6g}"
    return " ".join(format_value(number) for number in value)


def effective_value(root: Element, element: Element, attribute: str) -> str | None:
    """Return the effective value of an attribute, including default classes, or None if nothing sets it.

    For an element inside a <default>, only its own value counts.

    Source: MuJoCo manual, Modeling, default settings. An actuator inherits its general attributes from the default
    entries of all kinds of actuators, but its gains only from those of its own kind.
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
    """Return the sign of the force that a positive control causes: -1 pulls on a tendon, 1 pushes, 0 is no force."""
    gain = gain_of(root, actuator)
    return (gain > 0) - (gain < 0)


def gain_of(root: Element, actuator: Element) -> float:
    """Return the force on a joint or tendon for a control of 1, without bias: gear x gain."""
    product = 1.0
    for name in ("gear", "gainprm"):
        product *= (effective_numbers(root, actuator, name) or [1.0])[0]
    return product


def is_servo(root: Element, actuator: Element) -> bool:
    """Return whether an actuator is a position servo, also one that is written as <general>."""
    if actuator.tag != "general":
        return actuator.tag == "position"
    bias = effective_numbers(root, actuator, "biasprm")
    return effective_value(root, actuator, "biastype") == "affine" and len(bias) > 1 and bias[1] != 0


def damping_gain(root: Element, servo: Element) -> list[float]:
    """Return a servo's kv; empty if nothing sets it or it has a damping ratio instead."""
    if servo.get("kv") is None and effective_value(root, servo, "dampratio"):
        return []
    return effective_numbers(root, servo, "kv")


def exclude_contact(root: Element, first: str, second: str) -> bool:
    """Exclude contact between two bodies; return whether an exclusion was added."""
    contact = section(root, "contact")
    pairs = [{pair.get("body1"), pair.get("body2")} for pair in contact.iter("exclude")]
    if {first, second} in pairs:
        return False
    etree.SubElement(contact, "exclude", body1=first, body2=second)
    return True


def scale_forces(root: Element, factor: float, names: Collection[str] = ()) -> int:
    """Scale the forces of actuators.

    Args:
        root: Root of the document; changed in place.
        factor: Factor on the forces.
        names: Names of actuators or of the tendons they act on. If no actuator matches, all actuators are scaled.

    Returns:
        Number of changed actuators.
    """
    every = entries(root, "actuator")
    chosen = [actuator for actuator in every if actuator.get("name") in names or actuator.get("tendon") in names]
    return sum(_scale_force(root, actuator, factor) for actuator in chosen or every)


def _scale_force(root: Element, actuator: Element, factor: float) -> bool:
    """Scale the force limits of an actuator, and its gains if its force has a bias, else its control range or gear.

    Scaled values of default classes are written on the actuator itself. Return whether anything was changed.
    """
    scaled = {"forcerange": effective_numbers(root, actuator, "forcerange")}
    biased = actuator.tag in _SERVO_GAINS or (
        actuator.tag == "general" and effective_value(root, actuator, "biastype") == "affine"
    )
    if biased:
        scale_gains(root, actuator, factor)
    else:
        scaled["ctrlrange"] = effective_numbers(root, actuator, "ctrlrange")
        scaled["gear"] = [] if scaled["ctrlrange"] else effective_numbers(root, actuator, "gear")
    _scale_numbers(actuator, factor, scaled)
    return biased or any(scaled.values())


def scale_gains(root: Element, servo: Element, factor: float) -> None:
    """Scale stiffness and damping of a servo, also one that is written as <general>; a command means the same length.

    A damping ratio is not scaled, because the compiler derives kv from it and the gain.
    """
    if gain := _SERVO_GAINS.get(str(servo.tag)):
        scaled = {"kv": damping_gain(root, servo), gain: effective_numbers(root, servo, gain) or [1.0]}
    else:
        scaled = {
            "gainprm": effective_numbers(root, servo, "gainprm") or [1.0],
            "biasprm": effective_numbers(root, servo, "biasprm"),
        }
    _scale_numbers(servo, factor, scaled)


def _scale_numbers(element: Element, factor: float, numbers: dict[str, list[float]]) -> None:
    for name, values in numbers.items():
        if values:
            set_numbers(element, name, *(factor * value for value in values))


def scale_springs(root: Element, factor: float) -> int:
    """Scale stiffness and damping of every joint, in joints and in default entries.

    Returns:
        Number of joints and entries whose stiffness was changed.
    """
    springs = 0
    for joint in joints(root):
        springs += any(number > 0 for number in get_numbers(joint, "stiffness")[:1])
        for name in ("stiffness", "damping"):
            if values := get_numbers(joint, name):
                set_numbers(joint, name, *(factor * value for value in values))
    return springs
