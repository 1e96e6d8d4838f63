"""Depth of the overlap between geoms while a robot moves; used by the validator and by the evaluation of policies."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

DEEP = 1.0
"""Smallest deep overlap, as a share of half the thickness of the thinner geom. Source: our choice: from this depth on,
the surface of one geom lies beyond the middle of the other, and contact may push it out on the wrong side."""


@dataclass(frozen=True)
class DeepOverlap:
    """Overlap of two geoms.

    Attributes:
        share: Depth / half the thickness of the thinner geom.
        depth_m: Depth [m].
        geoms: Ids of the two geoms.
    """

    share: float
    depth_m: float
    geoms: tuple[int, int]


def half_thickness_m(model: mujoco.MjModel) -> NDArray[np.float64]:
    """Return half the smallest width of each geom [m], (ngeom,); infinity for planes, which have no other side."""
    thin_m = model.geom_aabb[:, 3:].min(axis=1)
    return np.where(model.geom_type == int(mujoco.mjtGeom.mjGEOM_PLANE), np.inf, thin_m)


def deepest_overlap(data: mujoco.MjData, half_m: NDArray[np.float64], ours: Collection[int]) -> DeepOverlap | None:
    """Return the deepest overlap of a geom of the robot with any geom, None if there is no overlap.

    Args:
        data: Simulation state after `mj_collision`.
        half_m: Result of `half_thickness_m`.
        ours: Ids of the robot's geoms, in a collection with fast membership tests.
    """
    deepest = None
    for pair, distance_m in zip(data.contact.geom.tolist(), data.contact.dist.tolist(), strict=True):
        if distance_m < 0.0 and min(pair) >= 0 and (pair[0] in ours or pair[1] in ours):
            share = -distance_m / min(half_m[pair[0]], half_m[pair[1]])
            if deepest is None or share > deepest.share:
                deepest = DeepOverlap(float(share), -distance_m, (pair[0], pair[1]))
    return deepest
