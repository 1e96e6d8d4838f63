"""`validate` as users call it: files, mounts, scenes, environments, and models that break things."""

from __future__ import annotations

import math
import re
from pathlib import Path

import faulty
import mujoco
import pytest
import robots

from aidsr.core.artifacts import ValidationReport
from aidsr.core.errors import UserError
from aidsr.mjcf.compile import compile_mjcf, load_mjcf
from aidsr.validation import validate
from aidsr.validation.engine import examine_text
from aidsr.validation.mount import mount_model


def codes(report: ValidationReport) -> list[str]:
    return [fault.code for fault in report.faults]


def test_a_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    path.write_text(robots.arm())
    assert validate(path) == validate(robots.arm())


def test_a_file_that_is_not_there_is_the_users_mistake(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot read the MJCF file"):
        validate(tmp_path / "nothing.xml")


def test_a_file_that_is_no_text_is_the_users_mistake(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    path.write_bytes(b"\xff\xfe\xff")
    with pytest.raises(UserError, match="UTF-8"):
        validate(path)


@pytest.mark.parametrize("text", ["", "hello", "<mujoco/>", "<mujoco><worldbody><body/></worldbody></mujoco>"])
def test_what_is_no_robot_is_a_report(text: str) -> None:
    report = validate(text)
    assert not report.stable
    assert report.errors


def test_measurements_and_versions_stand_in_the_report() -> None:
    report = validate(robots.arm())
    assert report.versions["mujoco"] == mujoco.__version__
    assert report.measurements["characteristic_length_m"] == pytest.approx(0.3, rel=0.02)
    assert set(report.measurements["effect_over_length"]) == {"m0", "m1", "m2", "m3"}


def test_a_scene_says_where_its_functional_part_is() -> None:
    text = """<mujoco><worldbody><body name="robot/arm" pos="0.1 0 0.7">
        <joint name="robot/bend"/><geom type="capsule" size="0.01" fromto="0 0 0 0 0 -0.2"/>
        <site name="robot/functional_part" pos="0 0 -0.2"/>
      </body></worldbody></mujoco>"""
    scene, alone = (examine_text(mjcf, drive=False).report for mjcf in (text, text.replace("functional_part", "tip")))
    assert scene.measurements["functional_part_m"] == pytest.approx([0.1, 0, 0.5])
    assert "functional_part_m" not in alone.measurements


def test_a_scene_says_where_its_functional_part_rests_and_is_pulled_to() -> None:
    # one hinge, no gravity: the cable's moment of 0.05 N m turns a spring of 0.1 N m/rad by 0.5 rad
    limb = """<mujoco><option timestep="0.001" gravity="0 0 0"/><worldbody>
      <body name="ball" pos="0.5 0 0"><freejoint/><geom size="0.01" mass="0.01"/></body>
      <body name="robot/base"><geom size="0.01" mass="0.1" pos="-0.03 0 0"/><body name="robot/link">
        <joint name="robot/bend" axis="0 1 0" stiffness="0.1" damping="0.01"/>
        <geom size="0.001" pos="0.1 0 0" mass="0.05"/><site name="robot/functional_part" pos="0.1 0 0"/>
      </body></body></worldbody>
      <tendon><fixed name="robot/cable"><joint joint="robot/bend" coef="0.01"/></fixed></tendon>
      <actuator><general name="robot/pull" tendon="robot/cable" ctrlrange="0 5" gainprm="-1"/></actuator></mujoco>"""
    measured = examine_text(limb).report.measurements
    assert measured["functional_part_at_rest_m"] == pytest.approx([0.1, 0, 0], abs=0.002)
    (half, held) = measured["functional_part_pulled_m"]["robot/pull"]
    assert held == pytest.approx([0.1 * math.cos(0.5), 0, 0.1 * math.sin(0.5)], abs=0.002)
    assert 0.0 < half[2] < held[2], "the command had not come to its end"
    assert measured["free_bodies_at_rest_m"] == {"ball": pytest.approx([0.5, 0, 0], abs=1e-6)}
    assert (
        "functional_part_pulled_m" not in examine_text(limb.replace("robot/functional_part", "tip")).report.measurements
    )


def test_a_report_survives_json() -> None:
    report = validate(faulty.arm(sag=10))
    assert ValidationReport.model_validate_json(report.model_dump_json()) == report


def test_a_free_robot_can_be_held_and_a_fixed_one_let_go() -> None:
    held = validate(robots.crawler(), mount="fixed")
    assert any("removed" in note for note in held.notes)
    assert held.stable
    loose = validate(robots.arm(), mount="free")
    assert any("added" in note for note in loose.notes)
    assert loose.stable


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('<body name="base">', '<body name="base" mocap="true">'),
        ('<geom name="base"', '<geom name="validation_ground"'),
        ("<option", '<compiler fusestatic="true"/><option'),
    ],
)
def test_a_robot_however_its_root_is_written_can_be_let_go(old: str, new: str) -> None:
    model = mount_model(load_mjcf(robots.arm().replace(old, new)), "free", None).model
    assert model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE
    assert model.body(model.jnt_bodyid[0]).name == "base"
    assert model.geom_type[0] == mujoco.mjtGeom.mjGEOM_PLANE


