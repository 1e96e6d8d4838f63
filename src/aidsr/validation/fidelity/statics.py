"""The rest pose of a simulated limb under a load, found by Newton's method instead of a simulation."""

from __future__ import annotations

import copy
from collections.abc import Callable

import mujoco
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Load = Callable[[mujoco.MjModel, mujoco.MjData, Vector], None]
"""Adds the generalized forces of a load to its last argument, (nv,)."""

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
"""Residual force / largest force below which a pose is at rest."""
_NUDGE_RAD = 1e-6
_LARGEST_TURN_RAD = 0.3
"""Largest turn of a joint in one iteration. Our choice: keeps Newton's method near the branch on which it began."""


class Statics:
    """A robot of which some degrees of freedom are elastic and all others are fixed.

    Contacts, limits, equality constraints, friction, tendon springs and actuators are disabled, so that only the
    backbone acts.
    """

    def __init__(self, model: mujoco.MjModel, gravity_m_s2: Vector | None = None) -> None:
        self.model = copy.copy(model)
        for flag in _WITHOUT:
            self.model.opt.disableflags |= int(flag)
        self.model.tendon_stiffness[:] = 0.0
        self.model.opt.gravity[:] = 0.0 if gravity_m_s2 is None else gravity_m_s2
        self.data = mujoco.MjData(self.model)

    def rest(self, directions: Vector, load: Load | None = None) -> Vector | None:
        """Return the turn of each direction at rest, (n,), or None if no rest pose was found.

        Args:
            directions: Velocities of all degrees of freedom for a unit turn of each direction, (n, nv).
            load: Load in addition to gravity.

        Source: Newton's method on the balance of spring, gravity and load forces, with a numerical derivative. Loads
            are applied in steps, so that the solution follows large bends continuously.
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
        """Return `data` with each direction turned by an amount from the pose in which all joint springs are at rest.

        Args:
            directions: As in `rest`, (n, nv).
            turns: Turn of each direction, (n,).
        """
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
