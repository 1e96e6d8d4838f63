"""Friction of cables at their guides, after the capstan equation.

A tendon of MuJoCo has one tension everywhere. A real cable that is pulled over a guide leaves it with less:
T_out = T_in exp(-mu theta), theta the angle by which it turns there. What each straight section of the cable lacks is
applied to the bodies at its ends, in every physics step, in the pose of that moment: the guides of a straight limb turn
no cable, so the angles of the reference pose would hardly brake anything.

Source: capstan equation (Euler 1762, Eytelwein 1808); for guide holes of tendon-driven continuum robots see "Cosserat
Rod-Based Tendon Friction Modeling, Simulation, and Experiments for Tendon-Driven Continuum Robots", Micromachines 16
(2025) 346, doi 10.3390/mi16030346.

The winch is at the first site of the tendon. Tension is always lost away from the winch, as in a cable that is reeled
in or held after that. A cable that is paid out loses it towards the winch; this hysteresis is left out.
"""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from aidsr.sim.ownership import tendon_wraps
from aidsr.sim.structure import Structure
from aidsr.tasks.readings import FloatArray

_PULLEY = int(mujoco.mjtWrap.mjWRAP_PULLEY)
_SHORTEST_M = 1e-9
"""Points closer than this are one: a section between them has no direction."""


class CableFriction:
    """Applies the friction of cables to simulations of a batch.

    Cables are tendons that an actuator pulls on and that run through sites or around geoms; one with a pulley runs
    without friction.

    Args:
        batch: The simulations.
        structure: The robot in their model.
    """

    def __init__(self, batch: Batch, structure: Structure) -> None:
        model = batch.model
        self._batch, self._nbody = batch, model.nbody
        cables = [
            tendon
            for tendon in structure.tendons
            if tendon.spatial
            and tendon.actuators
            and all(kind != _PULLEY for kind, _ in tendon_wraps(model, tendon.id))
        ]
        self._tendons = np.array([cable.id for cable in cables], dtype=np.intp)
        self._pulls = np.zeros((model.nactuator, len(cables)))
        """Tension of each cable for a unit force of each actuator: a negative force pulls."""
        for row, cable in enumerate(cables):
            self._pulls[list(cable.actuators), row] = -model.actuator_gear[list(cable.actuators), 0]
        self._sites = np.zeros((len(cables), max((len(cable.sites) for cable in cables), default=1)), dtype=np.intp)
        """Body of each site along each cable."""
        for row, cable in enumerate(cables):
            self._sites[row, : len(cable.sites)] = model.site_bodyid[list(cable.sites)]
        # a geom that the cable touches is two points of its path, one that it does not touch none
        longest = [2 * len(tendon_wraps(model, cable.id)) - len(cable.sites) for cable in cables]
        self._points = np.arange(max(longest, default=0))
        self._geom_body = np.append(model.geom_bodyid, 0)
        for field in ("wrap_xpos", "wrap_obj", "ten_wrapadr", "ten_wrapnum", "actuator_force", "xipos"):
            batch.bind(field)

    def apply(self, ids: NDArray[np.intp], coefficients: FloatArray) -> None:
        """Set the forces of the next physics step.

        Args:
            ids: Simulations, (n,).
            coefficients: Of friction, in each of them, (n,).
        """
        self._batch.bind("xfrc_applied")[ids] = np.nan_to_num(self._wrenches(ids, coefficients))

    def _wrenches(self, ids: NDArray[np.intp], coefficients: FloatArray) -> FloatArray:
        """Return what friction does to each body, force and torque about its centre of mass, (n, nbody, 6)."""
        points, bodies, there = self._paths(ids)
        step = np.diff(points, axis=2)
        length = _lengths(step)[..., None]
        section = there[:, :, 1:, None] & (length > _SHORTEST_M)
        along = np.where(section, step / np.maximum(length, _SHORTEST_M), 0.0)
        turn = _lengths(np.diff(along, axis=2)) * (section[:, :, 1:, 0] & section[:, :, :-1, 0])
        angle = 2.0 * np.arcsin(np.minimum(turn / 2.0, 1.0))
        tension = np.maximum(self._batch.bind("actuator_force")[ids] @ self._pulls, 0.0)
        lost = tension[:, :, None] * -np.expm1(-coefficients[:, None, None] * np.cumsum(angle, axis=2))
        # the first section has the tension of the winch
        pushed = lost[..., None] * along[:, :, 1:]
        force = np.zeros_like(points)
        force[:, :, 1:-1] -= pushed
        force[:, :, 2:] += pushed
        return self._sum_by_body(ids, points, force, bodies)

    def _paths(self, ids: NDArray[np.intp]) -> tuple[FloatArray, NDArray[np.intp], NDArray[np.bool_]]:
        """Return the points of each cable's path, the body of each, and whether there is one.

        (n, n_cables, n_points, 3) [m], and twice (n, n_cables, n_points).
        """
        n = len(ids)
        first, count = (
            self._batch.bind(name)[ids][:, self._tendons].astype(np.intp)[..., None]
            for name in ("ten_wrapadr", "ten_wrapnum")
        )
        there = self._points < count
        rows, at = np.arange(n)[:, None, None], np.where(there, first + self._points, 0)
        points = self._batch.bind("wrap_xpos")[ids].reshape(n, -1, 3)[rows, at]
        geoms = self._batch.bind("wrap_obj")[ids].reshape(n, -1)[rows, at].astype(np.intp)
        passed = np.cumsum((geoms < 0) & there, axis=2) - 1
        of_site = self._sites[np.arange(len(self._tendons))[:, None], np.clip(passed, 0, self._sites.shape[1] - 1)]
        return points, np.where(geoms < 0, of_site, self._geom_body[geoms]).astype(np.intp), there

    def _sum_by_body(
        self, ids: NDArray[np.intp], points: FloatArray, force: FloatArray, bodies: NDArray[np.intp]
    ) -> FloatArray:
        n = len(ids)
        slots = (np.arange(n)[:, None, None] * self._nbody + bodies).ravel()
        at_points = np.concatenate([force, np.cross(points, force)], axis=-1).reshape(-1, 6)
        summed = [np.bincount(slots, weights=column, minlength=n * self._nbody) for column in at_points.T]
        wrench = np.stack(summed, axis=-1).astype(np.float64).reshape(n, self._nbody, 6)
        wrench[..., 3:] -= np.cross(self._batch.bind("xipos")[ids], wrench[..., :3])
        return wrench


def _lengths(vectors: FloatArray) -> FloatArray:
    """Return the lengths of vectors, (..., 3) -> (...)."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors)))
