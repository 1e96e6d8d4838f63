"""Friction of cables at their guides, after the capstan equation.

A tendon of MuJoCo has the same tension everywhere. A real cable that is pulled over a guide loses tension there: T_out
= T_in exp(-mu theta), with theta the angle by which the cable turns. The loss of tension in each straight section of
the cable is applied as generalized forces, computed for the current pose. Angles of the reference pose would have
hardly any effect, because the guides of a straight limb do not turn the cable.

Source: capstan equation (Euler 1762, Eytelwein 1808); for guide holes of tendon-driven continuum robots see "Cosserat
Rod-Based Tendon Friction Modeling, Simulation, and Experiments for Tendon-Driven Continuum Robots", Micromachines 16
(2025) 346, doi 10.3390/mi16030346.

The winch is at the first site of the tendon. Tension always decreases away from the winch, as in a cable that is being
reeled in or held afterwards. In a cable that is paid out, it decreases towards the winch; this hysteresis is not
modelled.
"""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from aidsr.sim.ownership import tendon_wraps
from aidsr.sim.structure import Structure
from aidsr.tasks.readings import FloatArray

REFRESH_S = 0.004
"""Time for which the friction forces are kept constant [s]. Source: our choice. For a light limb that swings at 4 Hz,
the difference from a simulation with steps of 0.1 ms is then no larger than that of 2 ms steps alone (0.3 % of its
length). With forces kept for a control step of 40 ms, the error is as large as without friction (0.9 and 1 %)."""

_PULLEY = int(mujoco.mjtWrap.mjWRAP_PULLEY)
_SHORTEST_M = 1e-9
"""Points closer than this count as one: a section between them has no direction."""


