"""Limbs of a robot: series of joints that cables bend, and the rigid parts on them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.extent import UNBOUNDED, box_corners_m
from aidsr.sim.structure import SAME_POINT, Structure

Vector = NDArray[np.float64]

SERIES_JOINTS = 3
"""Smallest number of joints in series that a continuum limb bends; a limb with two joints is a linkage. Our choice."""

EVEN_JOINTS = 2.0
"""Smallest effective number of bent joints, (sum b)^2 / sum b^2 with the bends b, of a limb that shares its bending
among its joints. Our choice: the number is 1 to 1.6 for a rod on one soft hinge, and 3 for three equal joints."""
_LONG_LINK = 2.0
"""Link length / median link length above which the remainder of a link counts as rigid. Our choice."""

_HINGE, _BALL, _FREE = (int(getattr(mujoco.mjtJoint, f"mjJNT_{kind}")) for kind in ("HINGE", "BALL", "FREE"))


@dataclass(frozen=True)
class Limbs:
    """Series of joints that cables bend.

    Attributes:
        series: Largest number of joints in series that share the bending.
        bent: Bodies in series of three or more such joints.
        length_m: Total length of these series [m].
        before: Number of bent joints in series up to each of the bodies, its own included.
        through_m: Length of the longest series through each of the bodies [m].
    """

    series: int
    bent: tuple[int, ...]
    length_m: float
    before: dict[int, int]
    through_m: dict[int, float]


def read_limbs(model: mujoco.MjModel, data: mujoco.MjData, structure: Structure, bends_rad: Vector) -> Limbs:
    """Return the series of joints that bend between the root and the leaves; a series may pass through branches.

    Args:
        model: Compiled model.
        data: Data of the model in the reference pose.
        structure: The robot in the model.
        bends_rad: Angle by which cables bend each degree of freedom, 0 if it is too small to count, (nv,).
    """
    parents = model.body_parentid
    bend_rad = {body: max((bends_rad[dof] for dof in _turns(model, body)), default=0.0) for body in structure.moving}
    bending = [body for body in structure.moving if bend_rad[body] > 0]
    anchors = {body: np.array(data.xanchor[int(model.body_jntadr[body])]) for body in bending}
    before: dict[int, int] = {}
    for body in bending:
        parent = int(parents[body])
        while parent and parent not in anchors:
            parent = int(parents[parent])
        before[body] = parent
    distances_m = {
        body: float(np.linalg.norm(anchors[body] - anchors[parent])) if parent else 0.0
        for body, parent in before.items()
    }
    new = {
        body: not before[body] or distances_m[body] >= SAME_POINT * structure.characteristic_length_m
        for body in bending
    }
    series, kept = 0, set[int]()
    for leaf in set(bending) - set(before.values()):
        line = [leaf]
        while before[line[-1]]:
            line.append(before[line[-1]])
        bends = np.array([bend_rad[body] for body in line if new[body]])
        shared = len(bends) if bends.sum() ** 2 >= EVEN_JOINTS * (bends**2).sum() else 1
        series = max(series, shared)
        if shared >= SERIES_JOINTS:
            kept.update(line)
    links_m = [distances_m[body] for body in kept if before[body] and new[body]]
    median_m = float(np.median(links_m)) if links_m else 0.0
    ends = len(kept - {before[body] for body in kept}) if links_m else 0
    steps_m = {body: min(distances_m[body], _LONG_LINK * median_m) if before[body] else 0.0 for body in kept}
    count, up_m, down_m = {0: 0}, {0: 0.0}, dict.fromkeys(kept, median_m)
    for body in sorted(kept):
        count[body], up_m[body] = count[before[body]] + new[body], up_m[before[body]] + steps_m[body]
    for body in sorted(kept, reverse=True):
        if before[body]:
            down_m[before[body]] = max(down_m[before[body]], down_m[body] + steps_m[body])
    return Limbs(
        series=series,
        bent=tuple(sorted(kept)),
        length_m=sum(min(link_m, _LONG_LINK * median_m) for link_m in links_m) + ends * median_m,
        before={body: count[body] for body in kept},
        through_m={body: up_m[body] + down_m[body] for body in kept},
    )


def longest_lever(
    model: mujoco.MjModel, data: mujoco.MjData, limbs: Limbs, parts: dict[int, tuple[int, ...]]
) -> tuple[tuple[int, ...], float, float]:
    """Return the rigid part on fewer than three bent joints that reaches farthest from its joint, relative to its limb.

    A part on a joint that no cable bends is compared with the longest limb.

    Returns:
        The bodies of the part, the distance, and the length of the limb [m]; nothing and zeros if there is none.
    """
    longest: tuple[tuple[int, ...], float, float] = ((), 0.0, 0.0)
    for root, bodies in parts.items():
        carrier = root
        while carrier and carrier not in limbs.before:
            carrier = int(model.body_parentid[carrier])
        if not limbs.before or limbs.before.get(carrier, 0) >= SERIES_JOINTS:
            continue
        whole_m = limbs.through_m.get(root, max(limbs.through_m.values()))
        reach_m = _reach_m(model, data, root, cloud_m(model, data, bodies))
        if reach_m / whole_m > (longest[1] / longest[2] if longest[0] else 0.0):
            longest = bodies, reach_m, whole_m
    return longest


def _reach_m(model: mujoco.MjModel, data: mujoco.MjData, body: int, cloud: Vector) -> float:
    """Return the largest distance of points, (n, 3), from the axis of a hinge or the anchor of a ball or slide [m].

    0 for a body without these joints.
    """
    first, reach_m = int(model.body_jntadr[body]), 0.0
    for joint in range(first, first + int(model.body_jntnum[body])) if len(cloud) else ():
        away = cloud - data.xanchor[joint]
        if int(model.jnt_type[joint]) == _HINGE:
            away = np.cross(away, data.xaxis[joint])
        if int(model.jnt_type[joint]) != _FREE:
            reach_m = max(reach_m, float(np.linalg.norm(away, axis=1).max()))
    return reach_m


def cloud_m(model: mujoco.MjModel, data: mujoco.MjData, bodies: Iterable[int]) -> Vector:
    """Return the corners of the bounding boxes of some bodies' colliding geoms, (n, 3) [m]."""
    points = []
    for body in bodies:
        for geom in range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body]):
            solid = model.geom_contype[geom] or model.geom_conaffinity[geom]
            if solid and int(model.geom_type[geom]) not in UNBOUNDED:
                points.append(box_corners_m(model, data, geom))
    return np.concatenate(points) if points else np.zeros((0, 3))


def dofs_of(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the degrees of freedom of a body's own joints."""
    first = int(model.body_dofadr[body])
    return list(range(first, first + int(model.body_dofnum[body]))) if first >= 0 else []


def _turns(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the degrees of freedom of a body's hinges and balls."""
    return [dof for dof in dofs_of(model, body) if int(model.jnt_type[model.dof_jntid[dof]]) in (_HINGE, _BALL)]
