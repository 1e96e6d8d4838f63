"""Readings of one goal: its own sensors, by the names that it gave them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aidsr.tasks.readings import FloatArray, Readings

SHARED = ("com_position", "com_velocity")
"""Sensors of the whole robot. They mean the same for every goal, so their names have no tag."""


@dataclass(frozen=True)
class GoalReadings:
    """Readings of n simulations for one goal or one limit."""

    readings: Readings
    tag: str
    """Prefix of its sensor names."""
    dt_s: float
    """Time since the previous control step [s]."""

    @property
    def n(self) -> int:
        """Number of simulations."""
        return self.readings.n

    def name(self, sensor: str) -> str:
        """Return the name in the scene of one of its sensors."""
        return sensor if sensor in SHARED else f"{self.tag}_{sensor}"

    def __getitem__(self, sensor: str) -> FloatArray:
        """Return the newest sample of a sensor, (n, k)."""
        return self.readings[self.name(sensor)]

    def scalar(self, sensor: str) -> FloatArray:
        """Return the newest sample of a one-number sensor, (n,)."""
        return self[sensor][:, 0]

    def mean_force_n(self, sensor: str) -> FloatArray:
        """Return `Readings.mean_force_n` of a sensor, (n,) [N]."""
        return self.readings.mean_force_n(self.name(sensor))

    def peak_force_n(self, sensor: str) -> FloatArray:
        """Return `Readings.peak_force_n` of a sensor, (n,) [N]."""
        return self.readings.peak_force_n(self.name(sensor))

    def all_contacts_n(self, sensor: str) -> FloatArray:
        """Return `Readings.all_contacts_n` of a sensor, (n,) [N]."""
        return self.readings.all_contacts_n(self.name(sensor))

    def mean_speed_m_s(self, sensor: str) -> FloatArray:
        """Return the magnitude of a sensor's mean velocity since the last control step, (n,) [m/s]."""
        return np.asarray(np.linalg.norm(self.readings.samples(self.name(sensor)).mean(axis=1), axis=-1))
