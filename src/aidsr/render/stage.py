"""Preparation of a model for display: light, sky, a floor with a scale, and colours where the author gave none."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from aidsr.sim.ownership import read_ownership
from aidsr.sim.placement import unused_name

FLOOR_SQUARE_M = 0.1
"""Side length of the squares on a floor, which show the scale of a picture."""

_PLAIN = (0.5, 0.5, 0.5, 1.0)
"""MuJoCo's default colour. Source: MuJoCo XML reference, body/geom/rgba."""
_BASE, _TIP = np.array([0.14, 0.31, 0.55]), np.array([0.38, 0.72, 0.80])
_SURROUNDINGS = np.array([0.80, 0.77, 0.71])
_TENDON = np.array([0.86, 0.33, 0.10])
_PLAIN_TENDON_WIDTH_M = 0.003
_TENDON_WIDTH = 0.003  # width / extent of the model, for tendons of default width; at most the default width
_MOUNT_RGBA, _MOUNT_M = (0.15, 0.65, 0.25, 1.0), 0.012
_SKY = "aidsr_sky"
_FLOOR = "aidsr_floor"


def compile_for_display(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a specification for display; it is changed in place, but not its physics."""
    _give_sky_and_floor(spec)
    _give_light(spec)
    model = spec.compile()
    _give_colours(model)
    return model


def _give_sky_and_floor(spec: mujoco.MjSpec) -> None:
    skybox = mujoco.mjtTexture.mjTEXTURE_SKYBOX
    if not any(int(texture.type) == int(skybox) for texture in spec.textures):
        gradient = mujoco.mjtBuiltin.mjBUILTIN_GRADIENT
        top, bottom = [0.70, 0.80, 0.90], [1.0, 1.0, 1.0]
        sky = unused_name(_SKY, spec.textures)
        spec.add_texture(name=sky, type=skybox, builtin=gradient, rgb1=top, rgb2=bottom, width=256, height=1536)
    plane = int(mujoco.mjtGeom.mjGEOM_PLANE)
    floors = [geom for geom in spec.geoms if int(geom.type) == plane and not geom.material and _is_plain(geom.rgba)]
    if not floors:
        return
    checker = mujoco.mjtBuiltin.mjBUILTIN_CHECKER
    light, dark = [0.93, 0.93, 0.92], [0.87, 0.88, 0.88]
    flat = mujoco.mjtTexture.mjTEXTURE_2D
    floor = unused_name(_FLOOR, [*spec.textures, *spec.materials])
    spec.add_texture(name=floor, type=flat, builtin=checker, rgb1=light, rgb2=dark, width=256, height=256)
    material = spec.add_material(name=floor, texuniform=True, texrepeat=[1 / (2 * FLOOR_SQUARE_M)] * 2, reflectance=0.0)
    material.textures[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = floor
    for geom in floors:
        geom.material, geom.rgba = floor, [1, 1, 1, 1]


def _give_light(spec: mujoco.MjSpec) -> None:
    headlight = spec.visual.headlight
    headlight.ambient, headlight.diffuse, headlight.specular = [0.38] * 3, [0.42] * 3, [0.05] * 3
    spec.visual.quality.shadowsize, spec.visual.quality.offsamples = 4096, 8
    if not spec.lights:
        directional = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        lamp = spec.worldbody.add_light(type=directional, pos=[0, 0, 3], dir=[-0.35, 0.45, -1.0], castshadow=True)
        lamp.diffuse, lamp.specular = [0.42] * 3, [0.15] * 3


def _give_colours(model: mujoco.MjModel) -> None:
    owned = read_ownership(model)
    moving = {body for body in owned.bodies if owned.is_scene or model.body_weldid[body] != 0}
    depth = np.zeros(model.nbody)
    for body in sorted(moving):
        depth[body] = depth[model.body_parentid[body]] + 1
    for geom in range(model.ngeom):
        if model.geom_matid[geom] < 0 and _is_plain(model.geom_rgba[geom]):
            body = int(model.geom_bodyid[geom])
            share = depth[body] / max(depth.max(), 1)
            model.geom_rgba[geom, :3] = _BASE + share * (_TIP - _BASE) if body in moving else _SURROUNDINGS
    for tendon in range(model.ntendon):
        if model.tendon_matid[tendon] < 0 and _is_plain(model.tendon_rgba[tendon]):
            model.tendon_rgba[tendon, :3] = _TENDON
        if np.isclose(model.tendon_width[tendon], _PLAIN_TENDON_WIDTH_M):
            model.tendon_width[tendon] = min(_PLAIN_TENDON_WIDTH_M, _TENDON_WIDTH * model.stat.extent)
    # Dozens of routing points hide the shape; the tendon through them shows where they are.
    model.site_rgba[model.wrap_objid[model.wrap_type == int(mujoco.mjtWrap.mjWRAP_SITE)], 3] = 0
    for site in range(model.nsite):
        if (mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_SITE, site) or "").startswith("mount"):
            model.site_rgba[site, 3] = 0


def _is_plain(rgba: np.ndarray) -> bool:
    return bool(np.allclose(rgba, _PLAIN))


def mark_mounts(model: mujoco.MjModel, shown: Sequence[str]) -> None:
    """Show the mounts among `shown` as green spheres in a model without a robot on a mount."""
    if read_ownership(model).is_scene:
        return
    for site in range(model.nsite):
        if model.site(site).name.startswith("mount") and model.site(site).name in shown:
            model.site_rgba[site] = _MOUNT_RGBA
            model.site_type[site] = mujoco.mjtGeom.mjGEOM_SPHERE
            model.site_size[site] = _MOUNT_M
