"""The physics of a limb in a few numbers, from which writers take stiffness, damping and force.

Source: Euler-Bernoulli beam. Bending stiffness EI follows from the limb's sag, joint stiffness k = EI / l from EI and
the length l of a segment, damping from the damping ratio of the first mode, tendon force from the intended bend.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

GRAVITY_M_S2 = 9.81
_FIRST_MODE = 3.516
"""omega_1 = 3.516 sqrt(EI / (mu L^4)) of a clamped beam with mass mu per length."""


@dataclass(frozen=True)
class Physique:
    """A limb of equal segments.

    Attributes:
        sag: Weight relative to bending stiffness, w L^3 / EI; an upright limb buckles at 7.84.
        damping_ratio: Damping ratio of the first mode.
        bend_rad: Bend of the whole limb at full pull of one tendon.
    """

    length_m: float
    segments: int
    mass_kg: float
    radius_m: float
    sag: float
    damping_ratio: float
    bend_rad: float

    @property
    def pitch_m(self) -> float:
        """Length of a segment [m]."""
        return self.length_m / self.segments

    @property
    def bending_stiffness_n_m2(self) -> float:
        """Bending stiffness EI [N m2]."""
        return self.mass_kg * GRAVITY_M_S2 * self.length_m**2 / self.sag

    @property
    def stiffness_n_m_rad(self) -> float:
        """Stiffness of one joint [N m/rad]."""
        return self.bending_stiffness_n_m2 / self.pitch_m

    @property
    def damping_s(self) -> float:
        """Ratio of damping to stiffness of every joint [s]."""
        per_length = self.mass_kg / self.length_m
        omega = _FIRST_MODE * math.sqrt(self.bending_stiffness_n_m2 / (per_length * self.length_m**4))
        return 2 * self.damping_ratio / omega

    @property
    def damping_n_m_s_rad(self) -> float:
        """Damping of one joint [N m s/rad]."""
        return self.damping_s * self.stiffness_n_m_rad

    def force_n(self, offset_m: float) -> float:
        """Return the force [N] of a tendon at `offset_m` from the backbone that bends the limb by `bend_rad`."""
        return self.bend_rad * self.bending_stiffness_n_m2 / (offset_m * self.length_m)


def draw_physique(
    rng: np.random.Generator,
    *,
    length_m: tuple[float, float] = (0.12, 0.6),
    segments: tuple[int, int] = (6, 16),
    sag: tuple[float, float] = (0.25, 1.2),
    slenderness: tuple[float, float] = (11, 18),
    bend_rad: tuple[float, float] = (1.0, 2.2),
) -> Physique:
    """Return a limb of ordinary proportions.

    Args:
        rng: Random generator.
        length_m: Range of the length; drawn evenly on a logarithmic scale.
        segments: Range of the number of segments, both ends included.
        sag: Range of the sag.
        slenderness: Range of length / radius.
        bend_rad: Range of the bend.
    """
    length = math.exp(rng.uniform(math.log(length_m[0]), math.log(length_m[1])))
    radius = length / rng.uniform(*slenderness)
    density = rng.uniform(400, 1300)  # kg/m3, from foamed silicone to filled elastomer
    return Physique(
        length_m=length,
        segments=int(rng.integers(segments[0], segments[1] + 1)),
        mass_kg=density * math.pi * radius**2 * length,
        radius_m=radius,
        sag=rng.uniform(*sag),
        damping_ratio=rng.uniform(0.12, 0.5),
        bend_rad=rng.uniform(*bend_rad),
    )
