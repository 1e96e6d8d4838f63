"""Factors on quantities when the units of mass, length and time change."""

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
        """Return the units of a body `factor` times as large with the same density and the same Young's modulus."""
        return cls(mass=factor**3, length=factor, time=factor)

    def of(self, *, mass: int = 0, length: int = 0, time: int = 0) -> float:
        """Return the factor on a quantity with these powers of mass, length and time."""
        return self.mass**mass * self.length**length * self.time**time

    @property
    def force(self) -> float:
        """Factor on N."""
        return self.of(mass=1, length=1, time=-2)


@dataclass(frozen=True)
class Coordinate:
    """A generalised coordinate: an angle, or a length such as the position of a slide joint or a tendon's length."""

    units: Units
    is_length: bool

    def value(self, power: int = 1, time: int = 0) -> float:
        """Return the factor on the coordinate to a power, times a power of time."""
        return self.units.of(length=power * self.is_length, time=time)

    @property
    def force(self) -> float:
        """Factor on the generalised force: N for a length, N m for an angle."""
        return self.units.of(mass=1, length=2 - self.is_length, time=-2)

    @property
    def stiffness(self) -> tuple[float, ...]:
        """Factors on MuJoCo's stiffness polynomial: force per coordinate to the power 1, 2 and 3."""
        return tuple(self.force * self.value(-power) for power in (1, 2, 3))

    @property
    def damping(self) -> tuple[float, ...]:
        """Factors on MuJoCo's damping polynomial: force per velocity to the power 1, 2 and 3."""
        return tuple(self.force * self.value(-power, time=power) for power in (1, 2, 3))

    @property
    def inertia(self) -> float:
        """Factor on armature: force per acceleration."""
        return self.force * self.value(-1, time=2)
