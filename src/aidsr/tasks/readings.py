"""What a task sees: named sensors of one or many simulations, as arrays with a leading axis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from aidsr.sim.task_sensors import CONTACT_SLOT_WIDTH

__all__ = ["TOUCH_N", "BoolArray", "Contacts", "FloatArray", "Outline", "Readings"]

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

TOUCH_N = 0.05
"""Least force that counts as touching. Source: our choice, well above solver noise, the weight of 5 g."""


@dataclass(frozen=True)
class Contacts:
    """The slots of one "contacts" sensor (see `TaskSensor`); n simulations, s slots."""

    found: BoolArray
    """Which slots hold a contact, (n, s)."""
    force_n: FloatArray
    """Normal force, 0 for an empty slot, (n, s) [N]."""
    position_m: FloatArray
    """World position, (n, s, 3) [m]."""
    normal: FloatArray
    """Unit normal from the robot into the target, (n, s, 3)."""

    def opposition(self) -> FloatArray:
        """Return how far the contacts face each other: 0 none or all from one side, 1 exactly opposite, (n,).

        Source: our choice. Two contacts can hold a body between them when their normals oppose (Nguyen 1988,
        "Constructing force-closure grasps"); this is that test made gradual: half of one minus the smallest cosine
        between two contact normals.
        """
        pairs = self.found[:, :, None] & self.found[:, None, :]
        cosine = np.where(pairs, np.einsum("nik,njk->nij", self.normal, self.normal), 1.0)
        return np.asarray((1.0 - cosine.min(axis=(1, 2))) / 2.0)


@dataclass(frozen=True)
class Outline:
    """The robot's surface as balls strung along its geoms; n simulations, p balls."""

    center_m: FloatArray
    """World position, (n, p, 3) [m]."""
    radius_m: FloatArray
    """(p,) [m]."""
    length_share: FloatArray
    """How much of the body's length each ball stands for; they add up to 1, (p,)."""


@dataclass(frozen=True)
class Readings:
    """Everything a task may read after one control step, for n simulations of one scene."""

    sensors: Mapping[str, FloatArray]
    """By name, (n, s, k): the s physics steps since the last control step, oldest first, k numbers each."""
    time_s: FloatArray
    """Time since the start of the episode, (n,) [s]."""
    length_m: float
    """The robot's characteristic length [m]."""
    sample_dt_s: float
    """Time between two samples [s]."""
    parameters: Mapping[str, FloatArray] = field(default_factory=dict)
    """What `Variation.parameters` says of each episode, (n, k)."""
    outline: Outline | None = None
    """The robot's own surface, for tasks that set `needs_outline`."""

    @property
    def n(self) -> int:
        """How many simulations."""
        return int(self.time_s.shape[0])

    def __getitem__(self, name: str) -> FloatArray:
        """Return the newest sample of a sensor, (n, k)."""
        return self.samples(name)[:, -1]

    def scalar(self, name: str) -> FloatArray:
        """Return the newest sample of a one-number sensor, (n,)."""
        return self[name][:, 0]

    def samples(self, name: str) -> FloatArray:
        """Return all samples of a sensor since the last control step, (n, s, k)."""
        if name not in self.sensors:
            raise KeyError(f'the scene has no sensor "{name}"; it has {", ".join(sorted(self.sensors))}')
        return self.sensors[name]

    def force_n(self, name: str) -> FloatArray:
        """Return the newest magnitude of a force sensor, (n,) [N]."""
        return np.asarray(np.linalg.norm(self[name], axis=-1))

    def mean_force_n(self, name: str, *, mean_over_s: float = 0.01) -> FloatArray:
        """Return the magnitude of a force sensor's newest mean, (n,) [N]; the arguments are those of `peak_force_n`."""
        return self._mean_forces_n(name, mean_over_s)[:, -1]

    def peak_force_n(self, name: str, *, mean_over_s: float = 0.01) -> FloatArray:
        """Return the largest magnitude of a force sensor since the last control step, (n,) [N].

        Args:
            name: A sensor of three force components.
            mean_over_s: Forces are averaged over blocks of this time first [s], because the force of a single physics
                step depends on the solver, not on the touch (our choice: 10 ms, shorter than any servo reacts).
        """
        return np.asarray(self._mean_forces_n(name, mean_over_s).max(axis=1))

    def _mean_forces_n(self, name: str, mean_over_s: float) -> FloatArray:
        """Return the magnitudes of a force sensor's means over blocks of some time, newest last, (n, blocks) [N]."""
        means = _block_means(self.samples(name), mean_over_s / self.sample_dt_s)
        return np.asarray(np.linalg.norm(means, axis=-1))

    def peak_contact_n(self, name: str, *, mean_over_s: float = 0.01, together: bool = False) -> FloatArray:
        """Return the largest force in a "contacts" sensor since the last control step, (n,) [N].

        Args:
            name: A sensor of contacts.
            mean_over_s: See `peak_force_n`.
            together: Add all contacts of a moment up instead of looking at the strongest.
        """
        slots = self.samples(name).reshape(
            self.n, -1, self.samples(name).shape[2] // CONTACT_SLOT_WIDTH, CONTACT_SLOT_WIDTH
        )
        force_n = np.where(slots[..., 0] > 0, slots[..., 1], 0.0)
        at_once = force_n.sum(axis=2) if together else force_n.max(axis=2)
        return np.asarray(_block_means(at_once[..., None], mean_over_s / self.sample_dt_s)[..., 0].max(axis=1))

    @property
    def body(self) -> Outline:
        """The robot's outline, for tasks that set `needs_outline`."""
        if self.outline is None:
            raise ValueError("these readings carry no outline; the task must set needs_outline")
        return self.outline

    def contacts(self, name: str) -> Contacts:
        """Return the newest sample of a "contacts" sensor, taken apart."""
        slots = self[name].reshape(self.n, -1, CONTACT_SLOT_WIDTH)
        found = slots[:, :, 0] > 0
        return Contacts(
            found=found,
            force_n=np.where(found, slots[:, :, 1], 0.0),
            position_m=slots[:, :, 4:7],
            normal=slots[:, :, 7:10],
        )


def _block_means(samples: FloatArray, length: float) -> FloatArray:
    """Return means over blocks of about `length` samples, newest block last: (n, s, k) -> (n, blocks, k)."""
    block = max(1, min(samples.shape[1], round(length)))
    kept = samples[:, samples.shape[1] % block :]
    return np.asarray(kept.reshape(kept.shape[0], -1, block, kept.shape[2]).mean(axis=2))
