"""The robot as built has the ranges and masses of its parts, however its file says them."""

import re
from dataclasses import replace
from functools import cache

import mujoco
import numpy as np
import pytest
from fingers import WINCH, finger

from aidsr.fabrication.as_built import as_built
from aidsr.fabrication.build import RobotBuild, build_robot
from aidsr.fabrication.changes import changes_of, masses_of
from aidsr.fabrication.materials import lines
from aidsr.fabrication.printers import printer_named
from aidsr.validation import validate


@cache
def made(mjcf: str) -> RobotBuild:
    return build_robot(mjcf, [validate(mjcf)], printer_named("fdm"))


@cache
def built(mjcf: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(as_built(made(mjcf), mjcf))


@pytest.mark.parametrize(
    "mjcf",
    [
        finger(compiler="", joint='range="-28.6478898 28.6478898"'),
        finger(compiler='angle="radian" inertiafromgeom="true"'),
        finger(compiler='angle="radian" settotalmass="0.037"'),
        finger(joint='ref="0.2" springref="0.2" range="-0.3 0.7"'),
        finger().replace('fromto="0 0 0 0 0 0.02" size="0.008"', 'pos="0 0 0.01" euler="3.1416 0 0" size="0.008 0.01"'),
    ],
    ids=["degrees", "inertiafromgeom", "settotalmass", "ref", "pos"],
)
def test_one_robot_written_in_several_ways_is_built_the_same(mjcf: str) -> None:
    model, plain = built(mjcf), built(finger())
    assert model.jnt_range - model.qpos0[:, None] == pytest.approx(plain.jnt_range, abs=1e-4)
    assert model.geom_pos == pytest.approx(plain.geom_pos, abs=1e-4)
    assert np.sort(model.geom_size) == pytest.approx(np.sort(plain.geom_size), abs=1e-4)
    assert model.body_mass == pytest.approx(plain.body_mass, rel=1e-3)
    assert plain.body_mass[2:].sum() != pytest.approx(0.015, rel=0.01), "masses change, or this test sees nothing"


def test_joints_with_springdamper_are_built_with_the_stiffness_of_their_hinges() -> None:
    mjcf = finger().replace('stiffness="0.3" damping="0.01"', 'springdamper="0.005 1"')
    designed, model = mujoco.MjModel.from_xml_string(mjcf), built(mjcf)
    hinges = [hinge.stiffness_n_m_rad for hinge in made(mjcf).hinges.hinges.values()]
    assert hinges == pytest.approx(designed.jnt_stiffness.ravel(), rel=0.1)
    assert model.jnt_stiffness.ravel() == pytest.approx(hinges, rel=1e-4)
    assert model.dof_damping.ravel() == pytest.approx(designed.dof_damping.ravel(), rel=1e-4)


def test_a_ball_joint_with_a_range_keeps_it_one_sided() -> None:
    model = built(finger(joint='type="ball" range="0 0.5"'))
    assert model.jnt_range[:, 0] == pytest.approx(0)
    assert model.jnt_range[:, 1].min() > 0.1


def test_a_tendon_that_nothing_drives_has_no_force_and_is_told() -> None:
    drives = WINCH.format(name="pull_flex", tendon="flex")
    mjcf = finger(extend='stiffness="400" damping="1" limited="true" range="0 0.05"', actuators=drives)
    assert mujoco.MjModel.from_xml_string(mjcf).tendon_stiffness.any()
    model = built(mjcf)
    assert model.ntendon == 2
    for name in ("tendon_stiffness", "tendon_damping", "tendon_limited"):
        assert not getattr(model, name).any(), name
    assert "cables that nothing drives" in {change.what for change in changes_of(made(mjcf))}
    assert "cables that nothing drives" not in {change.what for change in changes_of(made(finger()))}


def test_a_cable_with_an_actuator_has_no_spring_damper_or_stop_and_that_is_told() -> None:
    mjcf = finger(extend='stiffness="40" damping="1" limited="true" range="0 0.09" frictionloss="0.05" armature="0.01"')
    assert mujoco.MjModel.from_xml_string(mjcf).tendon_stiffness.any()
    model = built(mjcf)
    for name in ("tendon_stiffness", "tendon_damping", "tendon_limited"):
        assert not getattr(model, name).any(), name
    assert model.tendon_frictionloss.max() == 0.05, "stands for the friction of its ducts, which are built"
    assert model.tendon_armature.max() == 0.01, "stands for the rotor of its winch, which is built"
    what = "springs, dampers and stops of cables, such as extend"
    assert what in {change.what for change in changes_of(made(mjcf))}
    assert what not in {change.what for change in changes_of(made(finger()))}


@pytest.mark.parametrize(
    ("joint", "rest"),
    [('springref="0.2" range="-0.5 0.5"', 11), ('ref="0.1" range="-0.4 0.6"', -6)],
    ids=["springref", "ref without springref"],
)
def test_hinges_are_at_rest_in_the_pose_that_is_printed_and_lost_preload_is_told(joint: str, rest: int) -> None:
    mjcf = finger(joint=joint)
    model = built(mjcf)
    assert model.qpos_spring == pytest.approx(model.qpos0)
    told = {change.what: change for change in changes_of(made(mjcf))}
    preload = told["preload of 3 joints, most at bend_1"]
    assert preload.simulated == f"{0.3 * abs(np.deg2rad(rest)):.2f} N m, at rest at {rest} deg"
    assert preload.built.startswith("none")
    assert not [what for what in (change.what for change in changes_of(made(finger()))) if "preload" in what]


def test_a_cable_has_the_play_that_its_own_line_leaves() -> None:
    build = made(finger())
    thick = tuple(replace(winch, line=lines()[-1]) for winch in build.winches)
    told = {change.what: change for change in changes_of(replace(build, winches=thick))}["guides"]
    play_mm = max(bore.radius_mm for bore in build.bores) - lines()[-1].diameter_mm / 2
    assert f"{play_mm:.1f} mm off its line" in told.built
    assert lines()[-1].diameter_mm / 2 > 0.25


BENDS_BOTH_WAYS = '<joint name="bend_{0}" axis="0 1 0"', '<joint name="side_{0}" axis="1 0 0" stiffness="0.3"/>'


@pytest.mark.parametrize("material", ["tpu95a", "petg"], ids=["round necks", "single rods"])
def test_a_round_hinge_twists_and_that_is_told(material: str) -> None:
    """A round section has J = 2 I, so G J / l = E I / l / (1 + nu); nu is 0.5 for rubber and 0.3 for metals."""
    mjcf = finger()
    for number in (1, 2, 3):
        bend, side = (part.format(number) for part in BENDS_BOTH_WAYS)
        mjcf = mjcf.replace(bend, side + bend)
    build = build_robot(mjcf, [], printer_named("fdm"), material=material)
    told = {change.what: change for change in changes_of(build)}["twist about the limb, in 3 joints"]
    assert told.simulated == "rigid"
    stiffness = min(hinge.stiffness_n_m_rad for hinge in build.hinges.hinges.values())
    given = float(re.search(r"([\d.]+) N m/rad", told.built)[1])
    assert stiffness / 1.5 < given < stiffness / 1.3


def test_flat_necks_and_pairs_of_rods_resist_twist_more() -> None:
    """A strip has J = 4 I. Rods at 4 mm from the axis and clamped at both ends add 12 E I (y / g)^2 / g."""
    for material, share in (("tpu95a", lambda _: 1.4), ("petg", lambda free_mm: 0.7 + 12 * (4.0 / free_mm) ** 2)):
        build = build_robot(finger(), [], printer_named("fdm"), material=material)
        hinge = build.hinges.hinges[0]
        told = {change.what: change for change in changes_of(build)}["twist about the limb, in 3 joints"]
        given = float(re.search(r"([\d.]+) N m/rad", told.built)[1])
        assert given == pytest.approx(share(hinge.free_mm) * hinge.stiffness_n_m_rad, rel=0.01)


@pytest.mark.parametrize(
    ("limits", "what", "simulated"),
    [
        ('range="-0.1 0.1"', "stops of joints", "-6 to 6 deg"),
        ('range="0 1.5"', "stops of joints", "0 to 86 deg"),
        ('range="-1.5 1.5"', "range of joints", "-86 to 86 deg"),
        ("", "range of joints", "without limit"),
    ],
)
def test_only_walls_stop_a_joint_and_that_is_told(limits: str, what: str, simulated: str) -> None:
    mjcf = finger(joint=limits, stiffness=0.1)
    touch = made(mjcf).skeleton.gaps[0].touch_rad
    assert 0.5 < touch < 1.4
    assert built(mjcf).jnt_range == pytest.approx(np.array([[-touch, touch]] * 3), abs=1e-4)
    told = {change.what: change for change in changes_of(made(mjcf))}
    assert told[what].simulated == simulated
    assert told[what].built.startswith(f"-{np.rad2deg(touch):.0f} to {np.rad2deg(touch):.0f} deg")


@cache
def _angle_of_balance() -> float:
    """Return the angle at which MuJoCo's springs balance the largest pull of one cable, without weight [rad]."""
    model = mujoco.MjModel.from_xml_string(finger(joint=""))
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    data.ctrl[0] = 1.0
    mujoco.mj_step(model, data, 2000)
    assert np.abs(data.qvel).max() < 1e-6
    return float(np.abs(data.qpos).max())


@pytest.mark.parametrize("limits", ['range="-0.1 0.1"', 'range="-0.5 0.5"', ""])
def test_hinges_are_strained_as_far_as_cables_pull_until_parts_touch(limits: str) -> None:
    pulled = [gap.bend_rad for gap in made(finger(joint=limits)).skeleton.gaps]
    assert pulled == pytest.approx([_angle_of_balance()] * 3, rel=1e-3)
    assert pulled[0] > 1.05 * 10 * 0.0095 / 0.3, "the cable's moment arm grows as the joint bends"
    whole = made(finger(joint=limits, stiffness=0.01))
    assert [gap.bend_rad for gap in whole.skeleton.gaps] == [gap.touch_rad for gap in whole.skeleton.gaps]


def test_the_masses_are_told_apart_by_what_moves() -> None:
    """A piece fixed to the world may weigh another mass than simulated; it does not change how the robot moves."""
    whole = made(finger())
    masses = masses_of(whole)
    assert 0 < masses.moving_simulated_kg < masses.simulated_kg
    told = {change.what: change for change in changes_of(whole)}["mass of all pieces"]
    moving = round(1000 * masses.moving_built_kg, 1)
    fixed = round(1000 * masses.built_kg, 1) - moving
    assert f": {moving:.1f} g move, {fixed:.1f} g are fixed; as near as the infill" in told.built
