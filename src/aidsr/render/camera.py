"""Placement of cameras so that the whole robot and its surroundings are visible, with nothing in front of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import product

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.render.view import View
from aidsr.sim.ownership import read_ownership

Array = NDArray[np.float64]

_FOVY_DEG = 35.0  # our choice: MuJoCo's 45 degrees makes near parts look large
_MARGIN = 1.08
_SURROUNDINGS_RADII = 3.0  # the environment within this many radii of the robot should be in the picture
_MAX_WIDENING = 1.6  # largest factor by which surroundings enlarge the framed region
_AZIMUTHS_DEG = (125.0, 55.0, 90.0, 235.0, 305.0, 0.0, 180.0)  # in order of preference
_ELEVATIONS_DEG = (-18.0, -40.0, -65.0)
_SHADOW_RADII = 3.0  # shadows are sharp within this many radii of the centre
_PREFERENCE = 0.02  # additional share of visible geoms required to choose the next direction in the order
_RAYS = 12  # rays in a row and in a column with which the apparent size of an object is measured
_WELL_SEEN = 0.5  # sufficient apparent size / largest apparent size from any direction
_SIDE_ON = 0.5  # merit of seeing a motion fully from the side; our choice: above any rank, below a visible target
_SITE_SLACK = 0.02  # hits this close to a site / distance do not count: a site lies on the surface of its body
_ROOM_M = 0.1  # room beside objects shown without a robot; our choice: half the size of a built-in robot
_MAX_TESTED_GEOMS = 60  # largest number of geoms that are tested for visibility


def frame_robot(model: mujoco.MjModel, states: Iterable[mujoco.MjData], view: View) -> mujoco.MjvCamera:
    """Return a camera that shows the robot in all of the given states.

    Also adjusts the model's field of view and clipping planes.

    Args:
        model: The compiled model.
        states: One or more states with kinematics computed. The viewing direction is chosen for the first and the last
            one, and so that the motion between all of them is seen from the side.
        view: Viewing direction and other options; angles that are None are chosen.
    """
    if view.authored:
        camera = mujoco.MjvCamera()
        mujoco.mjv_defaultFreeCamera(model, camera)
        camera.distance /= view.closeness
        return camera
    empty = bool(view.shown) and not read_ownership(model).is_scene
    around = list(_solid(model)) if empty else _surrounding_geoms(model)
    moving = _robot_geoms(model)
    of_robot, of_others, positions, data, first = [], [], [], None, None
    for data in states:  # may be the same object each time
        robot = np.zeros((0, 3)) if empty else robot_corners(model, data)
        shown = [each.corners for each in _shown(model, data, view)]
        of_robot.append(np.concatenate([robot, *(_with_room(corners) if empty else corners for corners in shown)]))
        of_others.append(_corners(model, data, around))
        positions.append(data.geom_xpos[moving])
        first = first or copy(data)
    if data is None or first is None:
        raise ValueError("no state to show: give at least one")
    centre, radius = _region(np.concatenate(of_robot), np.concatenate(of_others))
    model.vis.map.shadowclip = min(model.vis.map.shadowclip, _SHADOW_RADII * radius / model.stat.extent)
    ends = [data] if len(positions) == 1 else [first, data]
    return aim(model, ends, centre, radius, view, np.array(positions))


def aim(
    model: mujoco.MjModel,
    states: Sequence[mujoco.MjData],
    centre: Array,
    radius: float,
    view: View,
    positions: Array | None = None,
) -> mujoco.MjvCamera:
    """Return a camera that shows a sphere in the world, from the direction in which most geoms in it are visible.

    Also adjusts the model's field of view and clipping planes.

    Args:
        model: The compiled model.
        states: The states for which the viewing direction is chosen.
        centre: Centre of the sphere (3,) [m].
        radius: Radius of the sphere [m].
        view: Viewing direction and other options; angles that are None are chosen.
        positions: Positions of the robot's geoms during a motion to see from the side (n_states, n_geoms, 3) [m].
    """
    model.vis.global_.fovy = _FOVY_DEG
    camera = mujoco.MjvCamera()
    camera.lookat[:] = centre
    camera.distance = _MARGIN * radius / np.sin(np.deg2rad(_FOVY_DEG / 2)) / view.closeness
    camera.azimuth, camera.elevation = _direction(model, states, camera, radius, view, positions)
    extent = model.stat.extent
    model.vis.map.znear = min(model.vis.map.znear, 0.1 * camera.distance / extent)
    model.vis.map.zfar = max(model.vis.map.zfar, 4 * camera.distance / extent)
    return camera


def robot_corners(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the corners of the bounding boxes of the robot's geoms in world coordinates, (n, 3) [m]."""
    return _corners(model, data, _robot_geoms(model))


