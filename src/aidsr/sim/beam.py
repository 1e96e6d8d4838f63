"""Beam theory for chains of rigid segments: joint parameters with which a chain behaves like an elastic rod.

A continuum robot of length L and bending stiffness E I is modelled as N segments of length l = L / N, each with a joint
in its middle. The formulas here give the stiffness and damping of that joint, the stiffest contact that a time step
allows, and the bending that a cable at an offset d from the backbone causes. docs/physics.md reports their accuracy.
"""

from __future__ import annotations

import math

CLAMPED_FREE_FIRST_MODE = 3.516
"""(beta_1 L)^2 of a clamped-free beam. Source: Blevins, Formulas for Natural Frequency and Mode Shape, table 8-1."""
MOST_DAMPING_TIME_S = 0.2
"""Damping time beta = c / k of a joint from which its damping is not raised further [s]. Our choice."""

SOLIMP = (0.95, 0.99, 0.001)
"""MuJoCo's `solimp` for the contacts and joint limits of light bodies.

Source: docs/physics.md, soft limits and contacts.
"""

_SHORTEST_SOLREF_STEPS = 2.0
"""Smallest time constant of a contact, in time steps; MuJoCo raises smaller ones to this.

Source: MuJoCo manual, Modeling, solver parameters.
"""


def rod_stiffness(young_modulus_pa: float, diameter_m: float) -> float:
    """Return the bending stiffness E I of a solid round rod [N m^2].

    Source: Euler-Bernoulli beam, I = pi d^4 / 64.
    """
    return young_modulus_pa * math.pi * diameter_m**4 / 64.0


def rod_diameter(bending_stiffness_n_m2: float, young_modulus_pa: float) -> float:
    """Return the diameter of the solid round rod with this bending stiffness [m]; the inverse of `rod_stiffness`."""
    return float((64.0 * bending_stiffness_n_m2 / (math.pi * young_modulus_pa)) ** 0.25)


def joint_stiffness(bending_stiffness_n_m2: float, segment_length_m: float) -> float:
    """Return the stiffness k = E I / l of the hinge in the middle of a segment [N m/rad].

    With the joints in the middles of the segments, a chain of 10 segments is 0.25 % too stiff under a tip load. With
    the joints at the starts of the segments, it is 15 % too soft, unless the first joint has the stiffness 2 E I / l.

    Source: equal bending energy of a segment of constant curvature; errors measured, docs/physics.md.
    """
    return bending_stiffness_n_m2 / segment_length_m


def first_bending_frequency(bending_stiffness_n_m2: float, mass_per_length_kg_m: float, length_m: float) -> float:
    """Return the first natural frequency of a clamped rod [rad/s]: 3.516 sqrt(E I / (mu L^4)).

    Source: Euler-Bernoulli beam, `CLAMPED_FREE_FIRST_MODE`.
    """
    return CLAMPED_FREE_FIRST_MODE * math.sqrt(bending_stiffness_n_m2 / (mass_per_length_kg_m * length_m**4))


def stiffness_damping_time(damping_ratio: float, frequency_rad_s: float) -> float:
    """Return the damping time beta = c / k [s] with which a mode of this frequency has this damping ratio.

    Source: Rayleigh damping proportional to stiffness, zeta = beta omega / 2.
    """
    return 2.0 * damping_ratio / frequency_rad_s


def joint_damping(stiffness_n_m_rad: float, damping_time_s: float) -> float:
    """Return the damping c = beta k of a joint [N m s/rad]."""
    return damping_time_s * stiffness_n_m_rad


def cable_bending(tension_n: float, offset_m: float, length_m: float, bending_stiffness_n_m2: float) -> float:
    """Return the angle by which one cable bends a section [rad]: theta = F d L / (E I).

    Source: constant moment F d along the section; friction and changes of the cable's offset are neglected.
    """
    return tension_n * offset_m * length_m / bending_stiffness_n_m2


def tip_force_range(tension_n: float, offset_m: float, length_m: float) -> tuple[float, float]:
    """Return a low and a high estimate of the lateral tip force of a bending section [N]: 1.2 and 2 x T d / L.

    Source: measured on simulated arms of 0.36 to 0.6 m (docs/physics.md, what such robots can do).
    """
    unit_n = tension_n * offset_m / length_m
    return 1.2 * unit_n, 2.0 * unit_n


def solref(timestep_s: float) -> tuple[float, float]:
    """Return MuJoCo's `solref` of the stiffest contact or limit: time constant [s] and damping ratio.

    The time constant is two time steps, the damping is critical. At 2 ms this is the "0.004 1" that light robots need:
    the stiffness of MuJoCo's soft constraints is proportional to mass, so a 10 g finger that presses with 20 N sinks
    40 mm into the default contact and 1.6 mm into this one.

    Source: MuJoCo manual, Modeling, solver parameters; docs/physics.md.
    """
    return _SHORTEST_SOLREF_STEPS * timestep_s, 1.0
