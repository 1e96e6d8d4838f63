"""What one goal reads: the sensors that it asked for, by the names it gave them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aidsr.tasks.readings import FloatArray, Readings

SHARED = ("com_position", "com_velocity")
"""Sensors of the whole robot, which mean the same for every goal and so carry no tag."""


@dataclass(frozen=True)
class Seen:
    """The readings of n simulations, as one goal or one limit sees them."""

    readings: Readings
    tag: str
    """What the names of its sensors begin with."""
    dt_s: float
    """Since the control step before [s]."""

    @property
    def n(self) -> int:
        """How many simulations."""
        return self.readings.n

    def name(self, sensor: str) -> str:
        """Return the name of a sensor in the scene."""
        return sensor if sensor in SHARED else f"{self.tag}_{sensor}"

    def __getitem__(self, sensor: str) -> FloatArray:
        """Return the newest sample of a sensor, (n, k)."""
        return self.readings[self.name(sensor)]

    def scalar(self, sensor: str) -> FloatArray:
        """Return the newest sample of a one-number sensor, (n,)."""
        return self[sensor][:, 0]

    def mean_force_n(self, sensor: str) -> FloatArray:
        """Return `Readings.mean_force_n`, (n,) [N]."""
        return self.readings.mean_force_n(self.name(sensor))

    def peak_force_n(self, sensor: str) -> FloatArray:
        """Return `Readings.peak_force_n`, (n,) [N]."""
        return self.readings.peak_force_n(self.name(sensor))

    def mean_speed_m_s(self, sensor: str) -> FloatArray:
        """Return the magnitude of the mean velocity since the last control step, (n,) [m/s]."""
        return np.asarray(np.linalg.norm(self.readings.samples(self.name(sensor)).mean(axis=1), axis=-1))
