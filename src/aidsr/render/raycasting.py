"""Pictures without a graphics card, rendered by MuJoCo's ray casting.

It needs nothing beyond MuJoCo itself, so that designs can be shown on a machine without OpenGL, and shows no textures
except those of floors. `aidsr.render.draw` chooses between this and OpenGL.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import mujoco
import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]
_SKY_TOP, _SKY_BOTTOM = np.array([0.80, 0.87, 0.95]), np.array([0.97, 0.98, 0.99])
_VISIBLE_GROUPS = np.array([1, 1, 1, 0, 0, 0], np.uint8)  # groups that MuJoCo's viewer shows by default
_MAX_GEOMS = 10_000
_WITHIN_PIXEL = np.array([0.25, 0.75])  # positions of rays within a pixel along each axis, at edges; else its middle
_EDGE = 0.08  # smallest colour difference of neighbouring pixels that is smoothed; our choice: less hardly looks jagged
_AMBIENT, _DIFFUSE, _IN_SHADOW = 0.45, 0.55, 0.35
_SHADOW_SLACK = 2e-3  # tolerance of shadow rays / distance to the light; smaller values cause speckles


class RayCanvas:
    """Ray-casting renderer of a model, with the same interface as `aidsr.render.opengl.Canvas`.

    Args:
        model: The compiled model.
        width: Columns [px].
        height: Rows [px].
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        self._model, self._width, self._height = copy.copy(model), width, height
        self._scene = mujoco.MjvScene(self._model, maxgeom=_MAX_GEOMS)
        self._geom_colours = _geom_colours(model)
        _remove_bounds(self._model)

    def draw(self, data: mujoco.MjData, camera: mujoco.MjvCamera) -> NDArray[np.uint8]:
        """Return a picture of the model as RGB values, shape `(height, width, 3)`.

        Args:
            data: State with kinematics computed.
            camera: Camera to look from.
        """
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, data, mujoco.MjvOption(), None, camera, everything, self._scene)
        layers = [_Layer(self._model, data, self._geom_colours), *_routing(self._scene)]
        eye = _Eye(self._scene, self._width / self._height)
        rows, columns = np.divmod(np.arange(self._width * self._height), self._width)
        seen = _Seen(layers, eye, (columns + 0.5) / self._width, (rows + 0.5) / self._height)
        lamp = seen.lamp()
        picture = seen.colours(lamp)
        edges = np.flatnonzero(_edges(picture.reshape(self._height, self._width, 3)))
        across, down = np.meshgrid(_WITHIN_PIXEL, _WITHIN_PIXEL)
        x = (columns[edges, None] + across.ravel()) / self._width
        y = (rows[edges, None] + down.ravel()) / self._height
        finer = _Seen(layers, eye, x.ravel(), y.ravel()).colours(lamp)
        picture[edges] = finer.reshape(*x.shape, 3).mean(axis=1)
        return np.asarray(np.clip(picture, 0, 1) * 255, np.uint8).reshape(self._height, self._width, 3)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        pass


class _Eye:
    """Position of a camera, and the rays through its picture."""

    def __init__(self, scene: mujoco.MjvScene, aspect: float) -> None:
        view = mujoco.mjv_averageCamera(scene.camera[0], scene.camera[1])
        slope = view.frustum_top / view.frustum_near
        self.position = np.array(view.pos, float)
        self._forward = np.array(view.forward, float)
        self._up = slope * np.array(view.up, float)
        self._right = aspect * np.cross(self._forward, self._up)

    def rays(self, x: _Array, y: _Array) -> _Array:
        """Return unit vectors (n, 3) through points of the picture: 0 is left and top, 1 is right and bottom."""
        across, down = (2 * x - 1)[:, None], (2 * y - 1)[:, None]
        rays: _Array = self._forward + across * self._right - down * self._up
        rays /= np.sqrt(np.einsum("ij,ij->i", rays, rays))[:, None]
        return rays


