"""Where a simulated limb comes to rest under a load, found without waiting for it."""

from __future__ import annotations

import copy
from collections.abc import Callable

import mujoco
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Load = Callable[[mujoco.MjModel, mujoco.MjData, Vector], None]
"""Adds its generalized forces to the last argument, (nv,)."""

_WITHOUT = (
    mujoco.mjtDisableBit.mjDSBL_CONTACT,
    mujoco.mjtDisableBit.mjDSBL_LIMIT,
    mujoco.mjtDisableBit.mjDSBL_EQUALITY,
    mujoco.mjtDisableBit.mjDSBL_FRICTIONLOSS,
    mujoco.mjtDisableBit.mjDSBL_ACTUATION,
)
_LOAD_STEPS = 4
_ROUNDS = 60
_BALANCED = 1e-9
"""Force left over / largest force, below which a pose is at rest."""
_NUDGE_RAD = 1e-6
_LARGEST_TURN_RAD = 0.3
"""Turn of a joint in one round. Our choice: keeps Newton's method near the branch it began on."""


class Statics:
    """A robot of which some degrees of freedom yield elastically and everything else is held.

    Contacts, limits, friction, springs of tendons and actuators are left out: this asks what the backbone does.
    """

    def __init__(self, model: mujoco.MjModel, gravity_m_s2: Vector | None = None) -> None:
        self.model = copy.copy(model)
        for flag in _WITHOUT:
            self.model.opt.disableflags |= int(flag)
        self.model.tendon_stiffness[:] = 0.0
        self.model.opt.gravity[:] = 0.0 if gravity_m_s2 is None else gravity_m_s2
        self.data = mujoco.MjData(self.model)

    def rest(self, directions: Vector, load: Load | None = None) -> Vector | None:
        """Return how far each direction is turned at rest, or None when no rest was found; `data` is left there.

        Args:
            directions: Speeds of all degrees of freedom for a unit turn of each, (n, nv).
            load: What pulls, besides gravity.

        Source: Newton's method on the balance of spring, gravity and load, with a numerical derivative; loads are
            applied in steps so that large bends are followed and not jumped to.
        """
        turns = np.zeros(len(directions))
        for share in np.arange(1, _LOAD_STEPS + 1) / _LOAD_STEPS:
            for _ in range(_ROUNDS):
                left, largest = self._left_over(directions, turns, load, float(share))
                if np.abs(left).max() <= _BALANCED * largest:
                    break
                slope = self._slope(directions, turns, load, float(share), left)
                try:
                    turn = np.linalg.solve(slope, -left)
                except np.linalg.LinAlgError:
                    return None
                turns = turns + turn * min(1.0, _LARGEST_TURN_RAD / float(np.abs(turn).max()))
            else:
                return None
        return turns

    def at(self, directions: Vector, turns: Vector) -> mujoco.MjData:
        """Return data with the directions turned by so much, from the pose in which no spring is bent."""
        self.data.qpos[:] = self.model.qpos_spring
        self.data.qvel[:] = 0.0
        mujoco.mj_integratePos(self.model, self.data.qpos, turns @ directions, 1.0)
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)
        return self.data

    def _left_over(self, directions: Vector, turns: Vector, load: Load | None, share: float) -> tuple[Vector, float]:
        data = self.at(directions, turns)
        pull = np.zeros(self.model.nv)
        if load is not None:
            load(self.model, data, pull)
        forces = np.array([data.qfrc_passive, share * pull, -share * data.qfrc_bias]) @ directions.T
        return np.asarray(forces.sum(axis=0)), float(np.abs(forces).max()) + 1e-12

    def _slope(self, directions: Vector, turns: Vector, load: Load | None, share: float, left: Vector) -> Vector:
        slope = np.empty((len(turns), len(turns)))
        for column in range(len(turns)):
            nudged = turns.copy()
            nudged[column] += _NUDGE_RAD
            slope[:, column] = (self._left_over(directions, nudged, load, share)[0] - left) / _NUDGE_RAD
        return slope
