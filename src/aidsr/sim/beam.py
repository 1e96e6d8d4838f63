"""Beam theory for chains of rigid segments: which numbers make a chain of joints behave like an elastic rod.

A continuum robot of length L and bending stiffness E I is modelled as N segments of length l = L / N, each bending at a
joint in its middle. The formulas here give that joint's stiffness and damping, say how far a time step can follow
them, and what a cable at an offset d from the backbone does to the chain. docs/physics.md says how well they hold.
"""

from __future__ import annotations

import math

CLAMPED_FREE_FIRST_MODE = 3.516
"""(beta_1 L)^2 of a clamped-free beam. Source: Blevins, Formulas for Natural Frequency and Mode Shape, table 8-1."""

SOLIMP = (0.95, 0.99, 0.001)
"""Impedance of contacts and limits between light bodies. Source: docs/physics.md, soft limits and contacts."""

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


def joint_stiffness(bending_stiffness_n_m2: float, segment_length_m: float) -> float:
    """Stiffness k = E I / l of the hinge in the middle of a segment [N m/rad].

    With joints in the middles a chain of 10 segments is 0.25 % too stiff under a tip load; with joints at the segments'
    starts the same stiffness is 15 % too soft, unless the first joint gets 2 E I / l.

    Source: equal bending energy of a segment of constant curvature; errors measured, docs/physics.md.
    """
    return bending_stiffness_n_m2 / segment_length_m


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


def cable_bending(tension_n: float, offset_m: float, length_m: float, bending_stiffness_n_m2: float) -> float:
    """Angle by which one cable bends a section [rad]: theta = F d L / (E I).

    Source: constant moment F d along the section; friction and the cable's change of offset neglected.
    """
    return tension_n * offset_m * length_m / bending_stiffness_n_m2


def tip_force_range(tension_n: float, offset_m: float, length_m: float) -> tuple[float, float]:
    """Sideways force a bending section can exert with its tip [N], low and high estimate: 1.2 to 2 x T d / L.

    Source: measured on simulated arms of 0.36 to 0.6 m (docs/physics.md, what such robots can do).
    """
    unit_n = tension_n * offset_m / length_m
    return 1.2 * unit_n, 2.0 * unit_n


def solref(timestep_s: float) -> tuple[float, float]:
    """Time constant [s] and damping ratio of the stiffest contact or limit MuJoCo allows: two time steps, critical.

    At 2 ms this is the "0.004 1" that light robots need: soft constraints scale with mass, so a 10 g finger pressing
    with 20 N sinks 40 mm into the default contact and 1.6 mm into this one.

    Source: MuJoCo manual, Modeling, solver parameters; docs/physics.md.
    """
    return _SHORTEST_SOLREF_STEPS * timestep_s, 1.0
