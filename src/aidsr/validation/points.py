"""Positions of the robot's points in the frame of their root body."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.rollout import Recording
from aidsr.sim.structure import Structure

Array = NDArray[np.float64]


def displacements(recording: Recording, structure: Structure, model: mujoco.MjModel, reference: int) -> Array:
    """Return the displacement of every point of the robot from its position in the reference simulation.

    Points are centres of mass and marks (sites that no tendon runs through). Their positions are in the frame of their
    root body, so that neither a drifting base nor a moving mount counts as an effect.

    Args:
        recording: The simulations.
        structure: The robot's part of the model.
        model: The model.
        reference: Index of the reference simulation in the recording.

    Returns:
        (n_sims, n_frames, n_points, 3) [m].
    """
    points = seen_from_root(recording, structure, model)
    return np.asarray(points - points[reference])


def last_quarter(values: Array, axis: int) -> Array:
    """Return the last quarter of the frames, in which the commands of a test (other than the sweep) are constant."""
    count = values.shape[axis]
    return np.asarray(np.take(values, range(count - count // 4, count), axis=axis))


def seen_from_root(recording: Recording, structure: Structure, model: mujoco.MjModel) -> Array:
    """Return the positions of centres of mass and marks in the frame of their root body.

    Returns:
        (n_sims, n_frames, n_points, 3) [m]; first the bodies, then the marks.
    """
    return _seen_from_root(recording.fields, structure, model)


def _seen_from_root(fields: dict[str, Array], structure: Structure, model: mujoco.MjModel) -> Array:
    bodies, marks = list(structure.bodies), list(structure.marks)
    points = [*bodies, *(int(model.site_bodyid[site]) for site in marks)]
    world = np.concatenate([fields["xipos"][:, :, bodies], fields["site_xpos"][:, :, marks]], axis=2)
    seen = np.empty_like(world)
    root_of = _roots(model, structure)
    for root in structure.roots:
        mine = [k for k, body in enumerate(points) if root_of[body] == root]
        seen[:, :, mine] = (world[:, :, mine] - fields["xpos"][:, :, None, root]) @ _axes(fields["xquat"][:, :, root])
    return seen


def _axes(quat: Array) -> Array:
    """Return the rotation matrices (..., 3, 3) of unit quaternions (..., 4).

    A world row vector times a matrix gives the vector in the rotated frame.
    """
    w, x, y, z = np.moveaxis(quat, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def drawn_seen_from_root(start: mujoco.MjData, structure: Structure, model: mujoco.MjModel) -> Array:
    """Return the points of `seen_from_root` in the single pose of `start`, (n_points, 3) [m]."""
    drawn = {name: np.asarray(getattr(start, name))[None, None] for name in ("xipos", "site_xpos", "xpos", "xquat")}
    return np.asarray(_seen_from_root(drawn, structure, model)[0, 0])


def _roots(model: mujoco.MjModel, structure: Structure) -> dict[int, int]:
    root_of: dict[int, int] = {}
    for body in structure.bodies:
        root_of[body] = root_of.get(int(model.body_parentid[body]), body)
    return root_of
