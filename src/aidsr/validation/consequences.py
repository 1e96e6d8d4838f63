"""Codes that faults often explain together.

Source: our choice, tried on robots with two faults. Missing parts explain before wiring and ranges, these before
topology, overlap, falling, collapse, growth of energy, chatter, locks, no effect, sensors. Divergence explains nothing:
other rules look at tests that do not diverge. Chatter spoils forces, not obstacles: rules about effects look at the
place a robot shakes about. Force, power, speed and stroke explain nothing of each other: a motor has a limit for each.
"""

NO_MOTION = (
    "self_collision_lock",
    "antagonist_lock",
    "tendon_against_limit",
    "mass_ratio",
    "actuator_too_weak",
    "too_stiff",
    "no_effect",
    "sensor_constant",
)
"""The actuators do not move the robot, for whatever reason."""
COLLAPSE = ("passive_collapse", "gravity_collapse")
FALL = ("free_fall", "base_not_attached")
SHAKING = ("energy_growth", "underdamped", "numerical_instability", "chatter", "limit_overrun")
"""It does not come to rest, or goes too far."""
