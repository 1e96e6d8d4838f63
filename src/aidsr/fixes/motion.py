"""Fixes of a robot's dynamics: integrator, damping, time step, servo gains, stiffness of limits and contacts."""

from __future__ import annotations

from collections.abc import Iterator

from lxml import etree

from aidsr.core.formatting import counted
from aidsr.fixes.record import EditDocument, Fix, Request
from aidsr.mjcf.edit import (
    damping_gain,
    effective_numbers,
    effective_value,
    entries,
    get_numbers,
    is_servo,
    joints,
    scale_gains,
    section,
    set_numbers,
)
from aidsr.mjcf.elements import Element, elements
from aidsr.sim import beam
from aidsr.sim.beam import MOST_DAMPING_TIME_S

_DAMPING_STEPS = 5.0
"""Smallest damping time c / k of a joint, in time steps. Source: docs/physics.md, recommendation of 5 steps or more."""

_MUJOCO_TIMESTEP_S = 0.002
"""Time step of a document that does not set one. Source: MuJoCo XML reference, option."""

_SETTLING_S = 0.05
"""Smallest damping time c / k of a joint whose damping was negative. Our choice: that of the example arm."""
_SMALLEST_TIMESTEP_S = 0.0005
_LEAST_ARMATURE_KG_M2 = 1e-5
_LEAST_DAMPING_N_M_S = 1e-4

_KV_SHARE = 0.02
"""Damping gain of a servo, kv / kp [s]. Source: docs/physics.md, recommendation for tendon servos."""
_MOST_DAMPED = 10.0
"""Largest damping of a servo / recommended damping; more causes chatter with an explicit integrator. Our choice."""


def _timestep(root: Element) -> float:
    """Return the document's time step [s]; MuJoCo's default if it sets none."""
    given = [number for option in elements(root, "option") for number in get_numbers(option, "timestep")]
    return given[-1] if given else _MUJOCO_TIMESTEP_S


def integrate_implicitly(root: Element, _: Request) -> Iterator[str]:
    """Use implicitfast, which integrates damping implicitly and is stable with any stiffness once damped."""
    option = section(root, "option")
    if option.get("integrator") in ("implicitfast", "discrete"):
        return
    option.set("integrator", "implicitfast")
    yield 'set integrator="implicitfast"'


def damp_hinges(root: Element, _: Request) -> Iterator[str]:
    """Raise every joint's damping to at least five time steps of its stiffness, and give limp joints a little."""
    changed, least = 0, _DAMPING_STEPS * _timestep(root)
    for joint in joints(root):
        stiffness, damping = (_value(root, joint, name) for name in ("stiffness", "damping"))
        wanted = max(least * stiffness, _LEAST_DAMPING_N_M_S)
        if not _is_free(root, joint) and damping < wanted and _counts(joint, "stiffness", "damping"):
            set_numbers(joint, "damping", wanted)
            changed += 1
    if changed:
        yield f"raised the damping of {counted(changed, 'joint')} to {1000 * least:g} ms of their stiffness"


def _value(root: Element, joint: Element, attribute: str) -> float:
    return (effective_numbers(root, joint, attribute) or [0.0])[0]


def _is_free(root: Element, joint: Element) -> bool:
    return effective_value(root, joint, "type") == "free"


def _counts(joint: Element, *attributes: str) -> bool:
    """Return whether a joint element determines the attributes.

    This holds for a joint of the robot, and for an entry of a default class that sets one of the attributes.
    """
    in_class = any(ancestor.tag == "default" for ancestor in joint.iterancestors())
    return not in_class or any(joint.get(attribute) for attribute in attributes)


def damp_servos(root: Element, _: Request) -> Iterator[str]:
    """Damp position servos by 0.02 s of their stiffness, also those whose damping is many times that."""
    acting = [servo for servo in _servos(root) if _servo_stiffness(root, servo)]
    wrong = [servo for servo in acting if not 1.0 <= _damping_share(root, servo) <= _MOST_DAMPED]
    for servo in wrong:
        _set_damping(root, servo, _KV_SHARE * _servo_stiffness(root, servo))
    if wrong:
        yield f"set the damping of {counted(len(wrong), 'servo')}"


def soften_servos(root: Element, _: Request) -> Iterator[str]:
    """Halve the stiffness and the damping of position servos."""
    servos = _servos(root)
    for servo in servos:
        scale_gains(root, servo, 0.5)
    if servos:
        yield f"halved the gains of {counted(len(servos), 'servo')}"


def _servos(root: Element) -> list[Element]:
    return [actuator for actuator in entries(root, "actuator") if is_servo(root, actuator)]


def _servo_stiffness(root: Element, servo: Element) -> float:
    """Return kp of a position servo; MuJoCo uses 1 if it is not set."""
    return (effective_numbers(root, servo, "kp" if servo.tag == "position" else "gainprm") or [1.0])[0]


def _servo_damping(root: Element, servo: Element) -> float:
    """Return kv of a position servo; 0 if it has none, or a damping ratio instead."""
    if servo.tag == "position":
        return (damping_gain(root, servo) or [0.0])[0]
    return -([*effective_numbers(root, servo, "biasprm"), 0.0, 0.0, 0.0])[2]


def _set_damping(root: Element, servo: Element, damping: float) -> None:
    if servo.tag == "position":
        servo.attrib.pop("dampratio", "")
        set_numbers(servo, "kv", damping)
    else:
        bias = [*effective_numbers(root, servo, "biasprm"), 0.0, 0.0, 0.0]
        set_numbers(servo, "biasprm", *bias[:2], -damping)