@dataclass(frozen=True, eq=False)
class _Layer:
    """A model whose geoms are rendered.

    Attributes:
        model: The model.
        data: Its state.
        colours: Colours of its geoms (ngeom, 3).
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    colours: _Array

    def cast(self, origin: _Array, rays: _Array) -> tuple[NDArray[np.int32], _Array, _Array]:
        """Return the geom that each ray hits first (-1 for none), its distance [m] and the surface normal there."""
        n = len(rays)
        geom, distance, normal = np.full(n, -1, np.int32), np.zeros(n), np.zeros(3 * n)
        mujoco.mj_multiRay(
            *(self.model, self.data, origin, rays.ravel(), _VISIBLE_GROUPS, True, -1),
            *(geom, distance, normal, n, mujoco.mjMAXVAL),
        )
        return geom, distance, normal.reshape(-1, 3)

    def colours_at(self, geom: NDArray[np.int32], points: _Array) -> _Array:
        """Return the colours (n, 3) of geoms at points on them."""
        colours = self.colours[geom]
        for floor in np.flatnonzero(self.model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE):
            on_it = np.flatnonzero(geom == floor)
            frame = self.data.geom_xmat[floor].reshape(3, 3)
            place = (points[on_it] - self.data.geom_xpos[floor]) @ frame[:, :2]
            colours[on_it] *= _texture_of_plane(self.model, int(floor), place)
        return colours


def _texture_of_plane(model: mujoco.MjModel, plane: int, place: _Array) -> _Array:
    """Return the texture colours of a plane at points on it, (n, 3) in [0, 1]; white without a texture.

    Args:
        model: The compiled model.
        plane: Number of the geom.
        place: Points in the frame of the plane (n, 2) [m].
    """
    material = model.geom_matid[plane]
    texture = model.mat_texid[material, int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] if material >= 0 else -1
    if texture < 0 or model.tex_type[texture] != mujoco.mjtTexture.mjTEXTURE_2D:
        return np.ones((len(place), 3))
    start, channels = model.tex_adr[texture], model.tex_nchannel[texture]
    shape = model.tex_height[texture], model.tex_width[texture], channels
    texels = model.tex_data[start : start + np.prod(shape)].reshape(shape)
    size = model.geom_size[plane, :2]
    endless = size == 0
    scale = np.where(model.mat_texuniform[material] | endless, 1.0, 0.5 / np.where(endless, 1.0, size))
    column, row = (place * scale * model.mat_texrepeat[material] % 1 * shape[1::-1]).astype(int).T
    rgb: _Array = texels[row, column, :3] / 255
    return rgb if channels >= 3 else rgb[:, :1].repeat(3, axis=1)


def _remove_bounds(model: mujoco.MjModel) -> None:
    """Make all bounding boxes infinite, so that rays can hit every geom.

    `mj_multiRay` (3.17) skips a body if a ray misses its bounds. It ignores the body's rotation when placing the
    bounds, and so misses the end of a post on a rotated body. The bounds also exclude geoms that do not collide.
    """
    for body in np.flatnonzero(model.body_bvhnum):
        model.bvh_aabb[model.body_bvhadr[body], 3:] = np.inf


class _Seen:
    """The first hits of rays from a camera.

    Args:
        layers: Models to render.
        eye: Camera position and rays.
        x: Horizontal positions in the picture, from 0 at the left to 1 at the right (n,).
        y: Vertical positions, from 0 at the top to 1 at the bottom (n,).
    """

    def __init__(self, layers: list[_Layer], eye: _Eye, x: _Array, y: _Array) -> None:
        self._layers, self._eye, self._y = layers, eye, y
        rays = eye.rays(x, y)
        self._distance, self._layer = np.full(len(x), np.inf), np.zeros(len(x), np.int8)
        self._geom, self._normal = np.full(len(x), -1, np.int32), np.zeros((len(x), 3))
        for number, layer in enumerate(layers):
            geom, distance, normal = layer.cast(eye.position, rays)
            closer = np.flatnonzero((geom >= 0) & (distance < self._distance))
            self._layer[closer], self._geom[closer] = number, geom[closer]
            self._distance[closer], self._normal[closer] = distance[closer], normal[closer]
        self._hit = np.flatnonzero(self._geom >= 0)
        self._points = eye.position + rays[self._hit] * self._distance[self._hit, None]

    def lamp(self) -> _Array:
        """Return the position of a lamp above the camera, scaled with the distance of the visible points (3,) [m]."""
        middle = np.median(self._points, axis=0) if len(self._points) else self._eye.position
        lamp: _Array = self._eye.position + np.array([0.3, 0.4, 1.0]) * np.linalg.norm(middle - self._eye.position)
        return lamp

    def colours(self, lamp: _Array) -> _Array:
        """Return the colours of the rays in the light of a lamp (n, 3)."""
        fade = self._y[:, None]
        seen: _Array = (1 - fade) * _SKY_TOP + fade * _SKY_BOTTOM
        if len(self._hit):
            own = np.empty((len(self._hit), 3))
            for number, layer in enumerate(self._layers):
                mine = np.flatnonzero(self._layer[self._hit] == number)
                own[mine] = layer.colours_at(self._geom[self._hit[mine]], self._points[mine])
            seen[self._hit] = own * self._brightness(lamp)[:, None]
        return seen

    def _brightness(self, lamp: _Array) -> _Array:
        """Return the brightness in [0, 1] of each hit point."""
        towards = self._points - lamp
        reach = np.sqrt(np.einsum("ij,ij->i", towards, towards))
        towards /= reach[:, None]
        geom, distance, _ = self._layers[0].cast(lamp, towards)  # tendons and sites are too thin for visible shadows
        lit = (geom < 0) | (distance > reach * (1 - _SHADOW_SLACK))
        lambert = np.clip(-np.einsum("ij,ij->i", self._normal[self._hit], towards), 0, 1)
        brightness: _Array = _AMBIENT + _DIFFUSE * lambert * np.where(lit, 1.0, _IN_SHADOW)
        return brightness


def _edges(picture: _Array) -> NDArray[np.bool_]:
    """Return which pixels differ from a neighbour by more than `_EDGE` (height, width)."""
    edges = np.zeros(picture.shape[:2], bool)
    across = (np.abs(picture[:, 1:] - picture[:, :-1]) > _EDGE).any(axis=2)
    down = (np.abs(picture[1:] - picture[:-1]) > _EDGE).any(axis=2)
    edges[:, 1:] |= across
    edges[:, :-1] |= across
    edges[1:] |= down
    edges[:-1] |= down
    return edges


def _geom_colours(model: mujoco.MjModel) -> _Array:
    colours: _Array = model.geom_rgba[:, :3].astype(float)
    painted = model.geom_matid >= 0
    colours[painted] = model.mat_rgba[model.geom_matid[painted], :3]
    return colours


def _routing(scene: mujoco.MjvScene) -> list[_Layer]:
    """Return tendons and sites as geoms of a separate model, because rays hit only geoms."""
    spec, colours = mujoco.MjSpec(), []
    for shape in scene.geoms[: scene.ngeom]:
        if shape.objtype not in (int(mujoco.mjtObj.mjOBJ_TENDON), int(mujoco.mjtObj.mjOBJ_SITE)) or shape.rgba[3] == 0:
            continue
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, shape.mat.astype(float).ravel())
        long = shape.type in (int(mujoco.mjtGeom.mjGEOM_CAPSULE), int(mujoco.mjtGeom.mjGEOM_CYLINDER))
        size = [shape.size[0], shape.size[2] if long else shape.size[1], shape.size[2]]
        spec.worldbody.add_geom(type=mujoco.mjtGeom(int(shape.type)), size=size, pos=shape.pos, quat=quat)
        colours.append(shape.rgba[:3])
    if not colours:
        return []
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return [_Layer(model, data, np.array(colours, float))]
