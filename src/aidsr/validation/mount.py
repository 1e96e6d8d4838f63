"""Where a robot alone is tested: welded to the world, or free on a plane, under the environment's physics."""

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
    """A robot or scene as it is driven.

    Attributes:
        model: What is driven.
        spec: What it was compiled from, for pictures of it; its physics may be the environment's in `model` only.
        notes: What was changed to let it stand, one sentence each.
    """

    model: mujoco.MjModel
    spec: mujoco.MjSpec
    notes: tuple[str, ...]


def mount_model(loaded: Loaded, mount: Mount, environment: mujoco.MjModel | None) -> MountedModel:
    """Return the model to be driven.

    A scene is driven as it is. A robot alone keeps the ground it brings along; a free one without gets a plane at its
    lowest point.

    Args:
        loaded: The robot or scene.
        mount: "fixed" removes a free joint at the root, "free" adds one, "auto" keeps what is written.
        environment: Whose physics hold for the robot, or None.

    Raises:
        MjcfError: A robot without a single root, or whose root has joints of its own, cannot be set free.
    """
    model, spec = loaded.model, loaded.spec
    notes: list[str] = []
    if not read_ownership(model).is_scene:
        model, spec = _mounted(loaded, mount, notes)
        if environment is not None:
            _apply_physics(model, environment, free=_is_free(model))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    # a sleeping body would look like one without effect
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
        # keyframes hold one number per coordinate and would no longer fit
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
    """Give the robot the environment's physics; a smaller time step of its own is kept.

    A fixed robot also gets gravity as it feels it at the environment's mount: a limb that will hang is tested hanging.
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
    """Axes of the environment's first mount site as columns, (3, 3); the world's without one."""
    data = mujoco.MjData(environment)
    mujoco.mj_forward(environment, data)
    for site in range(environment.nsite):
        name = mujoco.mj_id2name(environment, mujoco.mjtObj.mjOBJ_SITE, site) or ""
        if name == _MOUNT or name.startswith(f"{_MOUNT}_"):
            return np.array(data.site_xmat[site]).reshape(3, 3)
    return np.eye(3)