def _damping_share(root: Element, servo: Element) -> float:
    """Return kv of a servo / recommended kv, rounded so that small rounding errors do not count."""
    return round(_servo_damping(root, servo) / (_KV_SHARE * _servo_stiffness(root, servo)), 3)


def raise_damping(root: Element, request: Request) -> Iterator[str]:
    """Double every joint's damping, up to 0.2 s of its stiffness."""
    if damped := list(damp_hinges(root, request)):
        yield from damped
        return
    changed = 0
    for joint in joints(root):
        stiffness, damping = _value(root, joint, "stiffness"), get_numbers(joint, "damping")
        if damping and damping[0] > 0 and (stiffness == 0 or damping[0] < MOST_DAMPING_TIME_S * stiffness):
            set_numbers(joint, "damping", 2.0 * damping[0])
            changed += 1
    if changed:
        yield f"doubled the joints' damping in {counted(changed, 'place')}"


def make_damping_positive(root: Element, _: Request) -> Iterator[str]:
    """Turn negative damping around, and give joints at least 50 ms of their stiffness, so that they come to rest."""
    wrong = [
        item
        for item in elements(root, "joint", "spatial", "fixed", "tendon")
        if (get_numbers(item, "damping") or [0.0])[0] < 0
    ]
    for item in wrong:
        stiffness = _value(root, item, "stiffness") if item.tag == "joint" else 0.0
        first, *rest = (abs(value) for value in get_numbers(item, "damping"))
        set_numbers(item, "damping", max(first, _SETTLING_S * stiffness), *rest)
    if wrong:
        yield f"made {counted(len(wrong), 'negative damping')} positive"


def halve_timestep(root: Element, _: Request) -> Iterator[str]:
    """Halve the time step, down to 0.5 ms."""
    half = _timestep(root) / 2.0
    if half >= _SMALLEST_TIMESTEP_S * 0.999:
        set_numbers(section(root, "option"), "timestep", half)
        yield f"halved the time step to {1000 * half:g} ms"


def stiffen_limits(root: Element, _: Request) -> Iterator[str]:
    """Make joint limits as stiff as the time step allows: by default they are softer than a light robot's springs."""
    stiffest = {"solreflimit": beam.solref(_timestep(root)), "solimplimit": beam.SOLIMP}
    yield from _set_in_defaults(root, "joint", stiffest)


def stiffen_contacts(root: Element, _: Request) -> Iterator[str]:
    """Make contacts as stiff as the time step allows, and give light joints a little armature against chatter."""
    yield from _set_in_defaults(root, "geom", {"solref": beam.solref(_timestep(root)), "solimp": beam.SOLIMP})
    light = [
        joint
        for joint in joints(root)
        if _counts(joint, "armature")
        and _value(root, joint, "armature") < _LEAST_ARMATURE_KG_M2
        and not _is_free(root, joint)
    ]
    for joint in light:
        set_numbers(joint, "armature", _LEAST_ARMATURE_KG_M2)
    if light:
        yield f"gave {counted(len(light), 'joint')} an armature of {_LEAST_ARMATURE_KG_M2:g} kg m2"


def _set_in_defaults(root: Element, tag: str, values: dict[str, tuple[float, ...]]) -> Iterator[str]:
    """Set attributes for all elements with a tag in the outermost default class, and remove them everywhere else."""
    default = root.find("default")
    if default is None:
        default = etree.Element("default")
        root.insert(0, default)
    described = default.find(tag)
    described = etree.SubElement(default, tag) if described is None else described
    elsewhere = [item for item in elements(root, tag) if item is not described and any(map(item.get, values))]
    if not elsewhere and all(get_numbers(described, name) == list(value) for name, value in values.items()):
        return
    for item in elsewhere:
        for name in values:
            item.attrib.pop(name, "")
    for name, value in values.items():
        set_numbers(described, name, *value)
    yield f"set {' and '.join(values)} of every {tag} to follow {1000 * values[next(iter(values))][0]:g} ms"


def straighten(root: Element, _: Request) -> Iterator[str]:
    """Let every spring of a joint or a tendon rest as drawn."""
    bent = [joint for joint in joints(root) if joint.get("springref") or joint.get("ref")]
    drawn = [tendon for tendon in elements(root, "spatial", "fixed", "tendon") if tendon.get("springlength")]
    for spring in bent + drawn:
        for name in ("springref", "ref", "springlength"):
            spring.attrib.pop(name, "")
    if bent or drawn:
        yield f"put the springs of {counted(len(bent), 'joint')} and {counted(len(drawn), 'tendon')} to rest as drawn"


def halve_timestep_last(root: Element, request: Request) -> Iterator[str]:
    """Halve the time step where nothing else is left to do: chatter usually has another cause, and steps cost time."""
    yield from halve_timestep(root, request)


FIXES: tuple[Fix[EditDocument], ...] = (
    Fix(make_damping_positive, cures=("energy_growth",)),
    Fix(damp_servos, cures=("numerical_instability", "energy_growth", "chatter")),
    Fix(integrate_implicitly, cures=("numerical_instability", "energy_growth", "chatter")),
    Fix(damp_hinges, cures=("numerical_instability", "energy_growth", "chatter")),
    Fix(stiffen_contacts, cures=("chatter",)),
    Fix(stiffen_limits, cures=("numerical_instability", "energy_growth", "chatter", "limit_overrun")),
    Fix(halve_timestep, cures=("numerical_instability", "energy_growth")),
    Fix(soften_servos, cures=("numerical_instability", "energy_growth", "chatter")),
    Fix(raise_damping, cures=("numerical_instability", "energy_growth", "chatter", "underdamped")),
    Fix(halve_timestep_last, cures=("chatter",)),
    Fix(straighten, cures=("passive_collapse", "loaded_spring")),
)
