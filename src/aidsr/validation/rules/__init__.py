"""The rules, one small function per fault or family of faults, in the order they are applied."""

from __future__ import annotations

from aidsr.validation.robot_under_test import Rule
from aidsr.validation.rules.blocks import no_actuators, no_sensors, no_tendons, tendons_not_actuated
from aidsr.validation.rules.cables import tendon_pushes, tendon_skips_segments, tendon_through_body
from aidsr.validation.rules.effect import antagonist_lock, no_effect, self_collision_lock
from aidsr.validation.rules.effort import (
    actuator_overforce,
    actuator_power,
    actuator_speed,
    implausible_density,
    no_motor_fits,
)
from aidsr.validation.rules.motion import chatter, limit_overrun, numerical_instability
from aidsr.validation.rules.passive import (
    drop,
    energy_growth,
    gravity_collapse,
    negative_damping,
    passive_collapse,
    underdamped,
)
from aidsr.validation.rules.ranges import ctrlrange_missing, joint_range_too_small, range_inverted_ignored
from aidsr.validation.rules.rest import contact_disabled, initial_penetration, tendon_limit_violated
from aidsr.validation.rules.sensing import sensor_constant
from aidsr.validation.rules.slack import tendon_slack
from aidsr.validation.rules.topology import disconnected, fully_actuated, no_soft_chain, segments_gap
from aidsr.validation.rules.walls import thin_wall
from aidsr.validation.rules.wiring import tendon_no_moment, tendon_one_body, zero_gear

__all__ = ["BUILDING_RULES", "DRAWING_RULES", "SIMULATE_RULES", "STRUCTURE_RULES"]

STRUCTURE_RULES: tuple[Rule, ...] = (
    no_tendons,
    no_actuators,
    no_sensors,
    tendons_not_actuated,
    ctrlrange_missing,
    range_inverted_ignored,
    joint_range_too_small,
    no_soft_chain,
    disconnected,
    segments_gap,
    fully_actuated,
)
"""Rules that read the compiled model alone."""

SIMULATE_RULES: tuple[Rule, ...] = (
    zero_gear,
    tendon_one_body,
    tendon_no_moment,
    initial_penetration,
    tendon_limit_violated,
    contact_disabled,
    numerical_instability,
    drop,
    passive_collapse,
    gravity_collapse,
    negative_damping,
    energy_growth,
    underdamped,
    chatter,
    limit_overrun,
    self_collision_lock,
    antagonist_lock,
    no_effect,
    sensor_constant,
)
"""Rules that look at what the robot did."""

DRAWING_RULES: tuple[Rule, ...] = (tendon_skips_segments, implausible_density, thin_wall)
"""Rules about whether it could be built that read the drawing alone."""

BUILDING_RULES: tuple[Rule, ...] = (
    tendon_through_body,
    tendon_pushes,
    tendon_slack,
    actuator_overforce,
    actuator_power,
    actuator_speed,
    no_motor_fits,
)
"""Rules about whether it could be built that look at what it did when driven; all are reported apart from stability."""
