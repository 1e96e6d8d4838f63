"""Counterfactuals: changes that remove one property of a robot, to find out whether it causes a symptom."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from aidsr.sim.structure import Structure
from aidsr.validation.protocol import Variant

_ROBOT_TYPE, _ROBOT_AFFINITY = 1 << 30, 1 << 29
"""Collision bits that users' models do not use. MuJoCo makes a contact only if a bit of one geom's contype is in the
other geom's conaffinity."""
_NEVER_M = -1e6


def without_limits(model: mujoco.MjModel) -> None:
    """Disable all joint and tendon limits."""
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)


def softer(factor: float) -> Variant:
    """Return a change that multiplies stiffness and damping of all joints and tendons by a factor."""

    def change(model: mujoco.MjModel) -> None:
        for values in (model.jnt_stiffness, model.tendon_stiffness, model.dof_damping, model.tendon_damping):
            values[:] *= factor

    return change


def without_self_contact(structure: Structure) -> Variant:
    """Return a change that disables contacts between the robot's parts and keeps those with everything else."""

    def change(model: mujoco.MjModel) -> None:
        ours = np.isin(np.arange(model.ngeom), structure.geoms)
        touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
        model.geom_contype[ours & touching] = _ROBOT_TYPE
        model.geom_conaffinity[ours & touching] = _ROBOT_AFFINITY
        model.geom_contype[~ours & touching] |= _ROBOT_AFFINITY
        model.geom_conaffinity[~ours & touching] |= _ROBOT_TYPE
        between = np.isin(model.pair_geom1, structure.geoms) & np.isin(model.pair_geom2, structure.geoms)
        model.pair_margin[between] = _NEVER_M

    return change


def without_contacts_of(geoms: Sequence[int]) -> Variant:
    """Return a change that disables all contacts of some geoms."""

    def change(model: mujoco.MjModel) -> None:
        model.geom_contype[list(geoms)] = model.geom_conaffinity[list(geoms)] = 0
        paired = np.isin(model.pair_geom1, geoms) | np.isin(model.pair_geom2, geoms)
        model.pair_margin[paired] = _NEVER_M

    return change


def mass_ratio(model: mujoco.MjModel, structure: Structure) -> float:
    """Return the mass of the heaviest moving body / the median mass of the moving bodies; 1 if nothing has mass."""
    masses = np.array(model.body_mass[list(structure.moving)])
    masses = masses[masses > 0]
    return float(masses.max() / np.median(masses)) if masses.size else 1.0


def without_outlier_mass(structure: Structure) -> Variant:
    """Return a change that gives bodies heavier than the median the median mass, and scales their inertia likewise."""

    def change(model: mujoco.MjModel) -> None:
        moving = list(structure.moving)
        masses = np.array(model.body_mass[moving])
        median = float(np.median(masses[masses > 0])) if (masses > 0).any() else 0.0
        for body, mass in zip(moving, masses, strict=True):
            if mass > median > 0:
                model.body_mass[body] = median
                model.body_inertia[body] *= median / mass
        mujoco.mj_setConst(model, mujoco.MjData(model))

    return change