def test_a_robot_that_is_held_beside_its_table_still_passes_through_what_it_excludes() -> None:
    table = '<geom name="table" type="box" size="0.2 0.2 0.01" pos="0 0 0.01"/>'
    passes = '<contact><exclude body1="world" body2="trunk"/></contact></mujoco>'
    text = robots.crawler().replace("<worldbody>", f"<worldbody>{table}").replace("</mujoco>", passes)
    assert mount_model(load_mjcf(text), "fixed", None).model.nexclude == 1


def test_a_keyframe_does_not_keep_a_robot_from_being_held() -> None:
    key = f'<keyframe><key qpos="{"0 " * 6}1 {"0 " * 48}"/></keyframe>'
    assert validate(robots.crawler().replace("</mujoco>", f"{key}</mujoco>"), mount="fixed").stable


@pytest.mark.parametrize(("angle", "most"), [("degree", "45"), ("radian", "0.7")])
def test_a_range_that_is_dropped_is_told_as_it_is_written(angle: str, most: str) -> None:
    written = (
        robots.arm().replace("<option", f'<compiler angle="{angle}"/><option').replace('"-45 45"', f'"-{most} {most}"')
    )
    inverted = written.replace(f'"-{most} {most}"', f'"{most} -{most}"', 1)
    (fault,) = examine_text(inverted, drive=False).report.faults
    assert fault.message.startswith(f"joint range written from {most} down to -{most}: ")
    assert fault.measured == 2 * float(most)
    assert fault.unit == "by which the first number exceeds the second"


def test_two_roots_cannot_be_set_free() -> None:
    two = robots.arm().replace("<worldbody>", '<worldbody><body name="other"><geom size="0.01"/></body>')
    assert codes(validate(two, mount="free")) == ["disconnected"]


@pytest.mark.parametrize(
    ("constraint", "found"),
    [
        ('<weld body1="s11" body2="plate"/>', []),
        ('<weld site1="tip" site2="plate"/>', []),
        ('<connect site1="plate" site2="tip"/>', []),
        ('<connect body1="plate" anchor="0 0 0"/>', ["disconnected"]),
        ('<weld body1="s11" body2="plate" active="false"/>', ["disconnected"]),
    ],
)
def test_two_roots_are_one_robot_where_a_constraint_joins_them(constraint: str, found: list[str]) -> None:
    plate = '<body name="plate" pos="0 0 0.33"><freejoint/><geom size="0.02"/><site name="plate"/></body></worldbody>'
    text = robots.arm().replace("</worldbody>", plate)
    joined = text.replace("</mujoco>", f"<equality>{constraint}</equality></mujoco>")
    assert codes(examine_text(joined, drive=False).report) == found


def test_a_root_with_joints_cannot_be_set_free() -> None:
    hinged = robots.arm().replace('<body name="base">', '<body name="base"><joint name="swivel" axis="0 0 1"/>')
    assert codes(validate(hinged, mount="free")) == ["invalid_joint_placement"]


def test_what_hangs_on_a_removed_free_joint_goes_with_it() -> None:
    push = '<motor name="push" joint="root" gear="1 0 0 0 0 0" ctrlrange="-1 1"/></actuator>'
    report = validate(robots.crawler().replace("</actuator>", push), mount="fixed")
    assert report.measurements["actuators"] == 8


def test_gravity_is_felt_as_at_the_mount() -> None:
    """A limb too soft to stand may hang."""
    standing = faulty.arm(sag=14)
    assert codes(validate(standing)) == ["gravity_collapse"]
    ceiling = '<mujoco><worldbody><site name="mount" euler="180 0 0"/></worldbody></mujoco>'
    assert validate(standing, environment=ceiling).faults == ()


