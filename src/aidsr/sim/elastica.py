"""Reference solutions for an elastic rod, with which simulated chains are compared.

A rod is clamped at one end and consists of straight pieces, each with its own stiffness and mass; a rigid part may be
attached to its free end. Bending may be arbitrarily large; stretch and shear are neglected.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

_STEPS = 240
"""Runge-Kutta steps along a whole rod. Our choice: the tip is then within 1e-6 L of the exact elastica."""

_ELEMENTS = 48
"""Beam elements in a whole rod. Our choice: the first frequency is then within 1e-5 of the exact one."""


@dataclass(frozen=True)
class Rod:
    """A straight rod, clamped at its beginning.

    Attributes:
        lengths_m: Lengths of its pieces from the clamp outwards, (n,) [m].
        bending_stiffness_n_m2: E I of each piece, (n,) [N m^2].
        mass_per_length_kg_m: Mass per length of each piece, (n,) [kg/m].
        tip_mass_kg: Mass of a rigid part on the free end [kg].
        tip_offset_m: Distance of that part's centre of mass beyond the free end [m].
        tip_inertia_kg_m2: Moment of inertia of that part about its centre of mass and the axis of bending [kg m^2].
    """

    lengths_m: Vector
    bending_stiffness_n_m2: Vector
    mass_per_length_kg_m: Vector
    tip_mass_kg: float = 0.0
    tip_offset_m: float = 0.0
    tip_inertia_kg_m2: float = 0.0

    @property
    def length_m(self) -> float:
        """Length of the whole rod [m]."""
        return float(self.lengths_m.sum())

    @property
    def mass_kg(self) -> float:
        """Mass of the rod including the rigid part on its free end [kg]."""
        return float(self.lengths_m @ self.mass_per_length_kg_m) + self.tip_mass_kg


@dataclass(frozen=True)
class Tip:
    """Position and angle of the free end of a bent rod: along the straight rod, perpendicular to it, and rotation."""

    along_m: float
    transverse_m: float
    angle_rad: float


def loaded_tip(rod: Rod, *, load_n: float = 0.0, gravity_m_s2: float = 0.0) -> Tip:
    """Return the tip of a rod under a force at its end, its own weight, or both, perpendicular to the straight rod.

    The forces keep their direction however far the rod bends.

    Source: the elastica, E I theta'' = -V(s) cos(theta), where V is the force carried beyond s; integrated from the tip
    to the clamp (Runge-Kutta, fourth order). The tip angle is found by false position such that the angle at the clamp
    is 0.
    """
    low, high = 0.0, math.pi / 2.0
    missed_low, missed_high = (_integrate(rod, angle, load_n, gravity_m_s2)[0] for angle in (low, high))
    if missed_low >= 0.0:
        return Tip(rod.length_m, 0.0, 0.0)
    for _ in range(100):
        angle = (low * missed_high - high * missed_low) / (missed_high - missed_low)
        missed, along, transverse = _integrate(rod, angle, load_n, gravity_m_s2)
        if abs(missed) < 1e-9 * angle:
            break
        # Illinois variant: halving the value at the retained end avoids slow one-sided convergence.
        if missed < 0.0:
            low, missed_low, missed_high = angle, missed, missed_high / 2.0
        else:
            high, missed_high, missed_low = angle, missed, missed_low / 2.0
    return Tip(along, transverse, angle)


def curved_tip(lengths_m: Vector, curvatures_1_m: Vector) -> Tip:
    """Return the tip of a rod whose pieces are circular arcs with these curvatures.

    Source: plane geometry; a cable parallel to the rod at a constant offset bends it with constant curvature.
    """
    along = transverse = angle = 0.0
    for length, curvature in zip(lengths_m, curvatures_1_m, strict=True):
        turn = length * curvature
        # the sin(x)/x form of the chord also holds for a straight piece
        chord = length * float(np.sinc(turn / (2.0 * math.pi)))
        along += chord * math.cos(angle + turn / 2.0)
        transverse += chord * math.sin(angle + turn / 2.0)
        angle += turn
    return Tip(float(along), float(transverse), float(angle))


def first_frequency(rod: Rod) -> float:
    """Return the first natural frequency of bending [rad/s].

    Source: Euler-Bernoulli beam with cubic finite elements, e.g. Przemieniecki, Theory of Matrix Structural Analysis,
    chapters 5 and 11; the mass, offset and inertia of a rigid part on the end are added to the last node.
    """
    stiffness, mass = _assemble(rod)
    free = slice(2, None)
    root = np.linalg.cholesky(mass[free, free])
    inverse = np.linalg.inv(root)
    squared = np.linalg.eigvalsh(inverse @ stiffness[free, free] @ inverse.T)
    return float(math.sqrt(squared[0]))


def _integrate(rod: Rod, tip_angle: float, load_n: float, gravity_m_s2: float) -> tuple[float, float, float]:
    """Return the angle at the clamp [rad] and the tip's position along and perpendicular to the straight rod [m].

    `tip_angle` is the angle at the tip [rad], from which the rod is integrated to the clamp.
    """
    angle = tip_angle
    carried = load_n + rod.tip_mass_kg * gravity_m_s2
    moment = rod.tip_mass_kg * gravity_m_s2 * rod.tip_offset_m * math.cos(tip_angle)
    along = transverse = 0.0
    pieces = zip(rod.lengths_m[::-1], rod.bending_stiffness_n_m2[::-1], rod.mass_per_length_kg_m[::-1], strict=True)
    for length, stiffness, density in pieces:
        steps = max(2, math.ceil(_STEPS * length / rod.length_m))
        h, weight = float(length) / steps, float(density) * gravity_m_s2
        for _ in range(steps):
            halfway, beyond = carried + weight * h / 2.0, carried + weight * h
            turn_1, gain_1 = moment / stiffness, carried * math.cos(angle)
            angle_2 = angle - h / 2.0 * turn_1
            turn_2, gain_2 = (moment + h / 2.0 * gain_1) / stiffness, halfway * math.cos(angle_2)
            angle_3 = angle - h / 2.0 * turn_2
            turn_3, gain_3 = (moment + h / 2.0 * gain_2) / stiffness, halfway * math.cos(angle_3)
            angle_4 = angle - h * turn_3
            turn_4, gain_4 = (moment + h * gain_3) / stiffness, beyond * math.cos(angle_4)
            along += h / 6.0 * (math.cos(angle) + 2.0 * math.cos(angle_2) + 2.0 * math.cos(angle_3) + math.cos(angle_4))
            transverse += (
                h / 6.0 * (math.sin(angle) + 2.0 * math.sin(angle_2) + 2.0 * math.sin(angle_3) + math.sin(angle_4))
            )
            angle -= h / 6.0 * (turn_1 + 2.0 * turn_2 + 2.0 * turn_3 + turn_4)
            moment += h / 6.0 * (gain_1 + 2.0 * gain_2 + 2.0 * gain_3 + gain_4)
            carried = beyond
    return angle, along, transverse


def _assemble(rod: Rod) -> tuple[Vector, Vector]:
    """Return the stiffness and the mass matrix; the coordinates are deflection and slope of each node."""
    counts = [max(1, math.ceil(_ELEMENTS * length / rod.length_m)) for length in rod.lengths_m]
    size = 2 * (sum(counts) + 1)
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    first = 0
    pieces = zip(counts, rod.lengths_m, rod.bending_stiffness_n_m2, rod.mass_per_length_kg_m, strict=True)
    for count, length, bending, density in pieces:
        h = float(length) / count
        scale = np.array([1.0, h, 1.0, h])
        spring = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) * bending / h**3
        inertia = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
        for _ in range(count):
            place = slice(first, first + 4)
            stiffness[place, place] += spring * np.outer(scale, scale)
            mass[place, place] += inertia * np.outer(scale, scale) * density * h / 420.0
            first += 2
    tip, offset = rod.tip_mass_kg, rod.tip_offset_m
    mass[-2:, -2:] += np.array([[tip, tip * offset], [tip * offset, tip * offset**2 + rod.tip_inertia_kg_m2]])
    return stiffness, mass
