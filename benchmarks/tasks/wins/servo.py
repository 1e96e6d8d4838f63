"""Which small changes of the cables' tensions move a soft body as wanted, in the pose that it has now."""

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
    """Resolved-rate control of a body that rests between springs and cables.

    In a pose q the joints yield to a change of tensions dT by dq = -K^-1 M^T dT, with their stiffness K and the moment
    arms M of the cables; a place moves by J dq. The change of least squares that moves places as wanted is found within
    the limits of the winches. Source: quasi-static kinematics of continuum robots, e.g. Camarillo et al. (2008).

    Args:
        scene: Every action drives one actuator; joints of the robot have springs.
        damping: How much a change of all of a cable's tension is worth, as a motion [m].
        slackening: Share of the tension that cables would lose in a control step if nothing was wanted of them.
        fastest: Largest change of a tension in a control step, as a share of the whole.
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
        """Let all cables of n episodes be slack."""
        self.share = np.zeros((n, len(self.cable)))

    def look(self, observation: FloatArray) -> None:
        """Take on the pose that one episode's policy observes, (n_observations,)."""
        self.data.qpos[self.columns] = observation[: len(self.columns)]
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_tendon(self.model, self.data)

    def site(self, name: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return a site's position (3,), its axes as columns (3, 3), and how the joints move and turn it (6, nv)."""
        where = self.data.site(name)
        moves = np.zeros((6, self.model.nv))
        mujoco.mj_jacSite(self.model, self.data, moves[:3], moves[3:], where.id)
        return where.xpos.copy(), where.xmat.reshape(3, 3).copy(), moves

    def body(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Return a body's position (3,) and how it moves with the joints, (3, nv)."""
        where = self.data.body(name)
        moves = np.zeros((3, self.model.nv))
        mujoco.mj_jacBody(self.model, self.data, moves, None, where.id)
        return where.xpos.copy(), moves

    def drive(self, row: int, moves: FloatArray, wanted: FloatArray) -> FloatArray:
        """Return the actions of an episode in this control step, (n_actions,).

        Args:
            row: Which episode; see `look`.
            moves: How places move with the joints, (k, nv).
            wanted: How they are to move, (k,).
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
        # the mount moves at next to no cost
        cost = np.where(self.cable, self.damping, 0.05 * self.damping) ** 2
        prior = np.where(self.cable, -self.slackening * share, 0.0)
        change = within(effects.T @ effects + np.diag(cost), effects.T @ wanted + cost * prior, low, high)
        self.share[row] = np.where(self.cable, np.clip(share + change, 0.0, 1.0), 0.0)
        return np.where(self.cable, 2.0 * self.share[row] - 1.0, change)


def within(matrix: FloatArray, right: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return about the smallest of x A x / 2 - b x between limits, (k,): what is out of them is held there, in turn."""
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
