"""Where the robot's points are, seen from the root they hang from."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.rollout import Recording
from aidsr.sim.structure import Structure

Array = NDArray[np.float64]


def displacements(recording: Recording, structure: Structure, model: mujoco.MjModel, reference: int) -> Array:
    """Way of every point of the robot from where it is in the reference simulation.

    Points are centres of mass and marks (sites that no tendon runs through), seen from the root they hang from, so that
    neither a drifting base nor a moving mount counts as an effect.

    Returns:
        (n_sims, n_frames, n_points, 3) [m].
    """
    points = seen_from_root(recording, structure, model)
    return np.asarray(points - points[reference])


def last_quarter(values: Array, axis: int) -> Array:
    """The last quarter of the frames, when commands have long been constant."""
    count = values.shape[axis]
    return np.asarray(np.take(values, range(count - count // 4, count), axis=axis))


def seen_from_root(recording: Recording, structure: Structure, model: mujoco.MjModel) -> Array:
    """Return centres of mass and marks of the robot in the frame of their root, (n_sims, n_frames, n_points, 3) [m]."""
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
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4); a row vector times one is seen in its frame."""
    w, x, y, z = np.moveaxis(quat, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def drawn_seen_from_root(start: mujoco.MjData, structure: Structure, model: mujoco.MjModel) -> Array:
    """Return the same points in one pose, (n_points, 3) [m]."""
    drawn = {name: np.asarray(getattr(start, name))[None, None] for name in ("xipos", "site_xpos", "xpos", "xquat")}
    return np.asarray(_seen_from_root(drawn, structure, model)[0, 0])


def _roots(model: mujoco.MjModel, structure: Structure) -> dict[int, int]:
    root_of: dict[int, int] = {}
    for body in structure.bodies:
        root_of[body] = root_of.get(int(model.body_parentid[body]), body)
    return root_of
