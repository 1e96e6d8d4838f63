"""Preparation of a robot for its test alone: fixed to the world or free on a plane, with the environment's physics."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.core.errors import MjcfError
from aidsr.mjcf.compile import Loaded
from aidsr.sim.extent import bounding_box_m
from aidsr.sim.jacobian import choose_jacobian
from aidsr.sim.ownership import read_ownership
from aidsr.sim.placement import unused_name
from aidsr.sim.strip_scenery import delete_dangling_references
from aidsr.validation.rules.document import INVALID_JOINT_PLACEMENT
from aidsr.validation.rules.topology import DISCONNECTED
from aidsr.validation.validator import Mount

_FREE = mujoco.mjtJoint.mjJNT_FREE
_GROUNDS = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
_GROUND_NAME = "validation_ground"
_MOUNT = "mount"

_PHYSICS = (
    "integrator",
    "cone",
    "jacobian",
    "solver",
    "iterations",
    "ls_iterations",
    "noslip_iterations",
    "ccd_iterations",
    "impratio",
    "tolerance",
    "ls_tolerance",
    "noslip_tolerance",
    "ccd_tolerance",
    "density",
    "viscosity",
    "disableflags",
    "enableflags",
)


@dataclass(frozen=True, eq=False)
class MountedModel:
    """A robot or scene ready to be simulated.

    Attributes:
        model: The model to simulate.
        spec: The specification the model was compiled from, for pictures. The environment's physics are set in `model`
            only.
        notes: Changes that were made to mount the robot, one sentence each.
    """

    model: mujoco.MjModel
    spec: mujoco.MjSpec
    notes: tuple[str, ...]


def mount_model(loaded: Loaded, mount: Mount, environment: mujoco.MjModel | None) -> MountedModel:
    """Return the model to simulate.

    The bodies of a scene are not changed. A robot alone keeps the ground of its own document; a free robot without a
    ground gets a plane at its lowest point.

    Args:
        loaded: The robot or scene.
        mount: "fixed" removes a free joint at the root, "free" adds one, "auto" changes nothing.
        environment: Environment whose physics options a robot alone gets, or None.

    Raises:
        MjcfError: `mount` is "free", and the robot has several roots or a root with other joints.
    """
    model, spec = loaded.model, loaded.spec
    notes: list[str] = []
    if not read_ownership(model).is_scene:
        model, spec = _mounted(loaded, mount, notes)
        if environment is not None:
            _apply_physics(model, environment, free=_is_free(model))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    # a sleeping body would be mistaken for one that the actuators do not move
    model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    choose_jacobian(model)
    return MountedModel(model, spec, tuple(notes))


def _mounted(loaded: Loaded, mount: Mount, notes: list[str]) -> tuple[mujoco.MjModel, mujoco.MjSpec]:
    model, free = loaded.model, _is_free(loaded.model)
    wanted = free if mount == "auto" else mount == "free"
    grounded = any(int(model.geom_type[geom]) in _GROUNDS for geom in range(model.ngeom))
    if wanted == free and (grounded or not wanted):
        return model, loaded.spec
    spec = loaded.spec.copy()
    if wanted != free:
        # the number of coordinates changes, so the keyframes would no longer fit
        for key in list(spec.keys):
            spec.delete(key)
        (_set_free if wanted else _fix)(spec, notes)
    if wanted and not grounded:
        height_m = _lowest_m(spec.compile())
        name = unused_name(_GROUND_NAME, spec.geoms)
        spec.worldbody.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.05], pos=[0, 0, height_m])
        notes.append(f"stands on a plane at z = {height_m:.4g} m")
    return spec.compile(), spec


def _is_free(model: mujoco.MjModel) -> bool:
    return bool((np.asarray(model.jnt_type) == int(_FREE)).any())


def _fix(spec: mujoco.MjSpec, notes: list[str]) -> None:
    for joint in list(spec.joints):
        if joint.type == _FREE:
            notes.append(f"free joint of {joint.parent.name or 'the root'} removed: tested with a fixed root")
            spec.delete(joint)
    notes += delete_dangling_references(spec)


def _set_free(spec: mujoco.MjSpec, notes: list[str]) -> None:
    roots = spec.worldbody.bodies
    if len(roots) != 1:
        names = tuple(body.name for body in roots)
        found = f"a robot that moves freely needs one root body, found {len(roots)}"
        raise MjcfError([DISCONNECTED.fault(found, names=names)])
    (root,) = roots
    if root.joints:
        found = f"the root {root.name} has joints of its own and cannot be free"
        cure = "Give the robot a root body without joints."
        raise MjcfError([INVALID_JOINT_PLACEMENT.fault(found, names=(root.name,), cure=cure)])
    root.mocap = False
    root.add_freejoint()
    notes.append(f"free joint added to {root.name or 'the root'}: tested with a free root")


def _lowest_m(model: mujoco.MjModel) -> float:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return float(bounding_box_m(model, data, range(1, model.nbody))[0][2])


def _apply_physics(model: mujoco.MjModel, environment: mujoco.MjModel, *, free: bool) -> None:
    """Copy the environment's physics options to the robot's model; of the two time steps the smaller is used.

    For a fixed robot, gravity is rotated into the frame of the environment's mount, so that a limb that will hang is
    tested hanging.
    """
    for name in _PHYSICS:
        setattr(model.opt, name, getattr(environment.opt, name))
    for name in ("wind", "magnetic"):
        getattr(model.opt, name)[:] = getattr(environment.opt, name)
    model.opt.timestep = min(model.opt.timestep, environment.opt.timestep)
    gravity = np.array(environment.opt.gravity)
    if not free:
        gravity = _mount_axes(environment).T @ gravity
    model.opt.gravity[:] = gravity


def _mount_axes(environment: mujoco.MjModel) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Return the axes of the environment's first mount site as columns, (3, 3); the world axes if it has none."""
    data = mujoco.MjData(environment)
    mujoco.mj_forward(environment, data)
    for site in range(environment.nsite):
        name = mujoco.mj_id2name(environment, mujoco.mjtObj.mjOBJ_SITE, site) or ""
        if name == _MOUNT or name.startswith(f"{_MOUNT}_"):
            return np.array(data.site_xmat[site]).reshape(3, 3)
    return np.eye(3)
