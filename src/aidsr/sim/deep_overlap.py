"""Depth of the overlap between geoms while a robot moves; used by the validator and by the evaluation of policies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.extent import UNBOUNDED, half_width_m
from aidsr.sim.structure import Structure, neighbours

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
        passes: Whether they are one of the `passing_pairs`.
    """

    share: float
    depth_m: float
    geoms: tuple[int, int]
    passes: bool = False


class OverlapProbe:
    """Finds the deepest overlap of a robot's geom with any geom in given poses.

    Args:
        model: Compiled model.
        structure: Structure of the robot.
    """

    def __init__(self, model: mujoco.MjModel, structure: Structure) -> None:
        self._model, self._ours = model, frozenset(structure.geoms)
        self._half_m, self._passing = half_thickness_m(model), passing_pairs(model, structure)

    def look(self, data: mujoco.MjData, qpos: NDArray[np.float64]) -> DeepOverlap | None:
        """Return the deepest overlap in a pose, None if there is none.

        Pairs of `passing_pairs` count as if they were in contact.

        Args:
            data: Simulation state, which takes over the pose.
            qpos: Joint positions, (nq,).
        """
        data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_collision(self._model, data)
        deepest = None
        for one, other, distance_m, passes in self._distances_m(data):
            if distance_m < 0.0:
                share = -distance_m / min(self._half_m[one], self._half_m[other])
                if deepest is None or share > deepest.share:
                    deepest = DeepOverlap(float(share), -distance_m, (one, other), passes)
        return deepest

    def _distances_m(self, data: mujoco.MjData) -> Iterator[tuple[int, int, float, bool]]:
        """Yield the geoms, distance [m] and `DeepOverlap.passes` of the robot's contacts and of near passing pairs."""
        for (one, other), distance_m in zip(data.contact.geom.tolist(), data.contact.dist.tolist(), strict=True):
            if min(one, other) >= 0 and (one in self._ours or other in self._ours):
                yield one, other, distance_m, False
        if len(self._passing):
            first, second = self._passing.T
            apart_m = np.linalg.norm(data.geom_xpos[first] - data.geom_xpos[second], axis=1)
            is_near = apart_m < self._model.geom_rbound[first] + self._model.geom_rbound[second]
            for one, other in self._passing[is_near].tolist():
                yield one, other, mujoco.mj_geomDistance(self._model, data, one, other, 0.0, None), True


def half_thickness_m(model: mujoco.MjModel) -> NDArray[np.float64]:
    """Return half the smallest width of each geom [m], (ngeom,); infinity for planes and height fields."""
    return np.array([half_width_m(model, geom) for geom in range(model.ngeom)])


def passing_pairs(model: mujoco.MjModel, structure: Structure) -> NDArray[np.intp]:
    """Return the pairs of the robot's solid geoms that pass through each other by contype and conaffinity, (n, 2).

    A geom is solid if it collides with something. Left out are neighbours, pairs that MuJoCo keeps apart from contact
    with any contype, and pairs that an <exclude> or a <pair> names.

    Source: MuJoCo documentation, Computation, "Collision detection", filtering.
    """
    types, affinities, body = model.geom_contype, model.geom_conaffinity, model.geom_bodyid
    solid = [g for g in structure.geoms if (types[g] or affinities[g]) and int(model.geom_type[g]) not in UNBOUNDED]
    one_way = (types[solid][:, None] & affinities[solid]) != 0
    off = np.argwhere(np.triu(~(one_way | one_way.T), 1))
    if not len(off):
        return np.zeros((0, 2), dtype=np.intp)
    near, rigid = neighbours(model, structure), model.body_weldid
    above = rigid[model.body_parentid[rigid]]
    excluded = {frozenset((int(ends) >> 16, int(ends) & 0xFFFF)) for ends in model.exclude_signature}
    paired = set(map(frozenset, zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)))
    found = []
    for pair in np.asarray(solid)[off].tolist():
        first, second = body[pair].tolist()
        jointed = rigid[first] == above[second] != 0 or rigid[second] == above[first] != 0
        apart = second not in near[first] and rigid[first] != rigid[second] and not jointed
        if apart and frozenset((first, second)) not in excluded and frozenset(pair) not in paired:
            found.append(pair)
    return np.array(found, dtype=np.intp).reshape(-1, 2)