class CableFriction:
    """Applies the friction of cables to the simulations of a batch.

    Cables are tendons that an actuator pulls and that run through sites or around geoms. A tendon with a pulley has no
    friction.

    Args:
        batch: The simulations.
        structure: Structure of the robot in their model.
    """

    def __init__(self, batch: Batch, structure: Structure) -> None:
        model = batch.model
        self._batch, self._nbody = batch, model.nbody
        self._root, self._moved = model.body_rootid, _moved_bodies(model)
        self._site_body, self._geom_body = np.append(model.site_bodyid, 0), np.append(model.geom_bodyid, 0)
        cables = [
            tendon
            for tendon in structure.tendons
            if tendon.spatial
            and tendon.actuators
            and all(kind != _PULLEY for kind, _ in tendon_wraps(model, tendon.id))
        ]
        self._tendons = np.array([cable.id for cable in cables], dtype=np.intp)
        self._pulls = np.zeros((model.nactuator, len(cables)))
        """Tension of each cable for a unit force of each actuator; a negative actuator force pulls."""
        for row, cable in enumerate(cables):
            self._pulls[list(cable.actuators), row] = -model.actuator_gear[list(cable.actuators), 0]
        # a geom adds two points to the path of a cable that touches it, and none otherwise
        longest = [2 * len(tendon_wraps(model, cable.id)) - len(cable.sites) for cable in cables]
        self._sites = np.full((len(cables), max(longest, default=0)), -1, dtype=np.intp)
        """Ids of the sites along each cable, padded with -1."""
        for row, cable in enumerate(cables):
            self._sites[row, : len(cable.sites)] = cable.sites
        self._only_sites = all(len(tendon_wraps(model, cable.id)) == len(cable.sites) for cable in cables)
        fields = ("site_xpos",) if self._only_sites else ("wrap_xpos", "wrap_obj", "ten_wrapadr", "ten_wrapnum")
        for field in (*fields, "actuator_force", "cdof", "subtree_com"):
            batch.bind(field)

    def apply(self, ids: NDArray[np.intp], coefficients: FloatArray) -> None:
        """Set the friction forces for the next `REFRESH_S`.

        Args:
            ids: Indices of the simulations, (n,).
            coefficients: Coefficient of friction in each of them, (n,).
        """
        self._batch.bind("qfrc_applied")[ids] = np.nan_to_num(self._forces(ids, coefficients))

    def _forces(self, ids: NDArray[np.intp], coefficients: FloatArray) -> FloatArray:
        """Return the friction forces as generalized forces, (n, nv)."""
        points, bodies, there = self._paths(ids) if not self._only_sites else self._paths_of_sites(ids)
        step = points[:, :, 1:] - points[:, :, :-1]
        length = _lengths(step)
        section = there[:, :, 1:] & (length > _SHORTEST_M)
        along = step * (section / np.maximum(length, _SHORTEST_M))[..., None]
        turn = _lengths(along[:, :, 1:] - along[:, :, :-1]) * (section[:, :, 1:] & section[:, :, :-1])
        angle = 2.0 * np.arcsin(np.minimum(turn / 2.0, 1.0))
        tension = np.maximum(self._batch.bind("actuator_force")[ids] @ self._pulls, 0.0)
        lost = tension[:, :, None] * -np.expm1(-coefficients[:, None, None] * np.cumsum(angle, axis=2))
        # the first section has the tension of the winch
        pushed = lost[..., None] * along[:, :, 1:]
        force = np.zeros_like(points)
        force[:, :, 1:-1] -= pushed
        force[:, :, 2:] += pushed
        return self._generalized(ids, points, force, bodies)

    def _paths_of_sites(self, ids: NDArray[np.intp]) -> tuple[FloatArray, NDArray[np.intp], NDArray[np.bool_]]:
        """Return the paths of cables that only run through sites; results as in `_paths`."""
        points = self._batch.bind("site_xpos")[ids[:, None, None], self._sites]
        there = np.broadcast_to(self._sites >= 0, points.shape[:3])
        return points, np.broadcast_to(self._site_body[self._sites], points.shape[:3]), there

    def _paths(self, ids: NDArray[np.intp]) -> tuple[FloatArray, NDArray[np.intp], NDArray[np.bool_]]:
        """Return the points of each cable's path, the body of each point, and whether the point exists.

        Shapes: (n, n_cables, n_points, 3) [m], and twice (n, n_cables, n_points).
        """
        first, count = (
            self._batch.bind(name)[ids][:, self._tendons].astype(np.intp)[..., None]
            for name in ("ten_wrapadr", "ten_wrapnum")
        )
        slots = np.arange(self._sites.shape[1])
        there = slots < count
        rows, at = np.arange(len(ids))[:, None, None], np.where(there, first + slots, 0)
        points = self._batch.bind("wrap_xpos")[ids].reshape(len(ids), -1, 3)[rows, at]
        geoms = self._batch.bind("wrap_obj")[ids].reshape(len(ids), -1)[rows, at].astype(np.intp)
        passed = np.maximum(np.cumsum((geoms < 0) & there, axis=2) - 1, 0)
        of_site = self._site_body[self._sites[np.arange(len(self._tendons))[:, None], passed]]
        return points, np.where(geoms < 0, of_site, self._geom_body[geoms]).astype(np.intp), there

    def _generalized(
        self, ids: NDArray[np.intp], points: FloatArray, force: FloatArray, bodies: NDArray[np.intp]
    ) -> FloatArray:
        """Return forces at points as generalized forces, (n, nv).

        Source: MuJoCo documentation, mjData.cdof: rotation, then translation at the centre of mass of the whole
        kinematic tree.
        """
        n = len(ids)
        slots = (np.arange(n)[:, None, None] * self._nbody + bodies).ravel()
        wrench = np.empty((n, self._nbody, 6))
        """Torque about the origin, then force, on each body."""
        for axis, column in enumerate((*_cross(points, force), *np.moveaxis(force, -1, 0))):
            summed = np.bincount(slots, weights=column.ravel(), minlength=n * self._nbody)
            wrench[..., axis] = summed.reshape(n, self._nbody)
        centre = self._batch.bind("subtree_com")[ids][:, self._root]
        wrench[..., :3] -= np.stack(_cross(centre, wrench[..., 3:]), axis=-1)
        return np.asarray(np.einsum("njk,njk->nj", self._batch.bind("cdof")[ids], self._moved @ wrench))


def _lengths(vectors: FloatArray) -> FloatArray:
    """Return the lengths of vectors, (..., 3) -> (...)."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", vectors, vectors)))


def _cross(one: FloatArray, other: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the components of the cross product of vectors, (..., 3) -> (...) each; `np.cross` takes twice as long."""
    (x, y, z), (u, v, w) = np.moveaxis(one, -1, 0), np.moveaxis(other, -1, 0)
    return y * w - z * v, z * u - x * w, x * v - y * u


def _moved_bodies(model: mujoco.MjModel) -> FloatArray:
    """Return a matrix with 1 where a degree of freedom moves a body, else 0, (nv, nbody)."""
    moved = np.zeros((model.nv, model.nbody))
    for body in range(1, model.nbody):
        moved[:, body] = moved[:, model.body_parentid[body]]
        first = int(model.body_dofadr[body])
        moved[first : first + int(model.body_dofnum[body]), body] = 1.0
    return moved
