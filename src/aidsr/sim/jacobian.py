"""Which form of the constraint Jacobian MuJoCo computes with: the motion is the same, the time is not."""

from __future__ import annotations

import mujoco

_LONG_TREE = 44
"""Degrees of freedom of one kinematic tree from which sparse matrices are quicker: crawlers have 46 and more.

Source: benchmarks/rl/jacobian.md; our choice between the bodies that gain there and those that lose, of 41. MuJoCo's
own choice goes by the degrees of freedom of all trees together, and is sparse from 60 on.
"""


def choose_jacobian(model: mujoco.MjModel) -> None:
    """Let MuJoCo compute with sparse matrices where these are quicker and the author of a model leaves it open."""
    if model.opt.jacobian == mujoco.mjtJacobian.mjJAC_AUTO and max(model.tree_dofnum, default=0) >= _LONG_TREE:
        model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
