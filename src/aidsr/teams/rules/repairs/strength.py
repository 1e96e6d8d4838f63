"""Repairs of how strong and how far: actuators, springs, ranges."""

from __future__ import annotations

import math
from collections.abc import Collection

from aidsr.core.artifacts import Fault
from aidsr.mjcf.schema import actuator_elements
from aidsr.teams.rules.edit import (
    Element,
    damping_gain,
    effective_numbers,
    numbers,
    of,
    section,
    set_numbers,
    without_prefix,
)

__all__ = [
    "restore_gear",
    "scale_forces",
    "scale_springs",
    "soften_springs",
    "sort_ranges",
    "stiffen_springs",
    "strengthen",
    "unlimit_tendons",
    "weaken",
    "widen_joint_ranges",
]

_SERVO_GAINS = {"position": "kp", "intvelocity": "kp", "velocity": "kv"}
"""What decides the force of a servo. MuJoCo takes 1 where it is not set. Source: MuJoCo XML reference."""

_STRONGER = 1.5
"""Factor on forces where nothing says how much is missing. Our choice."""

_SPRINGS = ("stiffness", "damping")
_WIDE_RAD = 0.6
_RADIANS_LOOK_LIKE = 2.0 * math.pi
"""A range in degrees that stays below this was meant in radians. Our choice: no hinge of a chain stops at 6 deg."""


def strengthen(root: Element, fault: Fault) -> str | None:
    """Let the actuators in question pull as much harder as was found missing; all of them where none is named."""
    return scale_forces(root, _missing(fault), {without_prefix(name) for name in fault.names})


def _missing(fault: Fault) -> float:
    """Return by what factor a measured value stays below its limit, with a fifth to spare, within 1.5 to 5."""
    if not fault.measured or not fault.limit:
        return _STRONGER
    return round(min(max(1.2 * fault.limit / fault.measured, _STRONGER), 5.0), 2)


def weaken(root: Element, fault: Fault) -> str | None:
    """Let every actuator pull a third less hard."""
    del fault
    return scale_forces(root, 0.67)


def scale_forces(root: Element, factor: float, names: Collection[str] = ()) -> str | None:
    """Scale the forces of the actuators with these names, or on tendons with them; of all where none is known."""
    every = [item for item in section(root, "actuator") if isinstance(item.tag, str)]
    chosen = [item for item in every if item.get("name") in names or item.get("tendon") in names] or every
    changed = [item for item in chosen if _scale_force(root, item, factor)]
    return f"multiplied the force of {len(changed)} actuators by {factor:g}" if changed else None


def _scale_force(root: Element, actuator: Element, factor: float) -> bool:
    """Scale what decides an actuator's force: a servo's gains, else its control range; and the force limits.

    Values of default classes are written scaled onto the actuator. A damping ratio follows the gain by itself.
    """
    scaled = {"forcerange": effective_numbers(root, actuator, "forcerange")}
    if gain := _SERVO_GAINS.get(actuator.tag):
        scaled["kv"] = damping_gain(root, actuator)
        scaled[gain] = effective_numbers(root, actuator, gain) or [1.0]
    else:
        scaled["ctrlrange"] = effective_numbers(root, actuator, "ctrlrange")
        scaled["gear"] = [] if scaled["ctrlrange"] else effective_numbers(root, actuator, "gear")
    for name, values in scaled.items():
        if values:
            set_numbers(actuator, name, *(factor * value for value in values))
    return any(scaled.values())


def stiffen_springs(root: Element, fault: Fault) -> str | None:
    """Make every joint spring 1.8 times as stiff, with damping in step."""
    del fault
    return scale_springs(root, 1.8)


def soften_springs(root: Element, fault: Fault) -> str | None:
    """Make every joint spring as much softer as was found too little moved, at most 0.6 times as stiff."""
    return scale_springs(root, min(1.0 / _missing(fault), 0.6))


def scale_springs(root: Element, factor: float) -> str | None:
    """Scale stiffness and damping of every joint, wherever they are written."""
    springs = [joint for joint in of(root, "joint") if (numbers(joint, "stiffness") or [0.0])[0] > 0]
    for joint in of(root, "joint"):
        for name in _SPRINGS:
            if numbers(joint, name):
                set_numbers(joint, name, *(factor * value for value in numbers(joint, name)))
    return f"multiplied joint stiffness and damping by {factor:g}" if springs else None


def unlimit_tendons(root: Element, fault: Fault) -> str | None:
    """Drop the length limits of the tendons in question: a rest length outside them pulls from the start."""
    named = {without_prefix(name) for name in fault.names}
    changed = []
    for tendon in of(root, "spatial", "fixed"):
        if tendon.get("range") and (not named or tendon.get("name") in named):
            tendon.attrib.pop("range")
            tendon.attrib.pop("limited", "")
            changed.append(tendon)
    return f"dropped the length limits of {len(changed)} tendons" if changed else None


def sort_ranges(root: Element, fault: Fault) -> str | None:
    """Write ranges that stand high to low the right way round."""
    del fault
    changed = 0
    for item in of(root, "joint", *actuator_elements()):
        for name in ("range", "ctrlrange", "forcerange"):
            low_high = numbers(item, name)
            if len(low_high) == 2 and low_high[0] > low_high[1]:
                set_numbers(item, name, low_high[1], low_high[0])
                changed += 1
    return f"put {changed} ranges in order" if changed else None


def widen_joint_ranges(root: Element, fault: Fault) -> str | None:
    """Read ranges that were meant in radians as such, or open the limits to 34 degrees."""
    del fault
    compiler = section(root, "compiler")
    in_degrees = compiler.get("angle", "degree") == "degree"
    changed = 0
    for joint in of(root, "joint"):
        limits = numbers(joint, "range")
        if len(limits) != 2 or joint.get("type") in ("slide", "free"):
            continue
        low, high = limits
        if in_degrees and max(abs(low), abs(high)) < _RADIANS_LOOK_LIKE:
            set_numbers(joint, "range", math.degrees(low), math.degrees(high))
        else:
            wide = math.degrees(_WIDE_RAD) if in_degrees else _WIDE_RAD
            set_numbers(joint, "range", min(low, 0.0 if joint.get("type") == "ball" else -wide), max(high, wide))
        changed += numbers(joint, "range") != limits
    return f"widened the ranges of {changed} joints" if changed else None


def restore_gear(root: Element, fault: Fault) -> str | None:
    """Give actuators whose gear or gain is zero one that acts, and pulls where only pulling forces are allowed."""
    del fault
    limits = [numbers(item, "forcerange") for item in of(root, *actuator_elements())]
    sign = -1.0 if any(limit and max(limit) <= 0 for limit in limits) else 1.0
    changed = 0
    for item in of(root, *actuator_elements()):
        for name in ("gear", "gainprm", "kp"):
            values = numbers(item, name)
            if values and not any(values):
                set_numbers(item, name, sign if name == "gainprm" else 1.0, *values[1:])
                changed += 1
    return f"gave a gear or gain that acts in {changed} places" if changed else None
