"""The functional part of a robot, such as a fingertip, and its working point."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.mjcf.names import ROBOT_PREFIX

FUNCTIONAL_SITE = f"{ROBOT_PREFIX}functional_part"
"""Name of the site that marks the working point of the robot in a scene."""

Vector = NDArray[np.float64]

_GEOM = mujoco.mjtGeom
_ROUND = tuple(
    int(kind) for kind in (_GEOM.mjGEOM_SPHERE, _GEOM.mjGEOM_CAPSULE, _GEOM.mjGEOM_ELLIPSOID, _GEOM.mjGEOM_CYLINDER)
)
_CENTRED_M = 1e-6
"""Distance of a geom's centre from the joint below which the centre gives no distal direction. Our choice: smaller than
any real part."""


@dataclass(frozen=True)
class FunctionalPart:
    """Pose of the working point in the frame of its body.

    Attributes:
        body: Name of the body.
        position_m: Working point, (3,) [m].
        quaternion: Orientation, (4,), w first.
    """

    body: str
    position_m: Vector
    quaternion: Vector


def part_names(model: mujoco.MjModel) -> tuple[str, ...]:
    """Return the names that can serve as functional part: bodies, then sites, then geoms."""
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    sites = [model.site(i).name for i in range(model.nsite)]
    geoms = [model.geom(i).name for i in range(model.ngeom)]
    return tuple(dict.fromkeys(name for name in (*bodies, *sites, *geoms) if name))


def find_functional_part(model: mujoco.MjModel, name: str) -> FunctionalPart | None:
    """Return the working point of a named part of a robot, or None if there is no such part.

    The working point of a site is the site itself. That of a body is its distal tip, the point of its geoms farthest
    from the body's joint, because a task measures the distance to the robot's tip, not to its last joint. That of a
    geom is the distal tip of the geom.

    Args:
        model: Compiled model of the robot alone.
        name: Name of a body, site or geom, looked up in this order.
    """
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
    geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
    upright = np.array([1.0, 0.0, 0.0, 0.0])
    if body > 0:
        first = int(model.body_geomadr[body])
        return FunctionalPart(name, _tip_m(model, body, range(first, first + int(model.body_geomnum[body]))), upright)
    if site >= 0:
        owner = model.body(model.site_bodyid[site]).name
        return FunctionalPart(owner, model.site_pos[site].copy(), model.site_quat[site].copy())
    if geom >= 0:
        owner = int(model.geom_bodyid[geom])
        return FunctionalPart(model.body(owner).name, _tip_m(model, owner, range(geom, geom + 1)), upright)
    return None


def _tip_m(model: mujoco.MjModel, body: int, geoms: range) -> Vector:
    """Return the far end of some geoms of a body that is farthest from its joint, in the body's frame [m]."""
    joint = int(model.body_jntadr[body])
    pivot = model.jnt_pos[joint] if joint >= 0 else np.zeros(3)
    tips = [_far_end_m(model, geom, pivot) for geom in geoms]
    return max(tips, key=lambda tip: float(np.linalg.norm(tip - pivot)), default=np.zeros(3))


def _far_end_m(model: mujoco.MjModel, geom: int, pivot: Vector) -> Vector:
    """Return the point where the line from the pivot through a geom's centre leaves the geom, in the body's frame [m].

    The line follows the geom's longest axis if the centre coincides with the pivot.
    """
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.geom_quat[geom])
    rotation = axes.reshape(3, 3)
    box_centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    centre = model.geom_pos[geom] + rotation @ box_centre
    out = centre - pivot
    if np.linalg.norm(out) < _CENTRED_M:
        out = rotation[:, int(np.argmax(half))]
    out = out / np.linalg.norm(out)
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    if kind not in _ROUND:
        kind, size = int(_GEOM.mjGEOM_BOX), half  # boxes, and the bounding box of meshes and other geoms
    outside = centre + 2 * model.geom_rbound[geom] * out
    distance = mujoco.mju_rayGeom(centre, axes, size, outside, -out, kind, None)
    return np.asarray(outside - distance * out)
