"""Repairs of ranges: flags, order, units."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator

from aidsr.mjcf.defaults import Setting, default_classes, is_placed, setting
from aidsr.mjcf.location import Element, elements, numbers
from aidsr.mjcf.schema import actuator_elements, range_flags
from aidsr.validation.repairs.telling import told

__all__ = ["ball_ranges", "degrees_in_radians", "inverted_ranges", "missing_limit_flags"]

_FULL_TURN_RAD = 2.0 * math.pi
_MEANT_RAD = [half_turns * math.pi for half_turns in range(2, 7)]
"""Angles from a full turn up that are written in radians too. Our choice: a wrist may turn three times."""
_ROUNDED_RAD = 0.05
"""What rounding to one decimal takes or gives; no whole number of degrees is that near to one of these."""
_TURNING = ("hinge", "ball")


def missing_limit_flags(root: Element) -> Iterator[str]:
    """Say that a range holds where the compiler is told not to assume it and nothing says so."""
    if not any(compiler.get("autolimits") == "false" for compiler in elements(root, "compiler")):
        return
    classes = default_classes(root)
    for element, attribute, flag in _ranges(root):
        if setting(element, flag, classes) is None and any(numbers(element.get(attribute, ""))):
            element.set(flag, "true")
            yield told(element, f'wrote {flag}="true" beside {attribute}, since autolimits is off')


def inverted_ranges(root: Element) -> Iterator[str]:
    """Write the smaller number of a range first, where a ball joint's then still begins with 0."""
    classes = default_classes(root)
    for element, attribute, flag in _ranges(root):
        ends = numbers(element.get(attribute, ""))
        limited = setting(element, flag, classes)
        if len(ends) != 2 or ends[0] <= ends[1] or (limited is not None and limited.value == "false"):
            continue
        kind = setting(element, "type", classes) if element.tag == "joint" else None
        if kind is None or kind.value != "ball" or ends[1] == 0.0:
            low_last = element.get(attribute, "").split()
            element.set(attribute, f"{low_last[1]} {low_last[0]}")
            yield told(element, f"wrote {attribute} with the smaller number first")


def ball_ranges(root: Element) -> Iterator[str]:
    """Begin the range of a ball joint with 0: it limits the angle from the rest position, whatever the direction.

    Source: MuJoCo XML reference, body/joint/range.
    """
    classes = default_classes(root)
    for joint in elements(root, "joint"):
        kind, found = setting(joint, "type", classes), setting(joint, "range", classes)
        if not is_placed(joint) or kind is None or kind.value != "ball" or found is None:
            continue
        ends = numbers(found.value)
        if len(ends) == 2 and ends[0] < 0 < ends[1] and -ends[0] == ends[1]:
            joint.set("range", f"0 {found.value.split()[1]}")
            yield told(joint, f"wrote the range of the ball joint as 0 to {ends[1]:g}")


def degrees_in_radians(root: Element) -> Iterator[str]:
    """Turn degrees into radians where the compiler reads radians and a number is beyond a full turn.

    A rounded number of half turns is left alone, and so is a hinge that an actuator drives directly: it may be a spool
    with many turns.
    """
    if not any(compiler.get("angle") == "radian" for compiler in elements(root, "compiler")):
        return
    yield from _turn_ranges(root)
    for element in elements(root):
        euler, turn = numbers(element.get("euler", "")), numbers(element.get("axisangle", ""))
        if _are_degrees(euler):
            element.set("euler", _radians(euler))
            yield told(element, "read euler as degrees, since it is beyond a full turn in radians")
        if len(turn) == 4 and _are_degrees(turn[3:]):
            element.set("axisangle", " ".join([*element.get("axisangle", "").split()[:3], _radians(turn[3:])]))
            yield told(element, "read the angle of axisangle as degrees, since it is beyond a full turn in radians")


def _turn_ranges(root: Element) -> Iterator[str]:
    classes = default_classes(root)
    actuators = elements(root, *actuator_elements())
    driven = {actuator.get("joint") or actuator.get("jointinparent") for actuator in actuators}
    users: dict[Element, list[tuple[Element, Setting]]] = defaultdict(list)
    for joint in elements(root, "joint"):
        found = setting(joint, "range", classes) if is_placed(joint) else None
        if found is not None:
            users[found.holder].append((joint, found))

    def is_meant(joint: Element) -> bool:
        kind = setting(joint, "type", classes)
        return (kind.value if kind else "hinge") in _TURNING and joint.get("name", "") not in driven

    for holder, joints in users.items():
        ends = numbers(joints[0][1].value)
        if not _are_degrees(ends):
            continue
        meant = [joint for joint, _ in joints if is_meant(joint)]
        for element in [holder] if len(meant) == len(joints) else meant:
            element.set("range", _radians(ends))
            yield told(element, "read range as degrees, since it is beyond a full turn in radians")


def _ranges(root: Element) -> Iterator[tuple[Element, str, str]]:
    """Yield each element that bears a range, the range's name and its flag's."""
    for element in elements(root):
        for attribute in [str(name) for name in element.attrib]:
            flag = range_flags().get((str(element.tag), attribute))
            if flag:
                yield element, attribute, flag


def _are_degrees(angles: list[float]) -> bool:
    """Whether one of some angles is beyond a full turn in radians and is no rounded number of half turns."""
    return any(
        abs(angle) > _FULL_TURN_RAD
        and not any(math.isclose(abs(angle), turn, abs_tol=_ROUNDED_RAD) for turn in _MEANT_RAD)
        for angle in angles
    )


def _radians(degrees: list[float]) -> str:
    return " ".join(f"{math.radians(angle):.9g}" for angle in degrees)
