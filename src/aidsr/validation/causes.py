"""Which fault explains which: causes hide each other, and only the cause is worth repairing."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from aidsr.core.artifacts import Fault

_NO_EFFECT = (
    "self_collision_lock",
    "antagonist_lock",
    "tendon_against_limit",
    "mass_ratio",
    "actuator_too_weak",
    "too_stiff",
    "no_effect",
    "sensor_constant",
)
_COLLAPSE = ("passive_collapse", "gravity_collapse")
_DROP = ("free_fall", "base_not_attached")
_SHAKING = ("energy_growth", "underdamped", "numerical_instability", "chatter", "limit_overrun")

EXPLAINS: dict[str, tuple[str, ...]] = {
    "no_tendons": ("tendons_not_actuated", *_NO_EFFECT),
    "no_actuators": ("tendons_not_actuated", *_NO_EFFECT),
    "no_sensors": ("sensor_constant",),
    "tendons_not_actuated": ("fully_actuated", *_NO_EFFECT),
    "ctrlrange_missing": _NO_EFFECT,
    "joint_range_too_small": (*_COLLAPSE, *_SHAKING, *_NO_EFFECT),
    "disconnected": ("no_soft_chain", "segments_gap", "tendon_no_moment", "tendon_skips_segments", *_DROP, *_NO_EFFECT),
    "no_soft_chain": ("fully_actuated", "tendon_one_body", "tendon_no_moment", *_NO_EFFECT),
    "zero_gear": _NO_EFFECT,
    "tendon_one_body": _NO_EFFECT,
    "tendon_no_moment": _NO_EFFECT,
    "initial_penetration": (*_COLLAPSE, *_SHAKING, *_NO_EFFECT),
    "tendon_limit_violated": (*_COLLAPSE, *_SHAKING, *_NO_EFFECT),
    "contact_disabled": _DROP,
    "free_fall": (*_COLLAPSE, *_SHAKING, *_NO_EFFECT),
    "base_not_attached": (*_COLLAPSE, *_SHAKING, *_NO_EFFECT),
    "passive_collapse": ("gravity_collapse", *_SHAKING, *_NO_EFFECT),
    "gravity_collapse": (*_SHAKING, *_NO_EFFECT),
    "mass_ratio": ("underdamped", "chatter", "limit_overrun", "sensor_constant", "implausible_density"),
    "energy_growth": _SHAKING[1:],
    "underdamped": ("chatter",),
    "chatter": ("antagonist_lock", "actuator_too_weak", "too_stiff", "no_effect", "sensor_constant"),
    "self_collision_lock": _NO_EFFECT[1:],
    "antagonist_lock": _NO_EFFECT[2:],
    "tendon_against_limit": ("sensor_constant",),
    "actuator_too_weak": ("sensor_constant",),
    "too_stiff": ("sensor_constant",),
    "no_effect": ("sensor_constant",),
    "tendon_pushes": ("tendon_slack",),
}
"""Codes that an error explains. Where two could explain each other, the first is the cause.
Source: our choice; missing blocks before wiring and ranges, then topology, overlap, drop, collapse, growth of energy,
chatter, locks, no effect, sensors. Divergence explains nothing: other rules look at tests that do not diverge. Chatter
spoils forces, not obstacles: rules about effects look at what a robot shakes about. Force, power, speed and stroke are
told side by side: a motor has a limit for each, and one cured leaves the others."""


def is_explained(code: str, faults: Sequence[Fault]) -> bool:
    """Return whether an error already found explains a fault, so that looking for its own cause is idle."""
    return any(code in EXPLAINS.get(fault.code, ()) for fault in faults if fault.severity == "error")


def without_consequences(faults: Sequence[Fault], refuted: Collection[tuple[str, str]] = ()) -> tuple[Fault, ...]:
    """Return the faults that no other error explains, in the order given.

    Only an error explains another fault; a warning stands beside it.

    Args:
        faults: What the rules found.
        refuted: Explanations that a counterfactual showed not to hold, as (cause, consequence).
    """
    present = {fault.code for fault in faults if fault.severity == "error"}
    causes: set[str] = set()
    explained: set[str] = set()
    for code, consequences in EXPLAINS.items():
        if code not in present:
            continue
        if code not in explained:
            causes.add(code)
        # what a consequence explains is explained too, but never a cause that stands before it
        explained |= {each for each in consequences if (code, each) not in refuted} - causes
    return tuple(fault for fault in faults if fault.code not in explained)
