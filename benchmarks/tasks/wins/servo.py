"""Servo for soft bodies: small changes of cable tensions that produce a required motion from the present pose."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.learn.episodes.proprioception import Proprioception
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.structure import read_structure
from aidsr.tasks.readings import FloatArray


class Servo:
    """Resolved-rate control of a body in equilibrium between springs and cables.

    In a pose q a change of tensions dT moves the joints by dq = -K^-1 M^T dT, with the joints' stiffness K and the
    moment arms M of the cables; a point of the body moves by J dq. The least-squares change of tensions for a required
    motion of points is computed within the limits of the winches. Source: quasi-static kinematics of continuum robots,
    e.g. Camarillo et al. (2008).

    Args:
        scene: Scene in which every action drives one actuator and the robot's joints have springs.
        damping: Cost of a change of a cable's tension by its full range, as an error of motion [m].
        slackening: Share of its tension that a cable would lose in a control step if no motion was required.
        fastest: Largest change of a tension in a control step, as a share of the full tension.
    """

    def __init__(
        self, scene: TaskScene, *, damping: float = 0.01, slackening: float = 0.02, fastest: float = 0.15
    ) -> None:
        self.model, self.data = scene.model, mujoco.MjData(scene.model)
        self.dt_s = scene.task.control_dt_s
        self.damping, self.slackening, self.fastest = damping, slackening, fastest
        ids = [self.model.actuator(group.actuators[0]).id for group in scene.actions.groups]
        self.cable = self.model.actuator_trntype[ids] == int(mujoco.mjtTrn.mjTRN_TENDON)
        self.target = self.model.actuator_trnid[ids, 0]
        self.most = self.model.actuator_ctrlrange[ids, 1]
        self.columns = list(Proprioception.of(self.model, read_structure(self.model)).qpos)
        stiffness = np.reshape(self.model.jnt_stiffness, (self.model.njnt, -1))[:, 0]
        self.yields = np.zeros(self.model.nv)
        for joint in np.flatnonzero(stiffness):
            self.yields[self.model.jnt_dofadr[joint]] = 1.0 / stiffness[joint]
        self.share: FloatArray = np.zeros((0, len(ids)))

    def begin(self, n: int) -> None:
        """Reset the state for n new episodes, with all cables slack."""
        self.share = np.zeros((n, len(self.cable)))

    def look(self, observation: FloatArray) -> None:
        """Compute the kinematics in the pose observed in one episode, (n_observations,)."""
        self.data.qpos[self.columns] = observation[: len(self.columns)]
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_tendon(self.model, self.data)

    def site(self, name: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return a site's position (3,), axes as columns (3, 3), and Jacobian of translation and rotation (6, nv)."""
        where = self.data.site(name)
        moves = np.zeros((6, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, moves[:3], moves[3:], where.id)
        return where.xpos.copy(), where.xmat.reshape(3, 3).copy(), moves

    def body(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Return a body's position (3,) and its translational Jacobian (3, nv)."""
        where = self.data.body(name)
        moves = np.zeros((3, self.model.nv))
        mujoco.mj_jacBody(self.model, self.data, moves, None, where.id)
        return where.xpos.copy(), moves

    def drive(self, row: int, moves: FloatArray, wanted: FloatArray) -> FloatArray:
        """Return the actions of an episode in this control step, (n_actions,).

        Args:
            row: Number of the episode whose observation was passed to `look`.
            moves: Jacobian of the controlled motions, (k, nv).
            wanted: Required motions in this control step, (k,).
        """
        arms = _dense(self.model, self.data)
        effects = np.zeros((len(moves), len(self.cable)))
        for k, target in enumerate(self.target):
            dof = self.model.jnt_dofadr[target]
            effects[:, k] = moves @ (-self.yields * arms[target]) if self.cable[k] else moves[:, dof] * self.dt_s
        effects *= self.most
        share = self.share[row]
        low = np.where(self.cable, np.maximum(-self.fastest, -share), -1.0)
        high = np.where(self.cable, np.minimum(self.fastest, 1.0 - share), 1.0)
        # motions of the mount cost almost nothing
        cost = np.where(self.cable, self.damping, 0.05 * self.damping) ** 2
        prior = np.where(self.cable, -self.slackening * share, 0.0)
        change = within(effects.T @ effects + np.diag(cost), effects.T @ wanted + cost * prior, low, high)
        self.share[row] = np.where(self.cable, np.clip(share + change, 0.0, 1.0), 0.0)
        return np.where(self.cable, 2.0 * self.share[row] - 1.0, change)


def within(matrix: FloatArray, right: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return an approximate minimum of x A x / 2 - b x within limits, (k,), with A = `matrix` and b = `right`.

    Components outside of their limits are fixed at these limits, and the others are solved again.
    """
    x = np.linalg.solve(matrix, right)
    free: NDArray[np.bool_] = np.ones(len(x), dtype=bool)
    while (outside := free & ((x < low) | (x > high))).any():
        free &= ~outside
        x = np.clip(x, low, high)
        if free.any():
            x[free] = np.linalg.solve(matrix[np.ix_(free, free)], (right - matrix[:, ~free] @ x[~free])[free])
    return np.asarray(x)


def _dense(model: Any, data: Any) -> FloatArray:
    """Return the moment arms of all tendons, (ntendon, nv)."""
    arms = np.zeros((model.ntendon, model.nv))
    mujoco.mju_sparse2dense(arms, data.ten_J.reshape(-1), model.ten_J_rownnz, model.ten_J_rowadr, model.ten_J_colind)
    return arms
