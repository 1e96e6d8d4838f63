"""Summary of an environment: its bodies, sites, mounts and actuators at the start of an episode."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from aidsr.core.artifacts import BodySummary, EnvironmentSummary, GeomSummary, MountSummary, SiteSummary
from aidsr.core.formatting import rounded_vector
from aidsr.mjcf.compile import load_mjcf
from aidsr.sandbox.isolated import isolated
from aidsr.sim.actuator_force import control_of
from aidsr.sim.command import command_of
from aidsr.sim.placement import check_environment, mount_names

_JOINT, _GEOM = mujoco.mjtJoint, mujoco.mjtGeom
_SIZES = {
    int(_GEOM.mjGEOM_PLANE): 2,
    int(_GEOM.mjGEOM_SPHERE): 1,
    int(_GEOM.mjGEOM_CAPSULE): 2,
    int(_GEOM.mjGEOM_CYLINDER): 2,
}
"""Number of meaningful size parameters of the shapes that use fewer than three. The third one of a plane is only the
spacing of its rendered grid."""
_DECIMALS = 6
"""Decimals of the reported numbers. Our choice: micrometres and millionths suffice; MuJoCo also writes six digits."""


@isolated
def summarize_environment(environment: str, *, may_hold_robot: bool = False) -> EnvironmentSummary:
    """Describe an environment in its initial state, read in an isolated process.

    Args:
        environment: MJCF of the environment.
        may_hold_robot: Whether the MJCF may be a scene with a robot; if false, an environment in which no robot can be
            placed is refused.

    Raises:
        MjcfError: The environment cannot be loaded, or no robot can be placed in it.
        IsolationError: Reading it exceeded its limits of time or memory.
    """
    loaded = load_mjcf(environment)
    if not may_hold_robot:
        check_environment(loaded)
    model = loaded.model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bodies = [body for body in range(model.nbody) if body or model.body_geomnum[0]]
    return EnvironmentSummary(
        gravity_m_s2=rounded_vector(model.opt.gravity),
        timestep_s=model.opt.timestep,
        mounts=tuple(_mount(model, data, name) for name in mount_names(model)),
        bodies=tuple(_body(model, data, body) for body in bodies),
        sites=tuple(_site(model, data, site) for site in range(model.nsite)),
        sensors=tuple(model.sensor(i).name for i in range(model.nsensor)),
        actuators=tuple(command_in_words(model, actuator) for actuator in range(model.nactuator)),
    )


def _mount(model: mujoco.MjModel, data: mujoco.MjData, name: str) -> MountSummary:
    site = model.site(name).id
    axes = data.site_xmat[site].reshape(3, 3)
    movers: list[str] = []
    body = int(model.site_bodyid[site])
    while body:
        first = int(model.body_jntadr[body])
        movers = [model.joint(first + i).name for i in range(model.body_jntnum[body])] + movers
        body = int(model.body_parentid[body])
    return MountSummary(
        name=name,
        position_m=rounded_vector(data.site_xpos[site]),
        z_axis=rounded_vector(axes[:, 2]),
        x_axis=rounded_vector(axes[:, 0]),
        moved_by=tuple(movers),
    )


def _body(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> BodySummary:
    joints = range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
    geoms = range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body])
    return BodySummary(
        name=model.body(body).name,
        parent=model.body(model.body_parentid[body]).name if body else "",
        position_m=rounded_vector(data.xpos[body]),
        mass_kg=round(float(model.body_mass[body]), _DECIMALS),
        joints=tuple(_joint(model, data, joint) for joint in joints),
        free=any(model.jnt_type[joint] == _JOINT.mjJNT_FREE for joint in joints),
        movable=_movable(model, data, body),
        geoms=tuple(_geom(model, data, geom) for geom in geoms),
    )


def _movable(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> bool:
    """Return whether a joint moves the centre of mass of a body by more than 1 um per radian or metre."""
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jacBodyCom(model, data, jacobian, None, body)
    return bool((np.abs(jacobian) > 10.0**-_DECIMALS).any())


def _joint(model: mujoco.MjModel, data: mujoco.MjData, joint: int) -> str:
    kind = _JOINT(int(model.jnt_type[joint]))
    words = f"{model.joint(joint).name or 'joint'}: {kind.name.removeprefix('mjJNT_').lower()}"
    turns = kind in (_JOINT.mjJNT_HINGE, _JOINT.mjJNT_BALL)
    if kind in (_JOINT.mjJNT_HINGE, _JOINT.mjJNT_SLIDE):
        axis = " ".join(f"{value:g}" for value in rounded_vector(data.xaxis[joint]))
        words += f" {'about' if turns else 'along'} {axis}"
    if model.jnt_limited[joint]:
        low, high = np.rad2deg(model.jnt_range[joint]) if turns else model.jnt_range[joint]
        words += f", {low:g} to {high:g} {'deg' if turns else 'm'}"
    if kind in (_JOINT.mjJNT_HINGE, _JOINT.mjJNT_SLIDE):
        words += _resistance(model, joint, "N m" if turns else "N", "rad" if turns else "m")
    return words


def command_in_words(model: mujoco.MjModel, actuator: int) -> str:
    """Return a description of an actuator's command: position, speed or force, its unit and its range.

    Only the actuator's name is returned if the meaning is not known or the actuator does not act on a joint.
    """
    name = model.actuator(actuator).name or "actuator"
    command = command_of(model, actuator)
    if command is None or model.actuator_trntype[actuator] != mujoco.mjtTrn.mjTRN_JOINT:
        return name
    unit, factor = command.unit, command.factor
    if unit.startswith("rad"):
        unit, factor = unit.replace("rad", "deg"), np.rad2deg(factor)
    what = {"position": "position of", "speed": "speed of", "force": "torque on" if unit == "N m" else "force on"}
    joint = model.joint(int(model.actuator_trnid[actuator, 0])).name or "a joint"
    words = f"{name}: commands the {what[command.kind]} {joint}"
    control = control_of(model, actuator)
    if model.actuator_ctrllimited[control]:
        words += f", {_range(model.actuator_ctrlrange[control] * factor, unit)}"
    if model.actuator_dyntype[actuator] == mujoco.mjtDyn.mjDYN_INTEGRATOR and model.actuator_actlimited[actuator]:
        ends = _range(model.actuator_actrange[actuator] * factor, unit.removesuffix("/s"))
        words += f", until it is at an end of {ends}"
    return words


def _range(ends: Any, unit: str) -> str:
    low, high = (round(float(end), _DECIMALS) for end in sorted(ends))  # a negative gear swaps the ends
    return f"{low:g} to {high:g} {unit}"


def _resistance(model: mujoco.MjModel, joint: int, force: str, way: str) -> str:
    """Return a description of a hinge's or slide's resistance: spring stiffness, spring rest position and friction."""
    stiffness, friction = model.jnt_stiffness[joint], model.dof_frictionloss[model.jnt_dofadr[joint]]
    slack = model.qpos_spring[model.jnt_qposadr[joint]]
    words = f", spring {stiffness:g} {force}/{way}" + (f" from {slack:g} {way}" if slack else "") if stiffness else ""
    return words + (f", friction {friction:g} {force}" if friction else "")


def _geom(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> GeomSummary:
    kind = int(model.geom_type[geom])
    size = model.geom_size[geom, : _SIZES.get(kind, 3)]
    axes = data.geom_xmat[geom].reshape(3, 3)
    return GeomSummary(
        name=model.geom(geom).name,
        shape=_GEOM(kind).name.removeprefix("mjGEOM_").lower(),
        size_m=tuple(round(float(value), _DECIMALS) for value in size),
        position_m=rounded_vector(data.geom_xpos[geom]),
        z_axis=rounded_vector(axes[:, 2]),
        x_axis=rounded_vector(axes[:, 0]),
        solid=bool(model.geom_contype[geom] or model.geom_conaffinity[geom]),
        friction=rounded_vector(model.geom_friction[geom]),
        priority=int(model.geom_priority[geom]),
    )


def _site(model: mujoco.MjModel, data: mujoco.MjData, site: int) -> SiteSummary:
    return SiteSummary(
        name=model.site(site).name,
        body=model.body(model.site_bodyid[site]).name,
        position_m=rounded_vector(data.site_xpos[site]),
    )
