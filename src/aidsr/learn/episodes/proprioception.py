"""Proprioception: what every policy observes of its own robot, the same for all designs and tasks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np
from mujoco.batch import Batch

from aidsr.sim.structure import Structure
from aidsr.tasks.readings import FloatArray

_QPOS = {int(mujoco.mjtJoint.mjJNT_FREE): 7, int(mujoco.mjtJoint.mjJNT_BALL): 4}
_DOF = {int(mujoco.mjtJoint.mjJNT_FREE): 6, int(mujoco.mjtJoint.mjJNT_BALL): 3}


@dataclass(frozen=True)
class Proprioception:
    """Indices of the state values of a simulation that belong to the robot.

    They are base and joint positions (quaternions unchanged) and velocities, tendon lengths and velocities, and
    actuator forces. The base of a robot on a moving mount is the set of joints that move the mount.
    """

    qpos: tuple[int, ...]
    qvel: tuple[int, ...]
    tendons: tuple[int, ...]
    actuators: tuple[int, ...]

    @classmethod
    def of(cls, model: mujoco.MjModel, structure: Structure) -> Self:
        """Return the robot's own indices in a compiled scene."""
        joints = [*_carrying_joints(model, structure), *structure.joints]
        return cls(
            qpos=tuple(_columns(model, joints, model.jnt_qposadr, _QPOS)),
            qvel=tuple(_columns(model, joints, model.jnt_dofadr, _DOF)),
            tendons=tuple(tendon.id for tendon in structure.tendons),
            actuators=structure.actuators,
        )

    @property
    def size(self) -> int:
        """Number of observed values."""
        return len(self.qpos) + len(self.qvel) + 2 * len(self.tendons) + len(self.actuators)

    def read(self, batch: Batch) -> FloatArray:
        """Return the observed values for every simulation of a batch, (n, size)."""
        return np.concatenate(
            [
                batch.bind("qpos")[:, list(self.qpos)],
                batch.bind("qvel")[:, list(self.qvel)],
                batch.bind("ten_length")[:, list(self.tendons)],
                batch.bind("ten_velocity")[:, list(self.tendons)],
                batch.bind("actuator_force")[:, list(self.actuators)],
            ],
            axis=1,
        )


def _carrying_joints(model: mujoco.MjModel, structure: Structure) -> list[int]:
    """Return the environment's joints that carry the robot, outermost first."""
    joints: set[int] = set()
    for root in structure.roots:
        body = int(model.body_parentid[root])
        while body:
            first = int(model.body_jntadr[body])
            joints.update(range(first, first + int(model.body_jntnum[body])))
            body = int(model.body_parentid[body])
    return sorted(joints)


def _columns(model: mujoco.MjModel, joints: list[int], starts: FloatArray, sizes: dict[int, int]) -> list[int]:
    return [int(starts[j]) + k for j in joints for k in range(sizes.get(int(model.jnt_type[j]), 1))]
