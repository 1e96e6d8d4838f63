"""Fixes of missing or superfluous parts: sensors, actuators, mass, joints of the root."""

from __future__ import annotations

import math
from collections.abc import Iterator

from lxml import etree

from aidsr.core.errors import MjcfError
from aidsr.core.formatting import counted
from aidsr.fixes.ranges import TENSION_N
from aidsr.fixes.record import EditDocument, Fix, Request
from aidsr.fixes.strength import BENT_RAD, read_pull
from aidsr.mjcf.edit import effective_numbers, entries, section, set_numbers
from aidsr.mjcf.elements import Element, elements

_LEAST_MASS_KG = 0.002
_LEAST_N, _MOST_N = 0.05, 100.0
"""Smallest and largest pull of an added actuator [N]. Our choice: from a micro servo to what a cable of 1 mm holds."""
_NEARLY = 0.5
"""Mass / mass of the heaviest body from which a body counts as nearly as heavy. Our choice: covers the ends of several
limbs."""


def add_sensors(root: Element, _: Request) -> Iterator[str]:
    """Measure the length of every tendon."""
    measured = {sensor.get("tendon") for sensor in entries(root, "sensor") if sensor.tag == "tendonpos"}
    missing = [name for name in _tendon_names(root) if name not in measured]
    for name in missing:
        etree.SubElement(section(root, "sensor"), "tendonpos", name=f"length_of_{name}", tendon=name)
    if missing:
        yield f"added sensors for the length of {counted(len(missing), 'tendon')}"


def add_actuators(root: Element, _: Request) -> Iterator[str]:
    """Give every tendon that nothing drives an actuator that only pulls, as hard as bending the limb takes."""
    driven = {actuator.get("tendon") for actuator in entries(root, "actuator")}
    missing = [name for name in _tendon_names(root) if name not in driven]
    winches = [
        etree.SubElement(
            section(root, "actuator"), "general", name=f"pull_{name}", tendon=name, gainprm="-1", biastype="none"
        )
        for name in missing
    ]
    _set_pull(winches, TENSION_N)
    pull = read_pull(root, [winch.get("name", "") for winch in winches]) if winches else None
    tension_n = TENSION_N
    if pull and pull.bend_rad:
        tension_n = float(f"{min(max(TENSION_N * BENT_RAD / pull.bend_rad, _LEAST_N), _MOST_N):.2g}")
        _set_pull(winches, tension_n)
    if winches:
        yield f"added winches of {tension_n:g} N for {counted(len(winches), 'tendon')}"


def _set_pull(winches: list[Element], most_n: float) -> None:
    for winch in winches:
        set_numbers(winch, "ctrlrange", 0.0, most_n)
        set_numbers(winch, "forcerange", -most_n, 0.0)


def pull_instead(root: Element, request: Request) -> Iterator[str]:
    """Give every tendon an actuator that only pulls, in place of the actuators on joints."""
    yield from add_actuators(root, request)
    motors = [actuator for actuator in entries(root, "actuator") if actuator.get("joint")]
    names = {motor.get("name") for motor in motors if motor.get("name")}
    for entry in motors + [sensor for sensor in entries(root, "sensor") if sensor.get("actuator") in names]:
        _remove(entry)
    if motors:
        yield f"removed {counted(len(motors), 'actuator')} on joints, which the tendons now bend"


def _tendon_names(root: Element) -> list[str]:
    """Return the names of all tendons; a tendon without a name is given one."""
    tendons = [tendon for tendon in entries(root, "tendon") if tendon.tag in ("spatial", "fixed")]
    for number, tendon in enumerate(tendons, start=1):
        if not tendon.get("name"):
            tendon.set("name", f"tendon_{number}")
    return [tendon.get("name", "") for tendon in tendons]


def add_mass(root: Element, request: Request) -> Iterator[str]:
    """Give moving bodies without mass a little."""
    changed = 0
    for body in elements(root, "body"):
        if body.get("name") in request.names and body.find("inertial") is None:
            inertial = etree.Element("inertial", pos="0 0 0", diaginertia="1e-6 1e-6 1e-6")
            set_numbers(inertial, "mass", _LEAST_MASS_KG)
            body.insert(0, inertial)
            changed += 1
    if changed:
        yield f"gave {counted(changed, 'body')} a mass of {1000 * _LEAST_MASS_KG:g} g"


def cap_mass(root: Element, request: Request) -> Iterator[str]:
    """Make the heaviest body, and all that are nearly as heavy, as heavy as the median one."""
    from aidsr.mjcf.compile import compile_mjcf

    fault = request.fault
    if fault is None or not fault.measured or not request.names:
        return
    try:
        model = compile_mjcf(etree.tostring(root, encoding="unicode"))
        mass_kg = {model.body(index).name: float(model.body_mass[index]) for index in range(model.nbody)}
    except MjcfError:
        return
    heavy_kg, changed = _NEARLY * mass_kg.get(request.names[0], math.inf), 0
    heaviest = {name for name, each_kg in mass_kg.items() if name and each_kg >= heavy_kg}
    for body in elements(root, "body"):
        for part in body.iterchildren("geom", "inertial") if body.get("name") in heaviest else ():
            given = [name for name in ("mass", "density") if effective_numbers(root, part, name)][:1]
            for name in (*given, "diaginertia", "fullinertia"):
                if values := effective_numbers(root, part, name):
                    set_numbers(part, name, *(value / fault.measured for value in values))
                    changed += 1
    if changed:
        named = ", ".join(sorted(heaviest))
        yield f"made {named} {fault.measured:.3g} times lighter, as heavy as the median body"


def hold_root(root: Element, _: Request) -> Iterator[str]:
    """Fix the root to the mount: take its free and slide joints away, with what measures or drives them."""
    loose = [item for body in root.iterfind("worldbody/body") for item in body if _is_loose(item)]
    names = {joint.get("name") for joint in loose if joint.get("name")}
    users = [entry for tag in ("actuator", "sensor", "equality") for entry in entries(root, tag)]
    for joint in loose:
        _remove(joint)
    for user in users:
        if {user.get("joint"), user.get("joint1"), user.get("joint2")} & names:
            _remove(user)
    if loose:
        yield f"fixed the root: removed {counted(len(loose), 'joint')} that let it go"


def _is_loose(element: Element) -> bool:
    return element.tag == "freejoint" or (element.tag == "joint" and element.get("type") in ("free", "slide"))


def _remove(element: Element) -> None:
    parent = element.getparent()
    if parent is not None:
        parent.remove(element)


FIXES: tuple[Fix[EditDocument], ...] = (
    Fix(add_sensors, cures=("no_sensors", "sensor_constant")),
    Fix(add_actuators, cures=("no_actuators",)),
    Fix(pull_instead, cures=("tendons_not_actuated",)),
    Fix(add_mass, cures=("zero_mass",)),
    Fix(cap_mass, cures=("mass_ratio",)),
    Fix(hold_root, cures=("free_fall", "base_not_attached")),
)
