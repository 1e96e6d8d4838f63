"""Beam theory for chains of rigid segments: which numbers make a chain of joints behave like an elastic rod.

A continuum robot of length L and bending stiffness E I is modelled as N segments of length l = L / N, each bending at a
joint in its middle. The formulas here give that joint's stiffness and damping, say how far a time step can follow
them, and what a cable at an offset d from the backbone does to the chain. docs/physics.md says how well they hold.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

__all__ = [
    "CLAMPED_FREE_FIRST_MODE",
    "SOLIMP",
    "ServoGains",
    "cable_bending",
    "contact_depth",
    "first_bending_frequency",
    "joint_damping",
    "joint_stiffness",
    "largest_undamped_stiffness",
    "limit_stiffness",
    "relative_sag_load",
    "rod_diameter",
    "rod_stiffness",
    "rod_torsion_stiffness",
    "servo_gains",
    "smallest_damping_time",
    "solref",
    "stiffness_damping_time",
    "tendon_moment_arm",
    "tip_force_range",
    "twist_stiffness",
]

CLAMPED_FREE_FIRST_MODE = 3.516
"""(beta_1 L)^2 of a clamped-free beam. Source: Blevins, Formulas for Natural Frequency and Mode Shape, table 8-1."""

SOLIMP = (0.95, 0.99, 0.001)
"""Impedance of contacts and limits between light bodies. Source: docs/physics.md, soft limits and contacts."""

_CHAIN_TOP_MODE = 78.6
"""omega_max^2 m l^2 / k of a chain of slender links with joints in the middles of its segments, for N >= 5; 48 at most
with joints at their starts. Source: eigenvalues of M^-1 K, docs/physics.md, stability."""

_DEFAULT_IMPEDANCE = 0.95
"""MuJoCo's default dmax. Source: MuJoCo XML reference, geom solimp."""

_SHORTEST_SOLREF_STEPS = 2.0
"""MuJoCo clamps a contact's time constant below two time steps. Source: MuJoCo manual, Modeling, solver parameters."""


def rod_stiffness(young_modulus_pa: float, diameter_m: float) -> float:
    """Bending stiffness E I of a solid round rod [N m^2].

    Source: Euler-Bernoulli beam, I = pi d^4 / 64.
    """
    return young_modulus_pa * math.pi * diameter_m**4 / 64.0


def rod_diameter(bending_stiffness_n_m2: float, young_modulus_pa: float) -> float:
    """Diameter of the solid round rod that has this bending stiffness [m]; the inverse of `rod_stiffness`."""
    return float((64.0 * bending_stiffness_n_m2 / (math.pi * young_modulus_pa)) ** 0.25)


def rod_torsion_stiffness(shear_modulus_pa: float, diameter_m: float) -> float:
    """Torsional stiffness G J of a solid round rod [N m^2].

    Source: Saint-Venant torsion, J = pi d^4 / 32.
    """
    return shear_modulus_pa * math.pi * diameter_m**4 / 32.0


def joint_stiffness(bending_stiffness_n_m2: float, segment_length_m: float) -> float:
    """Stiffness k = E I / l of the hinge in the middle of a segment [N m/rad].

    With joints in the middles a chain of 10 segments is 0.25 % too stiff under a tip load; with joints at the segments'
    starts the same stiffness is 15 % too soft, unless the first joint gets 2 E I / l.

    Source: equal bending energy of a segment of constant curvature; errors measured, docs/physics.md.
    """
    return bending_stiffness_n_m2 / segment_length_m


def twist_stiffness(torsion_stiffness_n_m2: float, segment_length_m: float) -> float:
    """Stiffness G J / l of a twist joint of one segment [N m/rad].

    Source: equal torsional energy of a segment of constant twist.
    """
    return torsion_stiffness_n_m2 / segment_length_m


def first_bending_frequency(bending_stiffness_n_m2: float, mass_per_length_kg_m: float, length_m: float) -> float:
    """First natural frequency of a clamped rod [rad/s]: 3.516 sqrt(E I / (mu L^4)).

    Source: Euler-Bernoulli beam, `CLAMPED_FREE_FIRST_MODE`.
    """
    return CLAMPED_FREE_FIRST_MODE * math.sqrt(bending_stiffness_n_m2 / (mass_per_length_kg_m * length_m**4))


def stiffness_damping_time(damping_ratio: float, frequency_rad_s: float) -> float:
    """Time beta = c / k that gives a mode of this frequency this damping ratio [s].

    Source: Rayleigh damping proportional to stiffness, zeta = beta omega / 2.
    """
    return 2.0 * damping_ratio / frequency_rad_s


def joint_damping(stiffness_n_m_rad: float, damping_time_s: float) -> float:
    """Damping c = beta k of a joint [N m s/rad]."""
    return damping_time_s * stiffness_n_m_rad


def smallest_damping_time(timestep_s: float) -> float:
    """Smallest beta = c / k with which any stiffness is stable [s]: half a time step, damping integrated implicitly.

    Holds for the integrators Euler (with eulerdamp) and implicitfast. Recommended are 5 time steps or more.

    Source: linear stability of semi-implicit Euler, S^2 < 4 + 2 (beta / dt) S^2 with S = dt omega_max; the map in
    docs/physics.md agrees.
    """
    return timestep_s / 2.0


