"""What a robot can do while a part of it does nothing."""

import mujoco
import numpy as np
import pytest

from aidsr.sim.deactivate import (
    other_actuators,
    soft_joints,
    with_locked_soft_body,
    without_cables,
    without_other_actuators,
)
from aidsr.sim.structure import read_structure
from scenes import small_arm, small_scene


def model_of(text: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(text)


def soft(text: str) -> list[str]:
    model = model_of(text)
    return [model.joint(joint).name for joint in soft_joints(model, read_structure(model))]


def pulled(model: mujoco.MjModel, seconds: float = 2.0, *ctrl: float) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.ctrl[: len(ctrl)] = ctrl
    while data.time < seconds:
        mujoco.mj_step(model, data)
    return data


def test_the_soft_body_is_what_tendons_bend_in_series():
    bends = [f"bend{i}" for i in range(1, 5)]
    assert soft(small_arm()) == bends
    assert soft(small_scene()) == [f"robot/{name}" for name in bends]


def test_a_linkage_of_two_joints_is_no_soft_body():
    short = small_arm()
    for i in (3, 4):
        start = short.index(f'<joint name="bend{i}"')
        short = short[:start] + short[short.index("/>", start) + 2 :]
    assert soft(short) == []


def test_joints_that_no_tendon_bends_are_no_part_of_the_soft_body():
    free_end = small_arm().replace('<site site="left4"/>', "").replace('<site site="right4"/>', "")
    assert soft(free_end) == ["bend1", "bend2", "bend3"]
    assert soft(free_end.replace('<site site="left3"/>', "").replace('<site site="right3"/>', "")) == []


def test_both_axes_of_a_turning_point_are_soft_and_the_springs_along_it():
    """Of two hinges at a point, cables in a plane bend one; it is one turning point all the same."""
    joint = '<joint name="bend{i}" axis="0 1 0"'
    text = small_arm()
    for i in range(1, 5):
        more = f'<joint name="along{i}" type="slide" axis="0 0 1" stiffness="{i % 2}"/>'
        more += f'<joint name="side{i}" axis="1 0 0"/>'
        text = text.replace(joint.format(i=i), more + joint.format(i=i))
    assert soft(text) == ["along1", "side1", "bend1", "side2", "bend2", "along3", "side3", "bend3", "side4", "bend4"]


def test_a_universal_joint_of_two_bodies_is_one_turning_point():
    text = small_arm()
    for i in (2, 3, 4):
        start = text.index(f'<joint name="bend{i}"')
        text = text[:start] + text[text.index("/>", start) + 2 :]
    first = '<joint name="bend1"'
    # three bodies that turn at one point
    twice = '<joint name="a" axis="1 0 0"/><geom size="0.001" mass="0.001"/><body name="b">'
    twice += '<joint name="b" axis="0 1 0"/><geom size="0.001" mass="0.001"/><body name="c">'
    assert text.count(first) == 1
    close = text.index("</body>\n  </worldbody>")
    text = text[:close] + "</body></body>" + text[close:]
    assert soft(text.replace(first, twice + first)) == []


def test_slack_cables_exert_no_force_whatever_their_least_is():
    text = small_arm(tension=8).replace('ctrlrange="0 8"', 'ctrlrange="0 8" forcerange="-20 -1"')
    model = model_of(text)
    assert pulled(model, 0.1, 0.0, 0.0).actuator_force.tolist() == [-1.0, -1.0]
    slack = without_cables(model, read_structure(model))
    assert pulled(slack, 0.1, 8.0, 0.0).actuator_force.tolist() == [0.0, 0.0]
    assert pulled(model, 0.1, 8.0, 0.0).actuator_force[0] == -8.0, "the model itself is as it was"


def test_an_actuator_that_its_author_switched_off_stays_off():
    model = model_of(small_arm(third='<motor name="m" joint="bend4" ctrlrange="-1 1" group="1"/>'))
    model.opt.disableactuator = 1 << 1
    slack = without_cables(model, read_structure(model))
    assert pulled(slack, 0.1, 8.0, 8.0, 1.0).actuator_force.tolist() == [0.0, 0.0, 0.0]
    model.opt.disableactuator = 1 << 2
    slack = without_cables(model, read_structure(model))
    assert pulled(slack, 0.1, 8.0, 8.0, 0.01).actuator_force.tolist() == [0.0, 0.0, 0.01]


@pytest.mark.parametrize("integrator", ["EULER", "IMPLICITFAST", "DISCRETE"])
def test_a_locked_body_keeps_its_shape_and_its_mass(integrator):
    model = model_of(small_arm(tension=100.0))
    model.opt.integrator = int(getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}"))
    locked = with_locked_soft_body(model, read_structure(model))
    assert np.abs(pulled(locked, 10.0, 100.0, 0.0).qpos).max() < 1e-3
    assert np.abs(pulled(model, 1.0, 8.0, 0.0).qpos).max() > 0.1
    assert locked.body_mass.tolist() == model.body_mass.tolist()


def test_a_locked_body_falls_like_a_stone():
    """What locks it resists no motion of the whole."""
    free = small_arm().replace('<body name="base">', '<body name="base"><freejoint/>')
    model = model_of(free)
    locked = with_locked_soft_body(model, read_structure(model))
    data = pulled(locked, 1.0, 8.0, 0.0)
    assert data.qpos[2] == pytest.approx(-9.81 / 2, rel=0.01)
    assert np.abs(data.qpos[7:]).max() < 1e-3


def test_other_actuators_are_off_and_the_joints_that_only_they_drive_stay():
    sled = '<joint name="sled" type="slide" axis="0 0 1"/>'
    third = '<motor name="lift" joint="sled" ctrlrange="-1 1"/><motor name="bend" joint="bend4" ctrlrange="-1 1"/>'
    model = model_of(small_arm(third=third).replace('<body name="base">', f'<body name="base">{sled}'))
    structure = read_structure(model)
    assert other_actuators(structure) == (2, 3)
    data = pulled(without_other_actuators(model, structure), 1.0, 8.0, 0.0, 1.0, 1.0)
    assert data.actuator_force.tolist() == [-8.0, 0.0, 0.0, 0.0]
    assert abs(data.joint("sled").qpos[0]) < 1e-3
    # cables bend it as well
    assert abs(data.joint("bend4").qpos[0]) > 0.1
