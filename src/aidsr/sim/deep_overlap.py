"""How deep bodies get into each other while a robot moves; the validator and the evaluation of policies share it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

DEEP = 1.0
"""Overlap that is deep, as a share of half the thinner body's thickness. Source: our choice: from there on the surface
of one body lies beyond the middle of the other, and contact may push it out on the wrong side."""


@dataclass(frozen=True)
class DeepOverlap:
    """Two geoms that are inside of each other.

    Attributes:
        share: How deep / half the thickness of the thinner one.
        depth_m: How deep [m].
        geoms: Which.
    """

    share: float
    depth_m: float
    geoms: tuple[int, int]


def half_thickness_m(model: mujoco.MjModel) -> NDArray[np.float64]:
    """Return half the smallest width of each geom [m], (ngeom,); a plane has no other side, and is as thick as any."""
    thin_m = model.geom_aabb[:, 3:].min(axis=1)
    return np.where(model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE), np.inf, thin_m)


def deepest_overlap(data: mujoco.MjData, half_m: NDArray[np.float64], ours: Collection[int]) -> DeepOverlap | None:
    """Return the deepest overlap that concerns the robot, None where it overlaps nothing.

    Args:
        data: After `mj_collision`.
        half_m: See `half_thickness_m`.
        ours: The robot's geoms; quick to ask.
    """
    deepest = None
    for pair, distance_m in zip(data.contact.geom.tolist(), data.contact.dist.tolist(), strict=True):
        if distance_m < 0.0 and min(pair) >= 0 and (pair[0] in ours or pair[1] in ours):
            share = -distance_m / min(half_m[pair[0]], half_m[pair[1]])
            if deepest is None or share > deepest.share:
                deepest = DeepOverlap(float(share), -distance_m, (pair[0], pair[1]))
    return deepest