def test_the_environments_physics_hold() -> None:
    coarse = (
        '<mujoco><option timestep="0.02" integrator="Euler" density="3"><flag warmstart="disable"/></option></mujoco>'
    )
    stood, theirs = (
        mount_model(load_mjcf(robots.arm()), "auto", compile_mjcf(coarse)).model.opt,
        compile_mjcf(coarse).opt,
    )
    assert (stood.timestep, stood.integrator, stood.density) == (0.002, theirs.integrator, 3.0)
    assert stood.disableflags & mujoco.mjtDisableBit.mjDSBL_WARMSTART
    assert validate(robots.arm(), environment=coarse).measurements["timestep_s"] == 0.002
    fine = '<mujoco><option timestep="0.001"/></mujoco>'
    assert validate(robots.arm(), environment=fine).measurements["timestep_s"] == 0.001


def test_a_broken_environment_is_a_report() -> None:
    report = validate(robots.arm(), environment="<mujoco>")
    assert not report.stable
    assert all("environment" in fault.message for fault in report.faults)


def test_a_wrong_mount_is_the_users_mistake() -> None:
    with pytest.raises(UserError, match="auto, fixed, free"):
        validate(robots.arm(), mount="hanging")  # type: ignore[arg-type]


def _scene(robot: str, surroundings: str = "") -> str:
    environment = mujoco.MjSpec.from_string(
        f'<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody><geom name="floor" type="plane" '
        f'size="1 1 1" pos="0 0 -0.1"/><site name="mount"/>{surroundings}</worldbody></mujoco>'
    )
    environment.attach(mujoco.MjSpec.from_string(robot), prefix="robot/", site=environment.site("mount"))
    return environment.to_xml()


def test_a_scene_is_looked_at_for_the_robots_part() -> None:
    ball = '<body name="ball" pos="0.5 0 1"><freejoint/><geom name="ball" size="0.02"/></body>'
    report = validate(_scene(robots.arm(), ball))
    assert report.faults == ()
    assert report.measurements["actuators"] == 4


def test_a_robot_drawn_into_its_surroundings() -> None:
    wall = '<geom name="wall" type="box" size="0.05 0.05 0.05" pos="0.05 0 0.2"/>'
    (fault,) = validate(_scene(robots.arm(), wall)).faults
    assert fault.code == "initial_penetration"
    assert "wall" in fault.names
    assert any(name.startswith("robot/") for name in fault.names)


def test_a_mount_that_the_environment_moves_is_forgiven() -> None:
    lift = (
        '<body name="lift"><joint name="lift" type="slide" axis="0 0 1"/><geom size="0.01" pos="0 0 -0.05"/>{}</body>'
    )
    text = _scene(robots.arm()).replace('pos="0 0 -0.1"', 'pos="0 0 -1.1"')
    robot = re.search(r'<body name="robot/base".*?</body>(?=\s*</worldbody>)', text, re.DOTALL)
    assert robot
    moved = text.replace(robot.group(), lift.format(robot.group()))
    assert validate(moved).stable


def test_a_diverging_model_is_named_and_nothing_else() -> None:
    (fault,) = validate(faulty.unstable()).faults
    assert fault.code == "numerical_instability"
    assert fault.first_time_s is not None
    assert fault.likely_cause


@pytest.mark.parametrize(
    ("pattern", "replacement"),
    [
        (r'timestep="[^"]*"', 'timestep="0"'),
        (r'timestep="[^"]*"', 'timestep="1e-320"'),
        (r'(<site name="t0_[^"]*") pos="[^"]*"', r'\1 pos="1e200 0 0"'),
    ],
)
def test_numbers_that_overflow_are_a_report(pattern: str, replacement: str) -> None:
    text, changes = re.subn(pattern, replacement, robots.arm(timestep_s=0.002), count=1)
    assert changes == 1
    assert "load" in {fault.layer for fault in validate(text).errors}


@pytest.mark.parametrize(("group", "is_off"), [(-1, False), (5, True), (31, False)])
def test_actuators_of_any_group_are_driven_unless_their_group_is_off(group: int, is_off: bool) -> None:
    text = robots.arm().replace('gear="-1"', f'gear="-1" group="{group}"')
    off = text.replace("<option", '<option actuatorgroupdisable="5"')
    assert codes(validate(off)) == ["actuator_too_weak"] * is_off


def test_a_model_that_takes_too_long_is_a_report() -> None:
    """A time step so small that the tests would run for days."""
    (fault,) = validate(robots.arm(timestep_s=1e-9)).faults
    assert fault.code == "load_error"
    assert "1e-09 s" in fault.message
