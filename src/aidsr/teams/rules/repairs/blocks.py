"""Repairs of what is missing: sensors, winches, control ranges, mass, contact."""

from __future__ import annotations

from lxml import etree

from aidsr.core.artifacts import Fault
from aidsr.teams.rules.edit import (
    Element,
    effective,
    effective_numbers,
    gain_sign,
    numbers,
    section,
    set_numbers,
    without_prefix,
)

__all__ = ["add_control_ranges", "add_mass", "add_sensors", "add_winches", "allow_contact", "cap_mass"]

_TENSION_N = 15.0
"""Greatest pull of a winch that has to be invented [N]. Our choice: a hobby servo of 0.15 N m on a 10 mm spool."""

_LEAST_MASS_KG = 0.002


def _tendons(root: Element) -> list[Element]:
    return [
        tendon
        for tendon in root.iter("spatial", "fixed")
        if not any(item.tag == "default" for item in tendon.iterancestors())
    ]


def _named(item: Element, kind: str, number: int) -> str:
    """Return an element's name, giving it one if it has none."""
    if not item.get("name"):
        item.set("name", f"{kind}_{number}")
    return str(item.get("name"))


def add_sensors(root: Element, fault: Fault) -> str | None:
    """Measure the length of every tendon."""
    del fault
    sensors = section(root, "sensor")
    measured = {item.get("tendon") for item in sensors.iter("tendonpos")}
    names = [_named(tendon, "tendon", number) for number, tendon in enumerate(_tendons(root), start=1)]
    missing = [name for name in names if name not in measured]
    for name in missing:
        etree.SubElement(sensors, "tendonpos", name=f"length_of_{name}", tendon=name)
    return f"added sensors for the length of {len(missing)} tendons" if missing else None


def add_winches(root: Element, fault: Fault) -> str | None:
    """Give every tendon that nothing drives a winch that only pulls."""
    del fault
    actuators = section(root, "actuator")
    driven = {item.get("tendon") for item in actuators}
    names = [_named(tendon, "tendon", number) for number, tendon in enumerate(_tendons(root), start=1)]
    missing = [name for name in names if name not in driven]
    for name in missing:
        winch = etree.SubElement(actuators, "general", name=f"pull_{name}", tendon=name, gainprm="-1", biastype="none")
        set_numbers(winch, "ctrlrange", 0.0, _TENSION_N)
        set_numbers(winch, "forcerange", -_TENSION_N, 0.0)
    return f"added winches of {_TENSION_N:g} N for {len(missing)} tendons" if missing else None


def add_control_ranges(root: Element, fault: Fault) -> str | None:
    """Give motors without a control range one: tendons are pulled, joints turned both ways; servos get the joint's."""
    named = {without_prefix(name) for name in fault.names}
    changed = []
    for item in section(root, "actuator"):
        low_high = numbers(item, "ctrlrange")
        if not isinstance(item.tag, str) or (named and item.get("name") not in named):
            continue
        if len(low_high) == 2 and low_high[0] > low_high[1]:
            set_numbers(item, "ctrlrange", low_high[1], low_high[0])
        elif wanted := _control_range(root, item):
            set_numbers(item, "ctrlrange", *wanted)
        else:
            continue
        item.attrib.pop("ctrllimited", "")
        changed.append(item)
    return f"gave {len(changed)} actuators a control range" if changed else None


def _control_range(root: Element, actuator: Element) -> tuple[float, float] | None:
    """Return the range that fits an actuator, or None where only its author can know it."""
    if actuator.tag == "position":
        joints = [joint for joint in root.iter("joint") if joint.get("name") == actuator.get("joint")]
        limits = effective_numbers(root, joints[0], "range") if joints else []
        return (limits[0], limits[1]) if len(limits) == 2 else None
    if actuator.tag == "muscle":
        return 0.0, 1.0
    if actuator.tag not in ("motor", "general"):
        return None
    if not actuator.get("tendon"):
        return -1.0, 1.0
    strongest = max((abs(value) for value in effective_numbers(root, actuator, "forcerange")), default=_TENSION_N)
    return (0.0, strongest) if gain_sign(root, actuator) < 0 else (-strongest, 0.0)


def add_mass(root: Element, fault: Fault) -> str | None:
    """Give moving bodies without mass a little."""
    names = {without_prefix(name) for name in fault.names}
    changed = []
    for body in root.iter("body"):
        if body.get("name") in names and body.find("inertial") is None:
            inertial = etree.Element("inertial", pos="0 0 0", diaginertia="1e-6 1e-6 1e-6")
            set_numbers(inertial, "mass", _LEAST_MASS_KG)
            body.insert(0, inertial)
            changed.append(body)
    return f"gave {len(changed)} bodies a mass of {1000 * _LEAST_MASS_KG:g} g" if changed else None


def cap_mass(root: Element, fault: Fault) -> str | None:
    """Make the heaviest body a quarter as heavy."""
    names = {without_prefix(name) for name in fault.names[:1]}
    changed = 0
    for body in root.iter("body"):
        for item in body if body.get("name") in names else ():
            attribute = next((name for name in ("mass", "density") if numbers(item, name)), None)
            if item.tag in ("geom", "inertial") and attribute:
                set_numbers(item, attribute, 0.25 * numbers(item, attribute)[0])
                changed += 1
    return f"made {', '.join(names)} a quarter as heavy" if changed else None


def allow_contact(root: Element, fault: Fault) -> str | None:
    """Let shapes that cannot touch anything collide again."""
    del fault
    mute = [
        geom
        for geom in root.iter("geom")
        if effective(root, geom, "contype") == "0"
        and effective(root, geom, "conaffinity") == "0"
        and effective(root, geom, "mass") != "0"
    ]
    for geom in mute:
        geom.set("contype", "1")
        geom.set("conaffinity", "1")
    return f"let {len(mute)} shapes collide" if mute else None