def bounding_sphere(points: Array) -> tuple[Array, float]:
    """Return centre and radius [m] of a sphere around points, (n, 3)."""
    low, high = points.min(axis=0), points.max(axis=0)
    centre = (low + high) / 2
    return centre, max(float(np.linalg.norm(points - centre, axis=1).max()), 1e-3)


def _robot_geoms(model: mujoco.MjModel) -> list[int]:
    """Return the solid geoms of the robot.

    Where no body is marked as robot, return those of all moving bodies; where no body moves, all solid geoms.
    """
    owned = read_ownership(model)
    bodies = set(owned.bodies)
    if not owned.is_scene:
        bodies = {body for body in range(1, model.nbody) if model.body_weldid[body] != 0}
    geoms = [geom for geom in _solid(model) if int(model.geom_bodyid[geom]) in bodies]
    return geoms or list(_solid(model))


def _surrounding_geoms(model: mujoco.MjModel) -> list[int]:
    """Return the geoms of the environment that should be in the picture: moving ones, or all where none moves."""
    robot = set(_robot_geoms(model))
    others = [geom for geom in _solid(model) if geom not in robot]
    moving = [geom for geom in others if model.body_weldid[model.geom_bodyid[geom]] != 0]
    return moving or others


def _solid(model: mujoco.MjModel) -> Iterator[int]:
    """Yield the visible geoms of finite extent, which excludes planes and height fields."""
    endless = (int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD))
    for geom in range(model.ngeom):
        if int(model.geom_type[geom]) not in endless and int(model.geom_group[geom]) < 3:
            yield geom


def _corners(model: mujoco.MjModel, data: mujoco.MjData, geoms: list[int]) -> Array:
    """Return the corners of the geoms' bounding boxes in world coordinates, shape `(8 * len(geoms), 3)` [m]."""
    signs = np.array(list(product((-1, 1), repeat=3)), float)
    found = [np.zeros((0, 3))]
    for geom in geoms:
        centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
        found.append(data.geom_xpos[geom] + (centre + signs * half) @ data.geom_xmat[geom].reshape(3, 3).T)
    return np.concatenate(found)


def _with_room(corners: Array) -> Array:
    """Return points around objects that are shown without a robot, with room for a robot beside them."""
    return np.concatenate([corners - _ROOM_M, corners + _ROOM_M])


def _region(robot: Array, others: Array) -> tuple[Array, float]:
    """Return centre and radius [m] of the region to show."""
    if not len(robot):
        return np.zeros(3), 0.5
    centre, radius = bounding_sphere(robot)
    near = others[np.linalg.norm(others - centre, axis=1) < _SURROUNDINGS_RADII * radius]
    wide_centre, wide_radius = bounding_sphere(np.concatenate([robot, near]))
    if wide_radius <= _MAX_WIDENING * radius:
        return wide_centre, wide_radius
    return (centre + wide_centre) / 2, _MAX_WIDENING * radius


def _direction(
    model: mujoco.MjModel,
    states: Sequence[mujoco.MjData],
    camera: mujoco.MjvCamera,
    radius: float,
    view: View,
    positions: Array | None,
) -> tuple[float, float]:
    """Return azimuth and elevation [deg] of the best visibility; of equal directions, the first in the order."""
    azimuths = _AZIMUTHS_DEG if view.azimuth_deg is None else (view.azimuth_deg,)
    elevations = _ELEVATIONS_DEG if view.elevation_deg is None else (view.elevation_deg,)
    directions = [(azimuth, elevation) for elevation in elevations for azimuth in azimuths]
    if len(directions) == 1:
        return directions[0]
    robot, others = _robot_geoms(model), _surrounding_geoms(model)
    eyes = [_camera_position(camera, *direction) for direction in directions]
    merits = -_PREFERENCE * np.arange(len(eyes))
    for data in states:
        near = [geom for geom in others if np.linalg.norm(data.geom_xpos[geom] - camera.lookat) < radius]
        merits += np.array([_visible_share(model, data, eye, robot, near) for eye in eyes]) / len(states)
        for each in _shown(model, data, view):
            seen = np.array([each.in_sight(model, data, eye) for eye in eyes])
            if seen.max() > 0.0:
                merits += np.minimum(seen / seen.max() / _WELL_SEEN, 1.0) / len(states)
    if positions is not None:
        merits += _SIDE_ON * _across(positions, camera.lookat - np.array(eyes))
    return directions[int(np.argmax(merits))]


