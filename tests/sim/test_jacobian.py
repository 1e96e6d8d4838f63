"""The form of the Jacobian is chosen by the longest tree, and changes the motion by rounding alone."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
import pytest

from aidsr.sim.jacobian import choose_jacobian

AUTO, SPARSE, DENSE = (
    mujoco.mjtJacobian.mjJAC_AUTO,
    mujoco.mjtJacobian.mjJAC_SPARSE,
    mujoco.mjtJacobian.mjJAC_DENSE,
)


def chain(links: int, *, option: str = "", copies: int = 1) -> mujoco.MjModel:
    """A free chain of links with hinges, lying on a floor; or several of them side by side."""
    link = '<body pos="0.05 0 0"><joint axis="0 1 0" damping="0.01"/><geom type="sphere" size="0.02"/>'
    bodies = "".join(
        f'<body pos="0 {0.2 * number} 0.03"><freejoint/><geom size="0.02"/>{link * links}{"</body>" * links}</body>'
        for number in range(copies)
    )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option {option}/><worldbody><geom type="plane" size="0 0 1"/>{bodies}</worldbody></mujoco>'
    )


@pytest.mark.parametrize(
    ("model", "expected"),
    [
        (chain(38), SPARSE),
        (chain(37), AUTO),
        (chain(22, copies=2), AUTO),
        (chain(38, option='jacobian="dense"'), DENSE),
        (mujoco.MjModel.from_xml_string("<mujoco/>"), AUTO),
    ],
    ids=["one long tree", "one shorter tree", "two short trees", "as its author says", "nothing moves"],
)
def test_long_trees_are_computed_sparse(model: mujoco.MjModel, expected: mujoco.mjtJacobian) -> None:
    choose_jacobian(model)
    assert model.opt.jacobian == expected


def test_the_motion_is_the_same_but_for_rounding() -> None:
    dense = chain(40)
    sparse = copy.copy(dense)
    choose_jacobian(sparse)
    moved, touching = [], 0
    for model in (dense, sparse):
        data = mujoco.MjData(model)
        data.qvel[6:] = np.linspace(-1, 1, model.nv - 6)
        for _ in range(50):
            mujoco.mj_step(model, data)
            touching += data.ncon
        moved.append(data.qpos.copy())
    assert touching > 0
    assert np.abs(moved[0] - moved[1]).max() < 1e-9
    assert np.abs(moved[0] - dense.qpos0).max() > 0.01