def largest_undamped_stiffness(segment_mass_kg: float, segment_length_m: float, timestep_s: float) -> float:
    """Largest joint stiffness an undamped uniform chain can have [N m/rad]: dt omega_max = 2.

    Holds for Euler and implicitfast without armature; thick links and armature only raise it.

    Source: omega_max^2 = 78.6 k / (m l^2) (docs/physics.md); semi-implicit Euler is stable for dt omega < 2.
    """
    return (2.0 / timestep_s) ** 2 * segment_mass_kg * segment_length_m**2 / _CHAIN_TOP_MODE


def cable_bending(tension_n: float, offset_m: float, length_m: float, bending_stiffness_n_m2: float) -> float:
    """Angle by which one cable bends a section [rad]: theta = F d L / (E I).

    Source: constant moment F d along the section; friction and the cable's change of offset neglected.
    """
    return tension_n * offset_m * length_m / bending_stiffness_n_m2


def tendon_moment_arm(offset_m: float, joint_angle_rad: float, guide_distance_m: float) -> float:
    """Moment arm of a straight cable span at a bent joint [m]: d cos(phi / 2) + a sin(phi / 2).

    MuJoCo runs a tendon straight between its sites. With guides a distance a before and behind the joint the arm grows
    on the inside of the bend, so a coarse chain bends too far; keep phi below 0.35 rad.

    Args:
        offset_m: Distance d of the guides from the backbone.
        joint_angle_rad: Angle phi by which the joint bends towards the cable.
        guide_distance_m: Distance a from the joint to each guide along the backbone.

    Source: plane geometry of a span between two guides; predicts MuJoCo to 0.01 % (docs/physics.md).
    """
    half = joint_angle_rad / 2.0
    return offset_m * math.cos(half) + guide_distance_m * math.sin(half)


def tip_force_range(tension_n: float, offset_m: float, length_m: float) -> tuple[float, float]:
    """Sideways force a bending section can exert with its tip [N], low and high estimate: 1.2 to 2 x T d / L.

    Source: measured on simulated arms of 0.36 to 0.6 m (docs/physics.md, calibration).
    """
    unit_n = tension_n * offset_m / length_m
    return 1.2 * unit_n, 2.0 * unit_n


def relative_sag_load(mass_kg: float, length_m: float, bending_stiffness_n_m2: float, gravity_m_s2: float) -> float:
    """Self-weight of a horizontal cantilever in units of its stiffness: Gamma = w L^3 / (E I).

    Below 1 the tip sags less than an eighth of the length, the linear deflection being Gamma L / 8.

    Source: Euler-Bernoulli cantilever under its own weight.
    """
    return mass_kg * gravity_m_s2 * length_m**2 / bending_stiffness_n_m2


def solref(timestep_s: float) -> tuple[float, float]:
    """Time constant [s] and damping ratio of the stiffest contact or limit MuJoCo allows: two time steps, critical.

    At 2 ms this is the "0.004 1" that light robots need: soft constraints scale with mass, so a 10 g finger pressing
    with 20 N sinks 40 mm into the default contact and 1.6 mm into this one.

    Source: MuJoCo manual, Modeling, solver parameters; docs/physics.md.
    """
    return _SHORTEST_SOLREF_STEPS * timestep_s, 1.0


def contact_depth(
    force_n: float, mass_kg: float, time_constant_s: float, impedance: float = _DEFAULT_IMPEDANCE
) -> float:
    """Depth to which a body is pressed into a contact [m]: F tc^2 (1 - d) / m.

    Source: MuJoCo manual, Computation, soft constraints at rest; measured, docs/physics.md.
    """
    return force_n * time_constant_s**2 * (1.0 - impedance) / mass_kg


def limit_stiffness(inertia_kg_m2: float, time_constant_s: float, impedance: float = _DEFAULT_IMPEDANCE) -> float:
    """Stiffness of a joint limit [N m/rad]: I / ((1 - d) tc^2), which is 20 I / tc^2 with the default impedance.

    Source: as `contact_depth`.
    """
    return inertia_kg_m2 / ((1.0 - impedance) * time_constant_s**2)


@dataclass(frozen=True)
class ServoGains:
    """Gains of a position servo on a tendon."""

    kp_n_m: float
    kv_n_s_m: float


def servo_gains(kp_n_m: float, timestep_s: float) -> ServoGains:
    """Gains of a stable tendon servo: kv = 0.02 kp, and never below half a time step of kp.

    Raises:
        ValueError: `kp_n_m` is outside 200 to 2000 N/m, where servos on arms of 0.1 to 0.6 m were measured.

    Source: with implicitfast kv >= kp dt / 2 is stable (docs/physics.md); 0.02 s is its recommendation.
    """
    if not 200.0 <= kp_n_m <= 2000.0:
        raise ValueError(f"a tendon servo needs kp between 200 and 2000 N/m, not {kp_n_m:g}")
    return ServoGains(kp_n_m, kp_n_m * max(0.02, smallest_damping_time(timestep_s)))
