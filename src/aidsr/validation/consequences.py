"""Groups of fault codes that several rules list as their consequences.

Source: our choice, tried on robots with two faults. Causes come in this order: missing parts, wiring and ranges,
topology, overlap, falling, collapse, growth of energy, chatter, locks, no effect, sensors. Divergence explains nothing,
because other rules use only tests that do not diverge. Chatter makes forces useless but not the search for obstacles,
because rules about effects use the mean position about which a robot shakes. Faults of force, power, speed and stroke
do not explain each other: a motor has a separate limit for each.
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
"""The actuators do not move the robot, for any reason."""
COLLAPSE = ("passive_collapse", "gravity_collapse")
FALL = ("free_fall", "base_not_attached")
SHAKING = ("energy_growth", "underdamped", "numerical_instability", "chatter", "limit_overrun")
"""The robot does not come to rest, or its joints exceed their ranges."""
