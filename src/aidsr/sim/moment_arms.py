"""Moment arms of cables about the joints of a robot, in several poses.

Source: the moment arm of a cable about a joint is -dL/dq, the shortening of the cable per radian; this is MuJoCo's
`ten_J` with the opposite sign (MuJoCo documentation, Computation, "Actuation model").
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.couplings import onto_leaders, read_couplings
from aidsr.sim.poses import bent_pose, random_poses
from aidsr.sim.structure import Chain, Structure, Tendon
from aidsr.sim.tendon_effects import unit_pull

Array = NDArray[np.float64]

_HINGE, _BALL = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL)
_STRAIGHT_RAD = 0.02
"""Rotation of every joint in the first pose. It is not zero because in a straight limb a cable that crosses the joint
axes has an extreme length, and so a moment arm of zero."""
_RANDOM_POSES = 6
_RANDOM_RAD = 0.35
"""Largest rotation of a joint in the random poses. Our choice: 20 deg, which is within the range of most joints."""


@dataclass(frozen=True)
class MomentArms:
    """Moment arms of the cables that actuators pull, in a nearly straight pose and in random poses.

    Attributes:
        tendons: Spatial tendons with an actuator; n_tendons of them.
        arms_m: Moment arms, (n_poses, n_tendons, nv) [m/rad; 1 for a slide]; the first pose is the nearly straight one.
        led_m: Moment arms with those of coupled joints added to their leaders, same shape; see
            `aidsr.sim.couplings.onto_leaders`. Followers have the moment arm 0.
        axes: Axis of each rotational degree of freedom in the reference pose, (nv, 3); zero for the others.
    """

    tendons: tuple[Tendon, ...]
    arms_m: Array
    led_m: Array
    axes: Array

    def along(self, model: mujoco.MjModel, chain: Chain, tendon: int) -> Array:
        """Return the moment vector about each turning point of a chain per newton of tension in a cable.

        Args:
            model: Compiled model.
            chain: Hinges and balls in series.
            tendon: Index of the cable in `tendons`.

        Returns:
            Moments in the nearly straight pose, in world axes, (n_points, 3) [m].
        """
        moments = self.arms_m[0, tendon][:, None] * self.axes
        points = np.zeros((len(chain.bodies), 3))
        point = 0
        for joint in chain.joints:
            while int(model.jnt_bodyid[joint]) > chain.bodies[point]:
                point += 1
            first = int(model.jnt_dofadr[joint])
            size = 3 if int(model.jnt_type[joint]) == _BALL else 1
            points[point] += moments[first : first + size].sum(axis=0)
        return points


def read_moment_arms(model: mujoco.MjModel, structure: Structure) -> MomentArms:
    """Return the moment arms of a robot's driven cables."""
    tendons = tuple(tendon for tendon in structure.tendons if tendon.spatial and tendon.actuators)
    poses = [bent_pose(model, structure, _STRAIGHT_RAD)]
    if tendons:
        poses += random_poses(model, structure, _RANDOM_POSES, _RANDOM_RAD)
    shape = (len(poses), len(tendons), model.nv)
    arms = np.array([[unit_pull(model, data, tendon.id) for tendon in tendons] for data in poses]).reshape(shape)
    couplings = read_couplings(model)
    led = [onto_leaders(model, couplings, data.qpos, each) for data, each in zip(poses, arms, strict=True)]
    return MomentArms(tendons, arms, np.array(led).reshape(shape), _read_axes(model))


def _read_axes(model: mujoco.MjModel) -> Array:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    axes = np.zeros((model.nv, 3))
    for joint in range(model.njnt):
        first, kind = int(model.jnt_dofadr[joint]), int(model.jnt_type[joint])
        if kind == _HINGE:
            axes[first] = data.xaxis[joint]
        elif kind == _BALL:
            axes[first : first + 3] = data.xmat[int(model.jnt_bodyid[joint])].reshape(3, 3).T
    return axes
