"""Every limit of the validator in one place, with the reason for its value.

Lengths are shares of L, the characteristic length, and times shares of sqrt(L / g), so that no limit depends on how
large a robot is. Motor and material limits are absolute on purpose: real motors and matter do not scale.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Thresholds:
    """Limits of the rules. All are our choice, placed between robots known to be good and robots known to be bad."""

    # structure
    series_joints: int = 3
    """A continuum limb bends in at least this many places in series; with two it is a linkage."""
    gap_share: float = 0.5
    """Gap between neighbouring segments / segment length. Drawn joints leave gaps of up to a fifth."""
    root_level_share: float = 0.02
    """Difference in height / L up to which bodies held by the world stand side by side, as fingers do; below the
    segment length of a limb of 40 segments."""
    chain_bend_deg: float = 30.0
    """Bend that all joint limits of a chain allow together; less is a range in radians read as degrees."""

    # at rest
    overlap_share: float = 0.2
    """Overlap / thickness of the thinner geom."""
    overlap_noticed: float = 0.002
    """Overlap / L below which the share of thickness does not matter: rounding in written coordinates."""
    overlap_length: float = 0.01
    """Overlap / L that is too much however thick the parts are."""
    overlap_lever: float = 0.1
    """Lever of an overlap about every joint / thickness, below which the overlap can turn nothing: a round end drawn
    into its base."""
    tendon_limit: float = 0.02
    """Rest length outside the tendon's range / length."""

    # passive
    collapse_error: float = 0.9
    collapse_warning: float = 0.35
    """Sag / L. Soft arms under their own weight sag by up to a third and can still be driven."""
    weightless_share: float = 0.5
    """Share of the sag that may remain without gravity for gravity to be the cause."""
    passive_collapse: float = 0.6
    """Deformation / L without gravity: springs are not at rest in the drawn pose."""
    drop: float = 0.3
    """Fall of a root / L."""
    landed: float = 0.3
    """Speed of the root / sqrt(g L) below which a fall has ended."""
    energy_growth: float = 0.05
    """Rise of mechanical energy while passive / (m g L)."""
    damping_ratio: float = 0.02
    """Of the slowest visible oscillation. Soft bodies with any loss reach 0.05."""
    ringing: float = 0.02
    """Amplitude / L of an oscillation that is still visible after settling."""
    swing_share: float = 0.35
    """Third largest way between reversals / the largest, from where it is a swing. Below a half, since the slowest
    pendulum is seen for less than three ways, of which the first and the last are cut off."""

    # driven
    joint_speed_rad_s: float = 200.0
    body_speed_m_s: float = 50.0
    """Speeds that no cable and motor of this size reach: the integration has failed or is about to."""
    chatter_error_g: float = 4.0
    chatter_warning_g: float = 1.0
    """Root mean square acceleration while commands are constant, in standard gravity."""
    overrun_error_deg: float = 30.0
    overrun_warning_deg: float = 10.0
    """Joint beyond its range under load. Limits are soft in MuJoCo: light links overrun them by their mass."""
    effect: float = 0.05
    """Largest displacement / L that an actuator causes; less cannot be told from doing nothing by a task."""
    single_effect: float = 0.02
    """The same for one actuator among others that do move the robot: a leg that presses on the ground moves little."""
    lock_share: float = 0.35
    """Effect / effect with the obstacle taken away; less means that the obstacle holds the robot."""
    limit_gain: float = 3.0
    """Effect without joint and tendon limits / effect with them."""
    moment_share: float = 0.05
    """Moment arm / distance between tendon and joint; less means that the tendon runs along the axis."""
    weak_share: float = 0.5
    """Largest tension / weight of what moves; less cannot lift the robot."""
    softer: float = 0.02
    """Factor on stiffness and damping in the counterfactual of a stiff robot."""
    elastic_share: float = 0.4
    """Gain in it / what springs alone would give, above which springs are what holds the robot."""
    mass_ratio: float = 100.0
    """Heaviest body / median segment; beyond it contacts and joints of the light parts lose precision."""
    sensor_change: float = 1e-9
    """Change of a sensor below which it is constant, relative to its largest value or 1."""

    # realizability
    through_body: float = 0.25
    """Depth of a tendon inside a body between its guides / half width of that body."""
    push_share: float = 0.1
    """Force that lengthens a tendon / its greatest pull."""
    tension_n: float = 500.0
    tension_to_weight: float = 50.0
    tension_noticed_n: float = 30.0
    """Cable tension of the largest servo winches; and in weights of the robot, from where that is a real force."""
    power_w: float = 300.0
    sweep_power_w: float = 1500.0
    power_w_kg: float = 200.0
    power_noticed_w: float = 50.0
    """Mechanical power of one actuator; geared servos give 50 to 200 W/kg."""
    slack_share: float = 0.3
    slack_length: float = 0.01
    """Share of a servo's commands with which its cable hangs loose in every pose, and how loose / its longest path."""
    cable_speed_m_s: float = 0.5
    """Winches with the forces used here reel in 0.1 to 0.25 m/s."""
    wall_m: float = 0.0008
    """Two lines of a 0.4 mm nozzle, the thinnest wall that common filament printers close on both sides."""
    density_low_kg_m3: float = 5.0
    density_high_kg_m3: float = 23_000.0
    """Lightest foam; densest solid (osmium, 22,590 kg/m3)."""
