"""The shapes that a viewer draws: each once, with its colour and name, and its pose in each frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.ownership import read_ownership
from aidsr.sim.structure import name_of

Floats = NDArray[np.float32]

MAX_SHAPES = 20_000
"""Maximum number of shapes in one picture: as many geoms as `aidsr.mjcf.read` allows in a document."""

_GEOM, _SITE = int(mujoco.mjtObj.mjOBJ_GEOM), int(mujoco.mjtObj.mjOBJ_SITE)
_PLANE, _HFIELD = int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD)
_MESHES = (int(mujoco.mjtGeom.mjGEOM_MESH), int(mujoco.mjtGeom.mjGEOM_SDF))


@dataclass(frozen=True, eq=False)
class Parts:
    """The shapes of a model, in two groups: the poses of fixed shapes are sent once, those of moving ones every frame.

    Attributes:
        facts: One mapping for each shape, as the viewer gets it; moving shapes first.
        surfaces: Vertices and triangles that shapes refer to by index.
        geoms: Ids of the moving geoms, in the order of `facts`.
        sites: Ids of the moving sites, which follow the moving geoms in `facts`.
    """

    facts: tuple[dict[str, Any], ...]
    surfaces: tuple[dict[str, Any], ...]
    geoms: NDArray[np.intp]
    sites: NDArray[np.intp]

    def poses(self, data: mujoco.MjData) -> Floats:
        """Return position [m] and rotation matrix (by rows) of each moving shape, (n, 12)."""
        where = np.concatenate([data.geom_xpos[self.geoms], data.site_xpos[self.sites]])
        turned = np.concatenate([data.geom_xmat[self.geoms], data.site_xmat[self.sites]])
        return np.hstack([where, turned]).astype(np.float32)


def list_parts(looks: mujoco.MjModel, data: mujoco.MjData) -> Parts:
    """Return the shapes that MuJoCo itself would draw, without tendons.

    Args:
        looks: The model with the colours to display.
        data: Its initial state, with kinematics computed.
    """
    scene = mujoco.MjvScene(looks, maxgeom=MAX_SHAPES)
    everything = mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(looks, data, mujoco.MjvOption(), None, mujoco.MjvCamera(), everything, scene)
    shapes = [s for s in scene.geoms[: scene.ngeom] if int(s.objtype) in (_GEOM, _SITE) and s.rgba[3] > 0]
    shapes.sort(key=lambda s: (not _moves(looks, s), int(s.objtype) == _SITE, int(s.objid)))
    surfaces: list[dict[str, Any]] = []
    known: dict[tuple[bool, int], int] = {}
    robot = set(read_ownership(looks).bodies)
    facts = []
    for shape in shapes:
        surface = _surface_key(looks, shape)
        if surface is not None and surface not in known:
            known[surface] = len(surfaces)
            surfaces.append(_height_field(looks, surface[1]) if surface[0] else _mesh(looks, surface[1]))
        facts.append(_fact(looks, data, shape, robot) | ({} if surface is None else {"surface": known[surface]}))
    moving = [s for s in shapes if _moves(looks, s)]
    geoms, sites = ([int(s.objid) for s in moving if int(s.objtype) == kind] for kind in (_GEOM, _SITE))
    return Parts(tuple(facts), tuple(surfaces), np.array(geoms, np.intp), np.array(sites, np.intp))


def _body(model: mujoco.MjModel, shape: mujoco.MjvGeom) -> int:
    return int((model.geom_bodyid if int(shape.objtype) == _GEOM else model.site_bodyid)[shape.objid])


def _moves(model: mujoco.MjModel, shape: mujoco.MjvGeom) -> bool:
    body = _body(model, shape)
    return bool(model.body_weldid[body] != 0 or model.body_mocapid[model.body_rootid[body]] >= 0)


def _fact(model: mujoco.MjModel, data: mujoco.MjData, shape: mujoco.MjvGeom, robot: set[int]) -> dict[str, Any]:
    body, kind, index = _body(model, shape), mujoco.mjtObj(int(shape.objtype)), int(shape.objid)
    is_geom = int(kind) == _GEOM
    where, turned = (data.geom_xpos, data.geom_xmat) if is_geom else (data.site_xpos, data.site_xmat)
    # MuJoCo's scene moves an infinite plane with the camera; in the model, its size marks it as infinite
    size = model.geom_size[index] if is_geom and int(shape.type) == _PLANE else shape.size
    material = int(shape.matid)
    return {
        "kind": "geom" if is_geom else "site",
        "name": mujoco.mj_id2name(model, kind, index) or "",
        "body": name_of(model, mujoco.mjtObj.mjOBJ_BODY, body),
        "shape": mujoco.mjtGeom(int(shape.type)).name.removeprefix("mjGEOM_").lower(),
        "size": _rounded(size),
        "rgba": _rounded(shape.rgba),
        "shine": round(float(model.mat_specular[material]), 3) if material >= 0 else 0.3,
        "robot": body in robot,
        "moves": _moves(model, shape),
        "pose": _rounded(np.concatenate([where[index], turned[index]])),
    }


def _surface_key(model: mujoco.MjModel, shape: mujoco.MjvGeom) -> tuple[bool, int] | None:
    """Return whether a shape is a height field and the id of its data; None for a primitive shape."""
    if int(shape.objtype) != _GEOM or int(shape.type) not in (_HFIELD, *_MESHES):
        return None
    return int(shape.type) == _HFIELD, int(model.geom_dataid[shape.objid])


def _mesh(model: mujoco.MjModel, mesh: int) -> dict[str, Any]:
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    face, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    return {
        "vertices": _rounded(model.mesh_vert[first : first + count].ravel()),
        "triangles": model.mesh_face[face : face + faces].ravel().tolist(),
    }


def _height_field(model: mujoco.MjModel, field: int) -> dict[str, Any]:
    """Return the upper surface of a height field.

    Source: MuJoCo XML reference, asset/hfield: the heights are data between 0 and 1 times the third size; the first two
    sizes are half the sides; rows are along y.
    """
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    half_x, half_y, top, _ = model.hfield_size[field]
    first = int(model.hfield_adr[field])
    height = model.hfield_data[first : first + rows * columns].reshape(rows, columns) * top
    x, y = np.meshgrid(np.linspace(-half_x, half_x, columns), np.linspace(-half_y, half_y, rows))
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    right, up = corner + 1, corner + columns
    triangles = np.stack([corner, right, up, right, up + 1, up], axis=1)
    return {"vertices": _rounded(np.stack([x, y, height], axis=-1).ravel()), "triangles": triangles.ravel().tolist()}


def _rounded(numbers: NDArray[Any]) -> list[float]:
    return [round(float(number), 6) for number in numbers]