def _across(positions: Array, ways: Array) -> Array:
    """Return the share of a motion that is across each viewing direction, (n,), 0 to 1; 0 where nothing moves.

    Args:
        positions: Positions of points during the motion (n_states, n_points, 3) [m].
        ways: Viewing directions (n, 3), of any length.
    """
    away = (positions - positions.mean(axis=0)).reshape(-1, 3)
    spread = away.T @ away
    if np.trace(spread) <= 0.0:
        return np.zeros(len(ways))
    forward = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    share: Array = 1.0 - np.einsum("ni,ij,nj->n", forward, spread, forward) / np.trace(spread)
    return share


@dataclass(frozen=True, eq=False)
class _Shown:
    """A body with its descendants, or a site, that must be visible."""

    corners: Array
    """Corners of its bounding boxes, or the position of the site, (n, 3) [m]."""
    geoms: frozenset[int]
    """Numbers of its geoms; empty for a site."""

    def in_sight(self, model: mujoco.MjModel, data: mujoco.MjData, eye: Array) -> float:
        """Return its apparent size from a position: the share of rays into its bounding sphere that hit it first.

        For a site, return 1 if it is not hidden, else 0.
        """
        centre, radius = bounding_sphere(self.corners)
        hit, way = np.zeros(1, np.int32), centre - eye
        far = float(np.linalg.norm(way))
        if not self.geoms:
            met = mujoco.mj_ray(model, data, eye, way / far, None, True, -1, hit, None)
            return float(met < 0.0 or met > far - _SITE_SLACK * far)
        aside = np.linalg.svd(way[None] / far)[2][1:]
        grid = np.linspace(-1.0, 1.0, _RAYS)
        rays = np.array([way + radius * (x * aside[0] + y * aside[1]) for x, y in product(grid, grid)])
        hits, distances = np.full(len(rays), -1, np.int32), np.zeros(len(rays))
        mujoco.mj_multiRay(
            model, data, eye, rays.ravel(), None, True, -1, hits, distances, None, len(rays), mujoco.mjMAXVAL
        )
        return float(np.isin(hits, list(self.geoms)).mean())


def _shown(model: mujoco.MjModel, data: mujoco.MjData, view: View) -> list[_Shown]:
    """Return the bodies and sites that a view must show; names of anything else are ignored."""
    found = []
    for name in view.shown:
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
        site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
        carried = {body} if body > 0 else set[int]()
        for other in range(body + 1, model.nbody if carried else 0):
            carried |= {other} if int(model.body_parentid[other]) in carried else set()
        geoms = [geom for geom in _solid(model) if int(model.geom_bodyid[geom]) in carried]
        if geoms:
            found.append(_Shown(_corners(model, data, geoms), frozenset(geoms)))
        elif site >= 0:
            found.append(_Shown(data.site_xpos[site][None].copy(), frozenset()))
    return found


def _camera_position(camera: mujoco.MjvCamera, azimuth_deg: float, elevation_deg: float) -> Array:
    azimuth, elevation = np.deg2rad([azimuth_deg, elevation_deg])
    level = np.cos(elevation)
    forward = np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
    eye: Array = camera.lookat - camera.distance * forward
    return eye


def _visible_share(model: mujoco.MjModel, data: mujoco.MjData, eye: Array, robot: list[int], near: list[int]) -> float:
    """Return the share of geoms that are visible.

    A geom of the robot may be hidden only by the robot itself, a geom near it also by other geoms near it.
    """
    hit = np.zeros(1, np.int32)
    geoms = [*robot, *near]
    looked_at = geoms[:: 1 + len(geoms) // _MAX_TESTED_GEOMS]
    of_robot, of_both = set(robot), set(geoms)
    seen = 0
    for geom in looked_at:
        mujoco.mj_ray(model, data, eye, data.geom_xpos[geom] - eye, None, True, -1, hit, None)
        seen += int(hit[0]) in (of_robot if geom in of_robot else of_both)
    return seen / max(len(looked_at), 1)
