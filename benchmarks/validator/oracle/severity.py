"""Size of the symptom relative to its limit, for each fault code."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from benchmarks.validator.oracle import building, constants, driven, levers, passive, signs, still
from benchmarks.validator.oracle.loop import Bench

SEVERITIES: dict[str, Callable[[Bench], float]] = {
    "no_tendons": partial(still.missing_parts, kind="tendon"),
    "no_actuators": partial(still.missing_parts, kind="u"),
    "no_sensors": partial(still.missing_parts, kind="sensor"),
    "tendons_not_actuated": still.driven_joints_only,
    "no_soft_chain": still.series,
    "disconnected": still.separate_parts,
    "segments_gap": still.widest_gap,
    "fully_actuated": still.rank_of_actuation,
    "ctrlrange_missing": still.missing_ranges,
    "range_inverted_ignored": still.inverted_ranges,
    "joint_range_too_small": still.narrow_ranges,
    "initial_penetration": still.overlap,
    "tendon_limit_violated": still.tendon_beyond_range,
    "zero_gear": still.dead_commands,
    "tendon_one_body": still.tendon_without_length,
    "tendon_no_moment": still.levers,
    "hinges_parallel": levers.parallel_hinges,
    "same_cables": levers.same_levers,
    "cables_end_early": levers.short_reach,
    "cable_cancels": levers.cancelled,
    "site_misplaced": levers.dip,
    "actuator_sign": signs.inverted,
    "length_unit": constants.length,
    "mass_unit": constants.heaviness,
    "odd_gravity": constants.gravity,
    "keyframe_out_of_range": constants.keyframe,
    "numerical_instability": driven.instability,
    "energy_growth": passive.energy_rise,
    "gravity_collapse": passive.collapse_by_gravity,
    "passive_collapse": passive.collapse_by_springs,
    "free_fall": passive.drop,
    "base_not_attached": passive.drop,
    "contact_disabled": passive.touches_nothing,
    "underdamped": passive.ringing,
    "no_grip": constants.grip,
    "chatter": driven.chatter,
    "limit_overrun": driven.overrun,
    "self_collision_lock": driven.held_by_contact,
    "antagonist_lock": driven.held_by_antagonists,
    "tendon_against_limit": driven.held_by_limits,
    "mass_ratio": driven.held_by_mass,
    "actuator_too_weak": driven.too_weak,
    "too_stiff": driven.too_stiff,
    "overdamped": constants.damped,
    "armature_large": constants.inert,
    "filter_slow": constants.filtered,
    "no_effect": driven.no_effect,
    "sensor_constant": driven.constant_sensors,
}
"""Measures of faults that make a robot unstable, by code: symptom / limit. 2 is twice the limit, 0.5 is half of it."""

BUILDING_SEVERITIES: dict[str, Callable[[Bench], float]] = {
    "tendon_through_body": building.buried,
    "tendon_skips_segments": building.skipping,
    "tendon_pushes": building.pushing,
    "actuator_overforce": building.force,
    "actuator_power": building.power,
    "actuator_speed": building.speed,
    "cable_stroke": building.stroke,
    "implausible_density": building.density,
    "tendon_slack": building.slack,
    "thin_wall": building.wall,
}
"""Measures of faults that cannot be built, by code. Good robots may have such faults; they are recorded."""

_FIXED_ROBOTS_MAY = {"contact_disabled"}
"""Codes that are measured only for free robots, which must touch something."""


def measure_of(code: str) -> Callable[[Bench], float]:
    """Return the function that measures the symptom of a fault relative to its limit."""
    return (SEVERITIES | BUILDING_SEVERITIES)[code]


def severity_of(code: str, mjcf: str) -> float:
    """Return the size of a fault's symptom in a robot relative to its limit."""
    return measure_of(code)(Bench(mjcf))


def first_symptom(bench: Bench, ceiling: float = 0.5) -> dict[str, float]:
    """Return the first symptom of instability larger than `ceiling` x its limit, by code; cheap tests come first."""
    for code, measure in SEVERITIES.items():
        if code in _FIXED_ROBOTS_MAY and not bench.free:
            continue
        severity = measure(bench)
        if severity > ceiling or math.isnan(severity):
            return {code: severity}
    return {}


def examine_good(mjcf: str, ceiling: float = 0.5) -> tuple[dict[str, float], dict[str, float]]:
    """Return the first symptom of instability larger than `ceiling` x its limit, and all symptoms of buildability.

    A good robot has no symptom of instability. For a bad one, buildability is not measured.
    """
    bench = Bench(mjcf)
    found = first_symptom(bench, ceiling)
    if not found and (idle := driven.idle_actuator(bench)) > 1.0:
        found["idle actuator"] = idle
    building = {} if found else {code: measure(bench) for code, measure in BUILDING_SEVERITIES.items()}
    return found, building
