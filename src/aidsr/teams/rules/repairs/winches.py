"""Repairs of what pulls on tendons: servos that hammer or never let go, motors that push, roots that slide away."""

from __future__ import annotations

from aidsr.core.artifacts import Fault
from aidsr.teams.rules.edit import (
    Element,
    damping_gain,
    effective_numbers,
    gain_sign,
    section,
    set_numbers,
    without_prefix,
)

__all__ = ["damp_servos", "hold_root", "let_go", "pull_only", "soften_servos"]

_LET_GO = 1.3
"""How much further a servo's range is opened. Our choice: more than the stroke of a limb bent by 3 rad."""

_KV_SHARE = 0.02
"""Damping gain of a servo, kv / kp [s]. Source: docs/physics.md, recommendation for tendon servos."""


_MOST_DAMPED = 10.0
"""Damping beyond this many times the recommended one hammers with an explicit integrator. Our choice."""


def _on_tendons(root: Element, *tags: str) -> list[Element]:
    return [item for item in section(root, "actuator") if item.tag in tags and item.get("tendon")]


def _servos(root: Element) -> list[Element]:
    return [item for item in section(root, "actuator") if item.tag == "position"]


def damp_servos(root: Element, fault: Fault) -> str | None:
    """Damp position servos by 0.02 s of their stiffness, also those whose damping is many times that."""
    del fault
    acting = [servo for servo in _servos(root) if _stiffness(root, servo)]
    wrong = [servo for servo in acting if not 1.0 <= _damping_share(root, servo) <= _MOST_DAMPED]
    for servo in wrong:
        servo.attrib.pop("dampratio", "")
        set_numbers(servo, "kv", _KV_SHARE * _stiffness(root, servo))
    return f"set the damping of {len(wrong)} servos" if wrong else None


def _damping_share(root: Element, servo: Element) -> float:
    """Return kv of a servo in units of what is recommended; rounding counts as right."""
    kv = damping_gain(root, servo) or [0.0]
    return round(kv[0] / (_KV_SHARE * _stiffness(root, servo)), 3)


def soften_servos(root: Element, fault: Fault) -> str | None:
    """Halve the stiffness and the damping of position servos."""
    del fault
    for servo in _servos(root):
        set_numbers(servo, "kp", _stiffness(root, servo) / 2.0)
        if kv := damping_gain(root, servo):
            set_numbers(servo, "kv", kv[0] / 2.0)
    return f"halved the gains of {len(_servos(root))} servos" if _servos(root) else None


def _stiffness(root: Element, servo: Element) -> float:
    """Return kp of a position servo; MuJoCo takes 1 where it is not set."""
    return (effective_numbers(root, servo, "kp") or [1.0])[0]


def let_go(root: Element, fault: Fault) -> str | None:
    """Open the ranges of tendon servos upwards, so that one can let go while its antagonist pulls."""
    del fault
    ranges = [(item, effective_numbers(root, item, "ctrlrange")) for item in _on_tendons(root, "position")]
    lengths = [(item, low_high) for item, low_high in ranges if len(low_high) == 2 and low_high[0] >= 0]
    for item, (low, high) in lengths:
        set_numbers(item, "ctrlrange", low, _LET_GO * high)
    return f"opened the ranges of {len(lengths)} servos, so that they can let go" if lengths else None


def pull_only(root: Element, fault: Fault) -> str | None:
    """Cut the pushing half off the ranges of motors on tendons: a positive force lengthens a tendon."""
    named = {without_prefix(name) for name in fault.names}
    changed = 0
    for item in _on_tendons(root, "motor", "general"):
        known = not named or item.get("name") in named or item.get("tendon") in named
        sign = gain_sign(root, item)
        low_high = effective_numbers(root, item, "ctrlrange")
        if not known or len(low_high) != 2 or not sign:
            continue
        low, high = low_high
        strongest = max(abs(low), abs(high))
        wanted = (0.0, strongest) if sign < 0 else (-strongest, 0.0)
        if wanted != (low, high):
            set_numbers(item, "ctrlrange", *wanted)
            changed += 1
    return f"let {changed} motors only pull" if changed else None


def hold_root(root: Element, fault: Fault) -> str | None:
    """Fix the root to the mount: take its free and slide joints away, with what measures or drives them."""
    del fault
    worldbody = root.find("worldbody")
    roots = [] if worldbody is None else worldbody.findall("body")
    loose = [item for body in roots for item in body if _is_loose(item)]
    names = {item.get("name") for item in loose if item.get("name")}
    for item in loose:
        parent = item.getparent()
        if parent is not None:
            parent.remove(item)
    for tag in ("actuator", "sensor", "equality"):
        for item in list(section(root, tag)):
            if {item.get("joint"), item.get("joint1"), item.get("joint2")} & names:
                section(root, tag).remove(item)
    return f"fixed the root: removed {len(loose)} joints that let it go" if loose else None


def _is_loose(item: Element) -> bool:
    return item.tag == "freejoint" or (item.tag == "joint" and item.get("type") in ("free", "slide"))
