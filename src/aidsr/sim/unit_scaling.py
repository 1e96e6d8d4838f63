"""Factors by which physical quantities change when masses, lengths and times are scaled."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self


@dataclass(frozen=True)
class Units:
    """Factors on every mass, length and time."""

    mass: float
    length: float
    time: float

    @classmethod
    def same_material(cls, factor: float) -> Self:
        """Return the factors for a body scaled by `factor` with the same density and the same Young's modulus."""
        return cls(mass=factor**3, length=factor, time=factor)

    def of(self, *, mass: int = 0, length: int = 0, time: int = 0) -> float:
        """Return the factor on a quantity with these powers of mass, length and time."""
        return self.mass**mass * self.length**length * self.time**time

    @property
    def force(self) -> float:
        """Factor on a force."""
        return self.of(mass=1, length=1, time=-2)


@dataclass(frozen=True)
class Coordinate:
    """A generalized coordinate: an angle, or a length such as the position of a slide joint or a tendon's length."""

    units: Units
    is_length: bool

    def value(self, power: int = 1, time: int = 0) -> float:
        """Return the factor on the product of a power of the coordinate and a power of time."""
        return self.units.of(length=power * self.is_length, time=time)

    @property
    def force(self) -> float:
        """Factor on the generalized force: N for a length, N m for an angle."""
        return self.units.of(mass=1, length=2 - self.is_length, time=-2)

    @property
    def stiffness(self) -> tuple[float, ...]:
        """Factors on the coefficients of MuJoCo's stiffness polynomial: force per coordinate^1, ^2 and ^3."""
        return tuple(self.force * self.value(-power) for power in (1, 2, 3))

    @property
    def damping(self) -> tuple[float, ...]:
        """Factors on the coefficients of MuJoCo's damping polynomial: force per velocity^1, ^2 and ^3."""
        return tuple(self.force * self.value(-power, time=power) for power in (1, 2, 3))

    @property
    def inertia(self) -> float:
        """Factor on armature: force per acceleration."""
        return self.force * self.value(-1, time=2)
