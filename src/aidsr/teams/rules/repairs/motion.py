"""Repairs of how a robot moves: integrator, damping, time step, limits and contacts."""

from __future__ import annotations

from itertools import islice

from lxml import etree

from aidsr.core.artifacts import Fault
from aidsr.sim import beam
from aidsr.teams.rules.edit import (
    Element,
    effective,
    effective_numbers,
    exclude,
    numbers,
    of,
    section,
    set_numbers,
    without_prefix,
)
from aidsr.teams.rules.mjcf_builder import TIMESTEP_S

__all__ = [
    "damp_hinges",
    "exclude_overlapping",
    "halve_timestep",
    "integrate_implicitly",
    "make_damping_positive",
    "pass_through_itself",
    "raise_damping",
    "stiffen_contacts",
    "stiffen_limits",
    "straighten",
]

_DAMPING_STEPS = 5.0
"""Damping time c / k in time steps. Source: docs/physics.md, recommendation of 5 steps or more."""

_MOST_DAMPING_S = 0.2
_SMALLEST_TIMESTEP_S = 0.0005
_LEAST_ARMATURE_KG_M2 = 1e-5
_LEAST_DAMPING_N_M_S = 1e-4


def timestep(root: Element) -> float:
    """Return the document's time step [s]; MuJoCo's own where none is given."""
    option = root.find("option")
    given = numbers(option, "timestep") if option is not None else []
    return given[0] if given else TIMESTEP_S


def integrate_implicitly(root: Element, fault: Fault) -> str | None:
    """Use implicitfast, which integrates damping implicitly and is stable with any stiffness once damped."""
    del fault
    option = section(root, "option")
    if option.get("integrator") in ("implicitfast", "discrete"):
        return None
    option.set("integrator", "implicitfast")
    return 'set integrator="implicitfast"'


def damp_hinges(root: Element, fault: Fault) -> str | None:
    """Raise every joint's damping to at least five time steps of its stiffness, and give limp joints a little."""
    del fault
    changed, least = 0, _DAMPING_STEPS * timestep(root)
    for joint in of(root, "joint"):
        stiffness, damping = (_value(root, joint, name) for name in ("stiffness", "damping"))
        wanted = max(least * stiffness, _LEAST_DAMPING_N_M_S)
        if joint.get("type") != "free" and damping < wanted and _counts(joint, "stiffness", "damping"):
            set_numbers(joint, "damping", wanted)
            changed += 1
    return f"raised the damping of {changed} joints to {1000 * least:g} ms of their stiffness" if changed else None


def _value(root: Element, joint: Element, attribute: str) -> float:
    return (effective_numbers(root, joint, attribute) or [0.0])[0]


def _counts(joint: Element, *attributes: str) -> bool:
    """Whether an element decides the attributes: a joint of the robot, or a default class that sets one of them."""
    in_class = any(ancestor.tag == "default" for ancestor in joint.iterancestors())
    return not in_class or any(joint.get(attribute) for attribute in attributes)


def raise_damping(root: Element, fault: Fault) -> str | None:
    """Double every joint's damping, up to 0.2 s of its stiffness."""
    if damped := damp_hinges(root, fault):
        return damped
    changed = 0
    for joint in of(root, "joint"):
        stiffness, damping = _value(root, joint, "stiffness"), numbers(joint, "damping")
        if damping and damping[0] > 0 and (stiffness == 0 or damping[0] < _MOST_DAMPING_S * stiffness):
            set_numbers(joint, "damping", 2.0 * damping[0])
            changed += 1
    return f"doubled the joints' damping in {changed} places" if changed else None


def make_damping_positive(root: Element, fault: Fault) -> str | None:
    """Turn negative damping around."""
    del fault
    wrong = [
        item for item in root.iter("joint", "spatial", "fixed", "tendon") if (numbers(item, "damping") or [0.0])[0] < 0
    ]
    for item in wrong:
        set_numbers(item, "damping", *(abs(value) for value in numbers(item, "damping")))
    return f"made {len(wrong)} negative dampings positive" if wrong else None


def halve_timestep(root: Element, fault: Fault) -> str | None:
    """Halve the time step, down to 0.5 ms."""
    del fault
    half = timestep(root) / 2.0
    if half < _SMALLEST_TIMESTEP_S * 0.999:
        return None
    set_numbers(section(root, "option"), "timestep", half)
    return f"halved the time step to {1000 * half:g} ms"


