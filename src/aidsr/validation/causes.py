"""Which fault explains which: causes hide each other, and only the cause is worth repairing."""

from __future__ import annotations

from collections.abc import Sequence

from aidsr.artifacts import Fault

__all__ = ["EXPLAINS", "without_consequences"]

_WIRING = frozenset({"ctrlrange_missing", "zero_gear", "tendon_one_body", "tendon_no_moment", "tendons_not_actuated"})
_NO_EFFECT = frozenset(
    {
        "self_collision_lock",
        "antagonist_lock",
        "tendon_against_limit",
        "mass_ratio",
        "actuator_too_weak",
        "too_stiff",
        "no_effect",
    }
)
_SHAPE = frozenset({"gravity_collapse", "passive_collapse"})
_SHAKING = frozenset({"energy_growth", "underdamped", "chatter"})
_DROP = frozenset({"free_fall", "base_not_attached"})
_SENSORS = frozenset({"sensor_constant"})
_MEASURED = _NO_EFFECT | _SHAPE | _SHAKING | _DROP | _SENSORS | {"limit_overrun"}

EXPLAINS: dict[str, frozenset[str]] = {
    "no_tendons": _NO_EFFECT | _SENSORS | {"tendons_not_actuated", "no_soft_chain"},
    "no_actuators": _NO_EFFECT | _SENSORS | {"tendons_not_actuated"},
    "no_sensors": _SENSORS,
    "tendons_not_actuated": _NO_EFFECT | _SENSORS | {"fully_actuated"},
    "no_soft_chain": _NO_EFFECT | _SENSORS | {"tendon_one_body", "tendon_no_moment", "fully_actuated"},
    "disconnected": _NO_EFFECT | _DROP | {"segments_gap", "tendon_no_moment"},
    "ctrlrange_missing": _NO_EFFECT | _SENSORS,
    "range_inverted_ignored": frozenset(),
    "joint_range_too_small": _NO_EFFECT | _SENSORS | {"limit_overrun", "chatter", "gravity_collapse"},
    "zero_gear": _NO_EFFECT | _SENSORS,
    "tendon_one_body": _NO_EFFECT | _SENSORS,
    "tendon_no_moment": _NO_EFFECT | _SENSORS,
    "self_collision_lock": _NO_EFFECT | _SENSORS,
    "initial_penetration": _NO_EFFECT | _SHAPE | _SHAKING | {"numerical_instability"},
    "tendon_limit_violated": _NO_EFFECT | _SHAPE | _SHAKING | _SENSORS | {"numerical_instability"},
    "contact_disabled": _DROP,
    "free_fall": _SHAPE | _SHAKING | _NO_EFFECT | {"numerical_instability"},
    "base_not_attached": _SHAPE | _SHAKING,
    "passive_collapse": _NO_EFFECT | _SHAKING | {"gravity_collapse"},
    "gravity_collapse": _NO_EFFECT,
    "numerical_instability": _MEASURED,
    "energy_growth": frozenset({"underdamped", "chatter"}),
    "underdamped": frozenset({"chatter", "energy_growth"}),
    "chatter": frozenset({"limit_overrun"}),
    "antagonist_lock": frozenset({"tendon_against_limit", "actuator_too_weak", "too_stiff", "no_effect"}),
    "tendon_against_limit": _SENSORS,
    "mass_ratio": _SENSORS,
    "actuator_too_weak": _SENSORS,
    "too_stiff": _SENSORS,
    "no_effect": _SENSORS,
}
"""Codes that a fault explains, directly. Source: our choice; missing blocks before wiring and ranges, then topology,
lock and overlap, drop, collapse, divergence and chatter, no effect, sensors."""


def without_consequences(faults: Sequence[Fault]) -> tuple[Fault, ...]:
    """Return the faults that no other error explains, in the order given.

    Only an error explains another fault; a warning stands beside it.
    """
    codes = {fault.code for fault in faults if fault.severity == "error"}
    explained: set[str] = set()
    for code in EXPLAINS:
        # in the table's order a cause stands before its consequences, so that two faults never hide each other
        if code in codes and code not in explained:
            explained |= EXPLAINS[code]
    return tuple(fault for fault in faults if fault.code not in explained)
