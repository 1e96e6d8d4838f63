"""Bends of a limb's joints under one cable, and everything that can make a joint rigid besides its own spring."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from aidsr.mjcf.compile import compile_mjcf
from aidsr.sim.bending import bends_by_cables, stiffness_alone
from aidsr.sim.poses import bent_pose
from aidsr.sim.scope import find_out_of_scope
from aidsr.sim.soft_body import read_soft_body
from aidsr.sim.structure import read_structure
from aidsr.sim.tendon_effects import unit_pull
from scenes import changed_arm, small_arm

PULL_N = 2.0
PLAIN = 'stiffness="0.2" damping="0.02" range="-40 40"'
WHOLE = 0.2 + 0.02 / 10
"""Resistance of a joint of the small arm within ten seconds [N m/rad]."""


def tied(attributes: str, *, over: int = 1) -> str:
    """Return the small arm with a fixed tendon without an actuator over each of its joints but the first.

    With `over` above 1, one tendon over all of these joints.
    """
    joints = [f'<joint joint="bend{i}" coef="1"/>' for i in (2, 3, 4)]
    groups = joints if over == 1 else ["".join(joints)]
    tendons = "".join(f'<fixed name="belt{k}" {attributes}>{group}</fixed>' for k, group in enumerate(groups))
    return changed_arm(("</tendon>", f"{tendons}</tendon>"))


def geared(kind: str, polynomial: str = "0 0.05 0 0 0") -> str:
    """Return the small arm whose joints follow the first one."""
    fixed = "".join(f'<fixed name="belt{i}"><joint joint="bend{i}" coef="1"/></fixed>' for i in range(1, 5))
    name = "belt" if kind == "tendon" else "bend"
    equal = "".join(f'<{kind} {kind}1="{name}{i}" {kind}2="{name}1" polycoef="{polynomial}"/>' for i in (2, 3, 4))
    return changed_arm(("</tendon>", f"{fixed if kind == 'tendon' else ''}</tendon><equality>{equal}</equality>"))


def stiffened(attributes: str) -> str:
    """Return the small arm whose joints have other attributes."""
    return changed_arm((PLAIN, attributes))


RIGID = {
    "springs of tendons": tied('stiffness="200"'),
    "springs of tendons that grow": tied('stiffness="0 0 1e6"'),
    "a spring of one tendon over several joints": tied('stiffness="200"', over=3),
    "stops of tendons": tied('range="-0.001 0.001"'),
    "margins of these stops": tied('range="-1 1" margin="0.999"'),
    "friction of tendons": tied('frictionloss="2"'),
    "damping of tendons": tied('damping="2000"'),
    "armature of tendons": tied('armature="20000"'),
    "springs that grow": stiffened('range="-40 40" stiffness="0.2 0 1e6" damping="0.01"'),
    "springs that are loaded": stiffened('range="-40 40" stiffness="0.2 0 100" springref="80" damping="0.01"'),
    "damping that grows": stiffened('range="-40 40" stiffness="0.2" damping="0.01 1e6 0"'),
    "margins of stops": stiffened('range="-40 40" margin="0.697" stiffness="0.2" damping="0.01"'),
    "limits of actuator forces": stiffened(f'{PLAIN} actuatorfrcrange="-1e-5 1e-5"'),
    "joint equalities": geared("joint"),
    "tendon equalities": geared("tendon"),
    "a joint equality that turns around": geared("joint", "0 0.2 -1.4286 3.265 -2.332"),
}


@pytest.mark.parametrize("mjcf", RIGID.values(), ids=RIGID)
def test_a_joint_is_rigid_whatever_holds_it(mjcf: str) -> None:
    model = compile_mjcf(mjcf)
    codes = {finding.code for finding in find_out_of_scope(model, read_structure(model))}
    assert "few_bent_joints" in codes


SOFT = {
    "plain": small_arm(),
    "soft tendons": tied('stiffness="0.05" damping="0.01" armature="1e-5"'),
    "tendons that are slack at first": tied('stiffness="200" springlength="-0.5 0.5"'),
    "stops far away": tied('range="-0.5 0.5"'),
    "little friction": tied('frictionloss="0.001"'),
    "springs that grow a little": stiffened('range="-40 40" stiffness="0.2 0.1 0.1" damping="0.01 0.01 0"'),
    "equal gears": geared("joint", "0 1 0 0 0"),
    "equal gears of tendons": geared("tendon", "0 1 0 0 0"),
}


@pytest.mark.parametrize("mjcf", SOFT.values(), ids=SOFT)
def test_a_limb_is_soft_with_a_little_of_all_that(mjcf: str) -> None:
    model = compile_mjcf(mjcf)
    structure = read_structure(model)
    assert read_soft_body(model, structure, structure.tendon_actuators).series == 4


def bends(mjcf: str) -> np.ndarray:
    """Return the bends of the small arm under one cable that pulls with `PULL_N` [rad]."""
    model = compile_mjcf(mjcf)
    structure, data = read_structure(model), mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bent = bent_pose(model, structure, 0.02)
    pull = PULL_N * unit_pull(model, bent, int(model.actuator_trnid[structure.tendon_actuators[0], 0]))
    room = np.full(model.nv, np.pi)
    return bends_by_cables(model, data, bent, structure, [pull], room)[1]


def test_a_growing_spring_bends_to_where_its_torque_is_that_of_the_cable() -> None:
    linear, grown = bends(small_arm()), bends(stiffened('range="-40 40" stiffness="0.2 0 50" damping="0"'))
    torque = linear * WHOLE
    assert 0.2 * grown + 50 * grown**3 == pytest.approx(torque, rel=1e-4)


def test_a_tendon_over_several_joints_is_stretched_by_all_of_them() -> None:
    free, held = bends(small_arm()), bends(tied('stiffness="3"', over=3))
    torque = free * WHOLE
    assert held[0] == pytest.approx(free[0], rel=1e-4)
    assert WHOLE * held[1:] + 3.0 * held[1:].sum() == pytest.approx(torque[1:], rel=1e-4)


def test_geared_joints_share_the_torques_and_the_springs() -> None:
    torque = bends(small_arm()) * WHOLE
    together = bends(geared("joint"))
    ratios = np.array([1.0, 0.05, 0.05, 0.05])
    assert together == pytest.approx(ratios * (ratios @ torque) / (WHOLE * ratios @ ratios), rel=1e-2)


def test_a_stop_ends_the_bend() -> None:
    assert bends(tied('range="-0.05 0.05"'))[1:] == pytest.approx(0.05, abs=2e-4)


def test_a_joint_alone_has_the_stiffness_of_its_spring_and_of_its_tendons() -> None:
    model = compile_mjcf(tied('stiffness="3"'))
    structure, data = read_structure(model), mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bent = bent_pose(model, structure, 0.02)
    found = stiffness_alone(model, data, bent, structure, np.full(model.nv, 0.02))
    assert found == pytest.approx([WHOLE, 3 + WHOLE, 3 + WHOLE, 3 + WHOLE])