def stiffen_limits(root: Element, fault: Fault) -> str | None:
    """Make joint limits as stiff as the time step allows: by default they are softer than a light robot's springs."""
    del fault
    return _set_in_defaults(root, "joint", {"solreflimit": beam.solref(timestep(root)), "solimplimit": beam.SOLIMP})


def stiffen_contacts(root: Element, fault: Fault) -> str | None:
    """Make contacts as stiff as the time step allows, and give light joints a little armature against chatter."""
    del fault
    contacts = _set_in_defaults(root, "geom", {"solref": beam.solref(timestep(root)), "solimp": beam.SOLIMP})
    joints = [
        joint
        for joint in of(root, "joint")
        if _counts(joint, "armature") and _value(root, joint, "armature") < _LEAST_ARMATURE_KG_M2
    ]
    hinges = [joint for joint in joints if joint.get("type") != "free"]
    for joint in hinges:
        set_numbers(joint, "armature", _LEAST_ARMATURE_KG_M2)
    armature = f"gave {len(hinges)} joints an armature of {_LEAST_ARMATURE_KG_M2:g} kg m2" if hinges else None
    return "; ".join(part for part in (contacts, armature) if part) or None


def _set_in_defaults(root: Element, tag: str, values: dict[str, tuple[float, ...]]) -> str | None:
    """Set attributes for all elements of a tag: in the outermost default class, and nowhere else."""
    default = root.find("default")
    if default is None:
        default = etree.Element("default")
        root.insert(0, default)
    described = default.find(tag)
    described = etree.SubElement(default, tag) if described is None else described
    elsewhere = [item for item in of(root, tag) if item is not described and any(item.get(name) for name in values)]
    if not elsewhere and all(numbers(described, name) == list(value) for name, value in values.items()):
        return None
    for item in elsewhere:
        for name in values:
            item.attrib.pop(name, "")
    for name, value in values.items():
        set_numbers(described, name, *value)
    return f"set {' and '.join(values)} of every {tag} to follow {1000 * values[next(iter(values))][0]:g} ms"


def pass_through_itself(root: Element, fault: Fault) -> str | None:
    """Let the robot's shapes collide with the environment only: contype 1, conaffinity 0."""
    del fault
    colliding = [geom for geom in of(root, "geom") if effective(root, geom, "contype") != "0"]
    changed = [geom for geom in colliding if geom.get("conaffinity") != "0"]
    for geom in changed:
        geom.set("contype", "1")
        geom.set("conaffinity", "0")
    return f"let {len(changed)} shapes pass through each other" if changed else None


def exclude_overlapping(root: Element, fault: Fault) -> str | None:
    """Exclude contact between the robot's bodies that overlap at rest."""
    owners = [_owner(root, without_prefix(name)) for name in fault.names]
    pairs = zip(owners[::2], owners[1::2], strict=False)
    bodies = [(first, second) for first, second in pairs if first and second and first != second]
    if len(fault.names) > 2:
        present = list(dict.fromkeys(owner for owner in owners if owner))
        bodies = [
            (first, second)
            for index, first in enumerate(present)
            for second in present[index + 1 :]
            if _near(root, first, second)
        ]
    done = [f"{first} and {second}" for first, second in bodies if exclude(root, first, second)]
    return f"excluded contact between {', '.join(done)}" if done else None


def _owner(root: Element, name: str) -> str | None:
    """Return the body of this name, or the body that carries the geom of this name."""
    for item in root.iter("body", "geom"):
        if item.get("name") == name:
            body = item if item.tag == "body" else next(item.iterancestors("body"), None)
            return body.get("name") if body is not None else None
    return None


def _near(root: Element, first: str, second: str) -> bool:
    """Whether two bodies are at most two joints apart in the same limb."""
    bodies = {body.get("name"): body for body in root.iter("body")}
    upper, lower = bodies.get(first), bodies.get(second)
    if upper is None or lower is None:
        return False
    above = [*islice(lower.iterancestors("body"), 3), *islice(upper.iterancestors("body"), 3)]
    return upper in above or lower in above


def straighten(root: Element, fault: Fault) -> str | None:
    """Let every spring rest where the joint is drawn."""
    del fault
    bent = [joint for joint in of(root, "joint") if joint.get("springref") or joint.get("ref")]
    for joint in bent:
        joint.attrib.pop("springref", "")
        joint.attrib.pop("ref", "")
    return f"put the springs of {len(bent)} joints to rest as drawn" if bent else None
