"""Read and change an MJCF document of any author."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from lxml import etree

from aidsr.mjcf.defaults import default_classes, setting
from aidsr.mjcf.elements import Element, elements
from aidsr.mjcf.elements import numbers as parse_numbers
from aidsr.mjcf.read import parse_document

Value = str | float | bool | Sequence[float]
"""What an MJCF attribute can hold."""

_ROBOT_PREFIX = "robot/"
"""What scene assembly puts before a robot's names; a report about a scene names parts with it."""

_JOINT_USERS = ("fixed", "equality")
"""Elements in which <joint> refers to a joint."""

_GAINS = ("kp", "kv", "dampratio", "gainprm", "biasprm")
"""What only descriptions of an actuator's own tag set. Source: seen in MuJoCo 3.17."""

_SERVO_GAINS = {"position": "kp", "intvelocity": "kp", "velocity": "kv"}
"""What decides the force of a servo. MuJoCo takes 1 where it is not set. Source: MuJoCo XML reference."""


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
    """Return the document's last section of this tag, which holds against those before; added if there is none."""
    found = root.findall(tag)
    return found[-1] if found else etree.SubElement(root, tag)


def entries(root: Element, tag: str) -> list[Element]:
    """Return what stands in the document's sections of this tag, such as all actuators; comments are left out."""
    return [entry for found in root.iterchildren(tag) for entry in found.iterchildren("*")]


def joints(root: Element) -> list[Element]:
    """Return the joints of bodies and their descriptions in defaults, not what tendons and equalities call a joint."""
    parents = ((joint, joint.getparent()) for joint in elements(root, "joint"))
    return [joint for joint, parent in parents if parent is not None and parent.tag not in _JOINT_USERS]


def get_numbers(element: Element, attribute: str) -> list[float]:
    """Return the numbers of an attribute, empty where it is missing or holds something else."""
    return parse_numbers(element.get(attribute, ""))


def effective_numbers(root: Element, element: Element, attribute: str) -> list[float]:
    """Return the numbers an attribute has after default classes, empty where nothing sets it or they are none."""
    return parse_numbers(effective_value(root, element, attribute) or "")


def set_numbers(element: Element, attribute: str, *values: float) -> None:
    """Write numbers into an attribute."""
    element.set(attribute, format_value(values))


def format_value(value: Value) -> str:
    """Return a value as MJCF writes it: numbers with six digits, never in 17."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return f"{round(float(value), 9) + 0.0:.6g}"
    return " ".join(format_value(number) for number in value)


def effective_value(root: Element, element: Element, attribute: str) -> str | None:
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
    gain = gain_of(root, actuator)
    return (gain > 0) - (gain < 0)


def gain_of(root: Element, actuator: Element) -> float:
    """Return the force on a joint or tendon that a control of 1 makes, bias aside: gear x gain."""
    product = 1.0
    for name in ("gear", "gainprm"):
        product *= (effective_numbers(root, actuator, name) or [1.0])[0]
    return product


def is_servo(root: Element, actuator: Element) -> bool:
    """Whether an actuator is a position servo, spelled out as a general one too."""
    if actuator.tag != "general":
        return actuator.tag == "position"
    bias = effective_numbers(root, actuator, "biasprm")
    return effective_value(root, actuator, "biastype") == "affine" and len(bias) > 1 and bias[1] != 0


def damping_gain(root: Element, servo: Element) -> list[float]:
    """Return a servo's kv, empty where nothing sets it or a damping ratio stands in its place."""
    if servo.get("kv") is None and effective_value(root, servo, "dampratio"):
        return []
    return effective_numbers(root, servo, "kv")


def exclude_contact(root: Element, first: str, second: str) -> bool:
    """Let two bodies pass through each other; say whether they could collide before."""
    contact = section(root, "contact")
    pairs = [{pair.get("body1"), pair.get("body2")} for pair in contact.iter("exclude")]
    if {first, second} in pairs:
        return False
    etree.SubElement(contact, "exclude", body1=first, body2=second)
    return True


def scale_forces(root: Element, factor: float, names: Collection[str] = ()) -> int:
    """Scale the forces of the actuators with these names, or on tendons with them; of all where none has one.

    Returns:
        How many actuators were changed.
    """
    every = entries(root, "actuator")
    chosen = [actuator for actuator in every if actuator.get("name") in names or actuator.get("tendon") in names]
    return sum(_scale_force(root, actuator, factor) for actuator in chosen or every)


def _scale_force(root: Element, actuator: Element, factor: float) -> bool:
    """Scale what decides an actuator's force: a servo's gains, else its control range; and the force limits.

    Values of default classes are written scaled onto the actuator. A damping ratio stays:
    the compiler derives kv from it and the gain.
    """
    scaled = {"forcerange": effective_numbers(root, actuator, "forcerange")}
    if gain := _SERVO_GAINS.get(str(actuator.tag)):
        scaled["kv"] = damping_gain(root, actuator)
        scaled[gain] = effective_numbers(root, actuator, gain) or [1.0]
    else:
        scaled["ctrlrange"] = effective_numbers(root, actuator, "ctrlrange")
        scaled["gear"] = [] if scaled["ctrlrange"] else effective_numbers(root, actuator, "gear")
    for name, values in scaled.items():
        if values:
            set_numbers(actuator, name, *(factor * value for value in values))
    return any(scaled.values())


def scale_springs(root: Element, factor: float) -> int:
    """Scale stiffness and damping of every joint, wherever they are written.

    Returns:
        In how many places a stiffness was changed.
    """
    springs = 0
    for joint in joints(root):
        springs += any(number > 0 for number in get_numbers(joint, "stiffness")[:1])
        for name in ("stiffness", "damping"):
            if values := get_numbers(joint, name):
                set_numbers(joint, name, *(factor * value for value in values))
    return springs
