"""Pictures without a graphics driver, drawn with MuJoCo's own ray casting.

It takes about a second a picture and shows no textures, but it needs nothing beyond MuJoCo itself, so that a machine
without OpenGL still shows what was designed. `aidsr.render.pictures` chooses between this and OpenGL.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

_Array = NDArray[np.float64]
_SKY_TOP, _SKY_BOTTOM = np.array([0.80, 0.87, 0.95]), np.array([0.97, 0.98, 0.99])
_VISIBLE_GROUPS = np.array([1, 1, 1, 0, 0, 0], np.uint8)  # what MuJoCo's viewer shows when it opens
_SAMPLES = 2  # rays per pixel and axis, against jagged edges
_AMBIENT, _DIFFUSE, _IN_SHADOW = 0.45, 0.55, 0.35
_SHADOW_SLACK = 2e-3  # of the distance to the light; smaller values speckle


def draw(
    model: mujoco.MjModel, data: mujoco.MjData, camera: mujoco.MjvCamera, width: int, height: int
) -> NDArray[np.uint8]:
    """Return a picture of the model in its current state.

    Args:
        model: The compiled model.
        data: Its state, with kinematics computed (`mj_forward`).
        camera: From where to look.
        width: Columns [px].
        height: Rows [px].

    Returns:
        RGB values, shape `(height, width, 3)`.
    """
    scene = mujoco.MjvScene(model, maxgeom=10_000)
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
    layers = [(model, data, _geom_colours(model)), *_routing(scene)]
    eye, rays = _camera_rays(scene, width * _SAMPLES, height * _SAMPLES)
    distance, normal, colour = _nearest(layers, eye, rays)
    picture = _sky(width * _SAMPLES, height * _SAMPLES)
    hit = np.flatnonzero(np.isfinite(distance))
    if hit.size:
        points = eye + rays[hit] * distance[hit, None]
        brightness = _brightness(layers, eye, points, normal[hit])
        picture[hit] = colour[hit] * brightness[:, None]
    return _shrink(picture, width, height)


def _geom_colours(model: mujoco.MjModel) -> _Array:
    colours: _Array = model.geom_rgba[:, :3].astype(float)
    painted = model.geom_matid >= 0
    colours[painted] = model.mat_rgba[model.geom_matid[painted], :3]
    return colours


def _routing(scene: mujoco.MjvScene) -> list[tuple[mujoco.MjModel, mujoco.MjData, _Array]]:
    """Return tendons and sites as a model of their own: rays meet geoms only, and these are not geoms."""
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
    return [(model, data, np.array(colours, float))]


def _camera_rays(scene: mujoco.MjvScene, width: int, height: int) -> tuple[_Array, _Array]:
    view = mujoco.mjv_averageCamera(scene.camera[0], scene.camera[1])
    forward, up = np.array(view.forward, float), np.array(view.up, float)
    slope = view.frustum_top / view.frustum_near
    across = np.linspace(-slope, slope, width) * width / height
    down = np.linspace(slope, -slope, height)
    rays = forward + across[None, :, None] * np.cross(forward, up) + down[:, None, None] * up
    rays = rays.reshape(-1, 3)
    return np.array(view.pos, float), rays / np.linalg.norm(rays, axis=1, keepdims=True)


def _nearest(
    layers: list[tuple[mujoco.MjModel, mujoco.MjData, _Array]], origin: _Array, rays: _Array
) -> tuple[_Array, _Array, _Array]:
    """Return distance (inf where nothing is hit), surface normal and colour for each ray."""
    n = len(rays)
    nearest, normal, colour = np.full(n, np.inf), np.zeros((n, 3)), np.zeros((n, 3))
    for model, data, colours in layers:
        geom, distance, facing = np.full(n, -1, np.int32), np.zeros(n), np.zeros(3 * n)
        mujoco.mj_multiRay(
            model, data, origin, rays.ravel(), _VISIBLE_GROUPS, True, -1, geom, distance, facing, n, mujoco.mjMAXVAL
        )
        closer = (geom >= 0) & (distance < nearest)
        nearest[closer] = distance[closer]
        normal[closer] = facing.reshape(-1, 3)[closer]
        colour[closer] = colours[geom[closer]]
    return nearest, normal, colour


def _brightness(
    layers: list[tuple[mujoco.MjModel, mujoco.MjData, _Array]], eye: _Array, points: _Array, normal: _Array
) -> _Array:
    """Return the brightness in [0, 1] of surface points under one lamp above the camera."""
    lamp = eye + np.array([0.3, 0.4, 1.0]) * np.linalg.norm(np.median(points, axis=0) - eye)
    towards = points - lamp
    reach = np.linalg.norm(towards, axis=1)
    towards /= reach[:, None]
    first, _, _ = _nearest(layers, lamp, towards)
    lit = first > reach * (1 - _SHADOW_SLACK)
    lambert = np.clip(-np.sum(normal * towards, axis=1), 0, 1)
    brightness: _Array = _AMBIENT + _DIFFUSE * lambert * np.where(lit, 1.0, _IN_SHADOW)
    return brightness


def _sky(width: int, height: int) -> _Array:
    fade = np.linspace(0, 1, height).repeat(width)[:, None]
    sky: _Array = (1 - fade) * _SKY_TOP + fade * _SKY_BOTTOM
    return sky


def _shrink(picture: _Array, width: int, height: int) -> NDArray[np.uint8]:
    """Return the mean over the samples of each pixel."""
    mean = picture.reshape(height, _SAMPLES, width, _SAMPLES, 3).mean(axis=(1, 3))
    return np.asarray(np.clip(mean, 0, 1) * 255, np.uint8)
