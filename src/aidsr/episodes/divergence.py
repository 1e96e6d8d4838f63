"""Where a simulation has broken down, for many at once."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import mujoco
import numpy as np
from mujoco.batch import Batch

from aidsr.tasks.readings import BoolArray, FloatArray

__all__ = ["FASTEST_M_S", "broken_down", "fastest_m_s", "quiet"]

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
    """Return the largest speed of any body's centre of mass, (n,) [m/s].

    Source: MuJoCo documentation, mjData.cvel: rotation, then the velocity of the point of the body that is now at the
    centre of mass of its whole tree.
    """
    rotation, linear = batch.bind("cvel")[:, :, :3], batch.bind("cvel")[:, :, 3:]
    arm = batch.bind("xipos") - batch.bind("subtree_com")[:, batch.model.body_rootid]
    velocity = linear + np.cross(rotation, arm)
    return np.asarray(np.sqrt(np.einsum("nbi,nbi->nb", velocity, velocity).max(axis=1)))


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
