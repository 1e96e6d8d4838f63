"""The summary says what stands where at the start of an episode, in world coordinates."""

from typing import Any

import numpy as np
import pytest

from aidsr.core.artifacts import EnvironmentSummary
from aidsr.core.errors import MjcfError
from aidsr.sim.environment_summary import summarize_environment
from scenes import small_arm

ENVIRONMENT = """
<mujoco>
  <compiler angle="degree"/>
  <option timestep="0.005" gravity="0 0 -1.62"/>
  <worldbody>
    <geom name="floor" type="plane" size="2 2 0.1"/>
    <site name="mount_wall" pos="0.1 0 0.2" zaxis="1 0 0"/>
    <site name="goal" pos="0 0 1"/>
    <body name="rail" pos="0 0 0.5" euler="0 0 90">
      <joint name="slide" type="slide" axis="1 0 0" range="-0.1 0.2"/>
      <geom name="rail" type="box" size="0.01 0.02 0.03" mass="0.5"/>
      <body name="wrist" pos="0.1 0 0">
        <joint name="turn" axis="0 0 1" range="-45 90"/>
        <geom name="wrist" type="capsule" size="0.01 0.05" mass="0.25"/>
        <site name="mount" pos="0 0 -0.05" euler="180 0 0"/>
      </body>
    </body>
    <body name="ball" pos="1 0 0.1"><freejoint/><geom type="sphere" size="0.1" mass="1"/></body>
    <body name="eye" pos="2 0 0">
      <joint type="ball" range="0 30"/><geom type="ellipsoid" size="0.1 0.2 0.3" mass="1"/>
    </body>
  </worldbody>
  <actuator><position name="slide" joint="slide" kp="1"/></actuator>
  <sensor><jointpos name="slide_position" joint="slide"/></sensor>
</mujoco>
"""


def summarized(mjcf: str, *, may_hold_robot: bool = False) -> dict[str, Any]:
    return summarize_environment(mjcf, may_hold_robot=may_hold_robot).model_dump(mode="json")


@pytest.fixture(scope="module")
def summary() -> EnvironmentSummary:
    return EnvironmentSummary.model_validate(summarized(ENVIRONMENT))


def test_it_names_the_world_the_sensors_and_the_actuators(summary: EnvironmentSummary) -> None:
    assert summary.gravity_m_s2 == (0.0, 0.0, -1.62)
    assert summary.timestep_s == 0.005
    assert summary.sensors == ("slide_position",)
    assert summary.actuators == ("slide: commands the position of slide",)


def test_it_says_what_a_command_means() -> None:
    actuators = (
        '<intvelocity name="feed" joint="rail" kp="100" ctrlrange="-0.05 0.05" actrange="0 0.4"/>'
        '<position name="turn" joint="door" kp="10" ctrlrange="0 1.5707963"/>'
        '<velocity name="spin" joint="door" kv="1" ctrlrange="-1 1"/>'
        '<motor name="push" joint="rail" ctrlrange="-2 2"/>'
        '<motor name="blow" site="mount" gear="1 0 0 0 0 0"/>'
    )
    world = (
        '<mujoco><worldbody><site name="mount"/><body><joint name="rail" type="slide"/><geom size="0.1"/></body>'
        '<body><joint name="door"/><geom size="0.1"/></body></worldbody>'
    )
    assert summarize_environment(f"{world}<actuator>{actuators}</actuator></mujoco>").actuators == (
        "feed: commands the speed of rail, -0.05 to 0.05 m/s, until it is at an end of 0 to 0.4 m",
        "turn: commands the position of door, 0 to 90 deg",
        "spin: commands the speed of door, -57.2958 to 57.2958 deg/s",
        "push: commands the force on rail, -2 to 2 N",
        "blow",
    )


def test_a_gear_or_a_gain_between_command_and_joint_is_reckoned_with() -> None:
    actuators = (
        '<motor name="push" joint="rail" gear="5" ctrlrange="-2 1"/>'
        '<motor name="back" joint="rail" gear="-1" ctrlrange="-2 1"/>'
        '<position name="turn" joint="door" kp="10" gear="2" ctrlrange="0 3.1415926"/>'
        '<general name="rising" joint="rail" dyntype="integrator" ctrlrange="-1 1"/>'
    )
    world = (
        '<mujoco><worldbody><body><joint name="rail" type="slide"/><geom size="0.1"/></body>'
        '<body><joint name="door"/><geom size="0.1"/></body></worldbody>'
    )
    mjcf = f"{world}<actuator>{actuators}</actuator></mujoco>"
    assert summarize_environment(mjcf, may_hold_robot=True).actuators == (
        "push: commands the force on rail, -10 to 5 N",
        "back: commands the force on rail, -1 to 2 N",
        "turn: commands the position of door, 0 to 90 deg",
        "rising",
    )


def test_a_mount_says_where_a_robot_would_point_and_what_moves_it(summary: EnvironmentSummary) -> None:
    wall, wrist = summary.mounts
    assert (wall.name, wall.position_m, wall.z_axis, wall.moved_by) == (
        "mount_wall",
        (0.1, 0.0, 0.2),
        (1.0, 0.0, 0.0),
        (),
    )
    assert (wrist.name, wrist.moved_by) == ("mount", ("slide", "turn"))
    np.testing.assert_allclose(wrist.position_m, (0, 0.1, 0.45), atol=1e-9)
    np.testing.assert_allclose(wrist.z_axis, (0, 0, -1), atol=1e-9)
    np.testing.assert_allclose(wrist.x_axis, (0, 1, 0), atol=1e-9)


