"""Choice between the dense and the sparse constraint Jacobian: it affects MuJoCo's computing time, not the motion."""

from __future__ import annotations

import mujoco

_LONG_TREE = 44
"""Smallest number of degrees of freedom of one kinematic tree with which sparse matrices are used.

Source: benchmarks/rl/jacobian.md; our choice between the robots that are faster there with sparse matrices (crawlers
with 46 degrees of freedom and more) and those that are slower (41). MuJoCo's own rule counts the degrees of freedom of
all trees together and uses sparse matrices from 60 on.
"""


def choose_jacobian(model: mujoco.MjModel) -> None:
    """Make MuJoCo use sparse matrices if they are faster and the model leaves the choice to MuJoCo; in place."""
    if model.opt.jacobian == mujoco.mjtJacobian.mjJAC_AUTO and max(model.tree_dofnum, default=0) >= _LONG_TREE:
        model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
