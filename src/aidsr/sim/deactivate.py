"""Copies of a compiled model in which a part of the robot does nothing: what is left shows what that part does."""

from __future__ import annotations

import copy
from collections.abc import Iterable

import mujoco

from aidsr.sim.soft_body import read_soft_body
from aidsr.sim.structure import Structure

LOCKED_INERTIA = 1e6
"""Rotor inertia of a locked joint [kg m^2], of a slide [kg]. A rotor resists motion of its joint and nothing else, so
the bodies move as one without a change of their mass; there is no spring or constraint that could become unstable.
Our choice: a moment of 1 N m, more than cables and gravity have here, turns such a joint by 2e-4 rad in 20 s."""

_TURNING = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL))
_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)
_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))


def without_cables(model: mujoco.MjModel, structure: Structure) -> mujoco.MjModel:
    """Return a copy in which no actuator pulls on a tendon of the robot. Springs in tendons remain."""
    return _switched_off(model, structure.tendon_actuators)


def with_locked_soft_body(model: mujoco.MjModel, structure: Structure) -> mujoco.MjModel:
    """Return a copy in which the joints of the soft body stay where they start; see `soft_joints`."""
    return _locked(copy.copy(model), soft_joints(model, structure))


def without_other_actuators(model: mujoco.MjModel, structure: Structure) -> mujoco.MjModel:
    """Return a copy in which actuators of the robot that pull on no tendon exert no force.

    Joints that only they drive stay where they start, as with a brake. Actuators of the environment act as before.
    """
    others = other_actuators(structure)
    held = {joint for i in others for joint in _driven_joints(model, i)} - set(soft_joints(model, structure))
    return _locked(_switched_off(model, others), held)


def soft_joints(model: mujoco.MjModel, structure: Structure) -> tuple[int, ...]:
    """Return the joints of the soft body: hinges, balls and sprung slides of the bodies that tendons bend in series.

    See `aidsr.sim.soft_body`: three places or more in series, so wheels on a tendon and short linkages are none.
    """
    bent = read_soft_body(model, structure, structure.tendon_actuators).bent
    return tuple(joint for joint in structure.joints if model.jnt_bodyid[joint] in bent and _gives_way(model, joint))


def _gives_way(model: mujoco.MjModel, joint: int) -> bool:
    kind = int(model.jnt_type[joint])
    return kind in _TURNING or (kind == _SLIDE and bool(model.jnt_stiffness[joint] > 0))


def other_actuators(structure: Structure) -> tuple[int, ...]:
    """Return the actuators of the robot that pull on no tendon."""
    return tuple(i for i in structure.actuators if i not in structure.tendon_actuators)


def _switched_off(model: mujoco.MjModel, actuators: Iterable[int]) -> mujoco.MjModel:
    """Return a copy in which these actuators exert no force, whatever their gain, bias and least force."""
    changed, flags = copy.copy(model), int(model.opt.disableactuator)
    off = {
        i for i in range(model.nactuator) if 0 <= model.actuator_group[i] < 31 and flags >> model.actuator_group[i] & 1
    }
    off |= set(actuators)
    changed.actuator_group[:] = [int(i in off) for i in range(model.nactuator)]
    changed.opt.disableactuator = 1 << 1
    # MuJoCo forces even a disabled actuator into its force range, which need not contain zero
    changed.actuator_forcelimited[sorted(off)] = False
    return changed


def _locked(model: mujoco.MjModel, joints: Iterable[int]) -> mujoco.MjModel:
    """Lock joints of a model, which is changed and returned."""
    dofs = [dof for dof in range(model.nv) if int(model.dof_jntid[dof]) in set(joints)]
    model.dof_armature[dofs] = LOCKED_INERTIA
    return model


def _driven_joints(model: mujoco.MjModel, actuator: int) -> list[int]:
    kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
    return [target] if kind in _JOINT else []
