"""Copies of a compiled model with some of the robot's joints or actuators deactivated.

The difference to the original model shows the contribution of the deactivated part.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable

import mujoco

from aidsr.sim.soft_body import read_soft_body
from aidsr.sim.structure import Structure

LOCKED_INERTIA = 1e6
"""Armature (rotor inertia) of a locked joint [kg m^2; kg for a slide]. Armature resists motion of its joint only, so
the bodies on both sides move as one and keep their mass; no spring or constraint is added that could become unstable.
Our choice: a moment of 1 N m, more than cables and gravity have here, turns such a joint by 2e-4 rad in 20 s."""

_TURNING = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL))
_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)
_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))


def without_cables(model: mujoco.MjModel, structure: Structure) -> mujoco.MjModel:
    """Return a copy in which no actuator acts on a tendon of the robot. Springs of tendons remain."""
    return switched_off(model, structure.tendon_actuators)


def with_locked_soft_body(model: mujoco.MjModel, structure: Structure) -> mujoco.MjModel:
    """Return a copy in which the joints of the soft body keep their initial positions; see `soft_joints`."""
    return _locked(copy.copy(model), soft_joints(model, structure))


def without_other_actuators(model: mujoco.MjModel, structure: Structure) -> mujoco.MjModel:
    """Return a copy in which the robot's actuators that do not act on a tendon exert no force.

    The joints they drive keep their initial positions, as with a brake, except joints of the soft body. Actuators of
    the environment act as before.
    """
    others = other_actuators(structure)
    held = {joint for i in others for joint in _driven_joints(model, i)} - set(soft_joints(model, structure))
    return _locked(switched_off(model, others), held)


def soft_joints(model: mujoco.MjModel, structure: Structure) -> tuple[int, ...]:
    """Return the joints of the soft body: hinges, balls and slides with a spring of the bodies that tendons bend.

    See `aidsr.sim.soft_body`: at least three joints must bend in series, so wheels on a tendon and short linkages do
    not count.
    """
    bent = read_soft_body(model, structure, structure.tendon_actuators).bent
    return tuple(joint for joint in structure.joints if model.jnt_bodyid[joint] in bent and _gives_way(model, joint))


def _gives_way(model: mujoco.MjModel, joint: int) -> bool:
    kind = int(model.jnt_type[joint])
    return kind in _TURNING or (kind == _SLIDE and bool(model.jnt_stiffness[joint] > 0))


def other_actuators(structure: Structure) -> tuple[int, ...]:
    """Return the actuators of the robot that do not act on a tendon."""
    return tuple(i for i in structure.actuators if i not in structure.tendon_actuators)


def switched_off(model: mujoco.MjModel, actuators: Iterable[int]) -> mujoco.MjModel:
    """Return a copy in which these actuators exert no force, whatever their gain, bias and force range.

    Actuators that the model already disables stay disabled.
    """
    changed, flags = copy.copy(model), int(model.opt.disableactuator)
    off = {
        i for i in range(model.nactuator) if 0 <= model.actuator_group[i] < 31 and flags >> model.actuator_group[i] & 1
    }
    off |= set(actuators)
    changed.actuator_group[:] = [int(i in off) for i in range(model.nactuator)]
    changed.opt.disableactuator = 1 << 1
    # MuJoCo clamps the force of a disabled actuator to its force range too, which may exclude zero
    changed.actuator_forcelimited[sorted(off)] = False
    return changed


def _locked(model: mujoco.MjModel, joints: Iterable[int]) -> mujoco.MjModel:
    """Lock joints of a model; the model is changed in place and returned."""
    dofs = [dof for dof in range(model.nv) if int(model.dof_jntid[dof]) in set(joints)]
    model.dof_armature[dofs] = LOCKED_INERTIA
    return model


def _driven_joints(model: mujoco.MjModel, actuator: int) -> list[int]:
    kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
    return [target] if kind in _JOINT else []