def test_bodies_come_with_joints_in_words_and_shapes_in_the_world(summary: EnvironmentSummary) -> None:
    bodies = {body.name: body for body in summary.bodies}
    assert list(bodies) == ["world", "rail", "wrist", "ball", "eye"]
    assert bodies["rail"].joints == ("slide: slide along 0 1 0, -0.1 to 0.2 m",)
    assert bodies["wrist"].joints == ("turn: hinge about 0 0 1, -45 to 90 deg",)
    assert bodies["ball"].joints == ("joint: free",)
    assert bodies["eye"].joints == ("joint: ball, 0 to 30 deg",)
    assert [name for name, body in bodies.items() if body.free] == ["ball"]
    assert (bodies["wrist"].parent, bodies["wrist"].mass_kg) == ("rail", 0.25)
    floor, capsule = bodies["world"].geoms[0], bodies["wrist"].geoms[0]
    assert (floor.shape, floor.size_m) == ("plane", (2.0, 2.0))
    assert (capsule.shape, capsule.size_m, capsule.position_m) == ("capsule", (0.01, 0.05), (0.0, 0.1, 0.5))
    assert bodies["eye"].geoms[0].size_m == (0.1, 0.2, 0.3)


def test_sites_come_with_their_bodies(summary: EnvironmentSummary) -> None:
    assert {(site.name, site.body) for site in summary.sites} == {
        ("mount_wall", "world"),
        ("goal", "world"),
        ("mount", "wrist"),
    }


def test_a_world_without_shapes_is_not_listed() -> None:
    found = summarized('<mujoco><worldbody><site name="mount"/></worldbody></mujoco>')
    assert EnvironmentSummary.model_validate(found).bodies == ()


def test_it_is_read_in_a_process_of_its_own(summary: EnvironmentSummary) -> None:
    assert summarize_environment(ENVIRONMENT) == summary
    with pytest.raises(MjcfError):
        summarize_environment("<mujoco><worldbody>")


def test_a_shape_says_which_way_it_points() -> None:
    lying = '<mujoco><worldbody><geom type="cylinder" size="0.02 0.1" euler="0 90 0"/></worldbody></mujoco>'
    (world,) = summarize_environment(lying).bodies
    assert world.geoms[0].z_axis == pytest.approx((1, 0, 0))
    yawed = '<mujoco><worldbody><geom type="box" size="0.02 0.1 0.3" euler="0 0 90"/></worldbody></mujoco>'
    (world,) = summarize_environment(yawed).bodies
    assert (world.geoms[0].x_axis, world.geoms[0].z_axis) == ((0, 1, 0), (0, 0, 1))


def test_a_shape_says_how_it_grips_and_whether_anything_touches_it() -> None:
    mjcf = """<mujoco><worldbody>
        <geom type="plane" size="1 1 1"/>
        <body><geom type="sphere" size="0.1" friction="0.4 0.01" priority="2"/></body>
        <body><geom type="sphere" size="0.1" contype="0" conaffinity="0"/></body>
      </worldbody></mujoco>"""
    plane, ball, ghost = (body["geoms"][0] for body in summarized(mjcf)["bodies"])
    assert (plane["friction"], plane["priority"], plane["solid"]) == ([1.0, 0.005, 0.0001], 0, True)
    assert (ball["friction"], ball["priority"], ball["solid"]) == ([0.4, 0.01, 0.0001], 2, True)
    assert ghost["solid"] is False


def test_a_joint_says_what_moving_it_takes() -> None:
    mjcf = """<mujoco><compiler angle="radian"/><worldbody>
        <body><joint name="press" type="slide" stiffness="60" springref="-0.0025"/><geom size="0.1"/></body>
        <body><joint name="open" type="slide" frictionloss="0.4"/><geom size="0.1"/></body>
        <body><joint name="turn" stiffness="0.1" frictionloss="0.02"/><geom size="0.1"/></body>
      </worldbody></mujoco>"""
    assert [body["joints"][0] for body in summarized(mjcf)["bodies"]] == [
        "press: slide along 0 0 1, spring 60 N/m from -0.0025 m",
        "open: slide along 0 0 1, friction 0.4 N",
        "turn: hinge about 0 0 1, spring 0.1 N m/rad, friction 0.02 N m",
    ]


@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ('name="rail" pos', 'name="robot/rail" pos', "found robot/rail"),
        ("<option", '<default><default class="robot/soft"/></default><option', "found robot/soft"),
        ('timestep="0.005"', 'timestep="0"', "must be above 0 s, found 0 s"),
        ('timestep="0.005"', 'timestep="-0.005"', "must be above 0 s, found -0.005 s"),
    ],
)
def test_where_no_robot_can_be_placed_is_refused_at_the_first_look(old: str, new: str, found: str) -> None:
    text = ENVIRONMENT.replace(old, new)
    with pytest.raises(MjcfError, match=found) as caught:
        summarized(text)
    assert len(caught.value.faults) == 1
    assert summarized(text, may_hold_robot=True)["mounts"]


def test_a_robot_is_no_environment() -> None:
    with pytest.raises(MjcfError, match="this is a robot, not an environment: it has cables with actuators") as caught:
        summarize_environment(small_arm())
    assert "--robot" in str(caught.value)
    with_a_mount = small_arm().replace("<worldbody>", '<worldbody><site name="mount" pos="1 0 0"/>')
    assert summarize_environment(with_a_mount).mounts[0].name == "mount"
    cable = small_arm().partition("<actuator>")[0] + "</mujoco>"
    assert summarize_environment(cable).mounts == (), "a cable that nothing pulls may be part of the surroundings"
