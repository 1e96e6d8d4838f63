"""Where a simulation has broken down, for many at once."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from aidsr.tasks.readings import BoolArray, FloatArray

__all__ = ["FASTEST_M_S", "broken_down", "fastest_m_s", "quiet", "speeds_m_s"]

FASTEST_M_S = 50.0
"""A body faster than this means that the simulation has diverged. Source: docs/tasks.md; our choice, an order of
magnitude above anything that tendons of these robots can throw."""


def broken_down(batch: Batch) -> BoolArray:
    """Return which simulations have diverged, (n,).

    That is: MuJoCo warned, numbers are not finite, or a body is faster than `FASTEST_M_S`.
    """
    warned = batch.warning[:, :, 1].sum(axis=1) > 0
    finite = np.isfinite(batch.bind("qpos")).all(axis=1) & np.isfinite(batch.bind("qvel")).all(axis=1)
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(warned | ~finite | ~(fastest_m_s(batch) <= FASTEST_M_S))


def fastest_m_s(batch: Batch) -> FloatArray:
    """Return the largest speed of any body's centre of mass, (n,) [m/s]."""
    moving = (batch.bind(field) for field in ("cvel", "xipos", "subtree_com"))
    return np.asarray(speeds_m_s(batch.model.body_rootid, *moving).max(axis=1))


def speeds_m_s(roots: NDArray[np.integer], cvel: FloatArray, xipos: FloatArray, subtree_com: FloatArray) -> FloatArray:
    """Return the speeds of the bodies' centres of mass, (..., bodies) [m/s].

    Source: MuJoCo documentation, mjData.cvel: rotation, then the velocity of the point of the body that is now at the
    centre of mass of its whole tree.

    Args:
        roots: `body_rootid` of the model, (bodies,).
        cvel: Of one simulation or many, (..., bodies, 6) [rad/s, m/s].
        xipos: Likewise, (..., bodies, 3) [m].
        subtree_com: Likewise, (..., bodies, 3) [m].
    """
    velocity = cvel[..., 3:] + np.cross(cvel[..., :3], xipos - subtree_com[..., roots, :])
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", velocity, velocity)))


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Keep MuJoCo from writing its warnings to MUJOCO_LOG.TXT in the working directory; `broken_down` counts them."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(_ignore)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _ignore(_message: str) -> None:
    """Take a warning and do nothing: MuJoCo has counted it already."""
