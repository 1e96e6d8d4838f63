"""What is read off a robot: how hard a cable is pulled, and what of it nobody builds."""

import math

import mujoco
import pytest
from fingers import WINCH, finger

from aidsr.core.errors import MjcfError
from aidsr.fabrication.anatomy import read_anatomy
from aidsr.fabrication.as_built import as_built
from aidsr.fabrication.build import build_robot
from aidsr.fabrication.printers import printer_named

MOTOR = '<motor tendon="flex" gear="{}" {}/>'


@pytest.mark.parametrize(
    ("gear", "limits", "pull_n"),
    [
        (-10, 'forcerange="0 1"', 10.0),
        (10, 'forcerange="-1 0.5"', 10.0),
        (10, 'forcerange="0 1"', 0.0),
        (-10, "", math.inf),
    ],
)
def test_a_cable_feels_the_force_times_the_gear(gear: int, limits: str, pull_n: float) -> None:
    cable, _ = read_anatomy(finger(actuators=MOTOR.format(gear, limits))).cables
    assert cable.largest_pull_n == pytest.approx(pull_n)


@pytest.mark.parametrize(
    ("joint", "limits"),
    [
        ("", (-math.inf, math.inf)),
        ('range="0 0.4"', (0.0, 0.4)),
        ('range="-0.1 0.5" ref="0.2"', (-0.3, 0.3)),
        ('type="ball" range="0 0.4"', (-0.4, 0.4)),
    ],
)
def test_limits_count_from_the_drawn_pose(joint: str, limits: tuple[float, float]) -> None:
    assert read_anatomy(finger(joint=joint)).joints[0].limits_rad[0] == pytest.approx(limits)


TWICE = "".join(WINCH.format(name=name, tendon="flex") for name in ("strong", "weak"))
LOOP = '<equality><connect name="tie" body1="link_1" body2="link_3" anchor="0 0 0" active="{}"/></equality>'
WELD = '<equality><weld name="tie" body1="link_1" body2="link_3" {}/></equality>'
COUPLED = '<equality><joint name="same" joint1="bend_1" joint2="bend_2" active="{}"/></equality>'


@pytest.mark.parametrize(
    ("mjcf", "told"),
    [
        (finger(), set()),
        (finger(actuators=TWICE), {("cable_shared", "flex")}),
        (finger(extra=COUPLED.format("true")), {("joints_coupled", "same")}),
        (finger(extra=COUPLED.format("false")), set()),
        (finger(extra=LOOP.format("true")), {("loop_open", "tie")}),
        (finger(extra=LOOP.format("false")), set()),
        (finger(extra=WELD.format("")), set()),
        (finger(extra=WELD.format('relpose="0 0 0.04 1 0 0 0"')), set()),
        (finger(extra=WELD.format('anchor="0 0 -0.04" relpose="0 0 0 1 0 0 0"')), set()),
        (finger(extra=WELD.format('relpose="0 0 0.03 1 0 0 0"')), {("loop_open", "tie")}),
        (finger(extra=WELD.format('relpose="0 0 0.04 0.98 0 0.2 0"')), {("loop_open", "tie")}),
        (finger().replace('name="link_1"', 'name="link_1" gravcomp="1"'), {("weight_lifted", "link_1")}),
        (finger().replace('name="base"', 'name="base" gravcomp="1"'), set()),
    ],
)
def test_what_nobody_builds_is_told(mjcf: str, told: set[tuple[str, str]]) -> None:
    faults = build_robot(mjcf, [], printer_named("fdm")).faults
    codes = ("cable_shared", "joints_coupled", "weight_lifted", "loop_open")
    assert {(fault.code, name) for fault in faults if fault.code in codes for name in fault.names} == told


def test_a_weld_in_another_pose_than_the_drawn_one_keeps_two_parts() -> None:
    welded, bent = (finger(extra=WELD.format(relpose)) for relpose in ("", 'relpose="0 0 0.04 0.98 0 0.2 0"'))
    assert len(read_anatomy(welded).parts) == 3
    assert len(read_anatomy(bent).parts) == 4
    (fault,) = (fault for fault in build_robot(bent, [], printer_named("fdm")).faults if fault.code == "loop_open")
    assert "relative pose" in fault.message
    assert "relpose" in fault.cure


CROSS = """<body name="cross" pos="0 0 0.02"><inertial pos="0 0 0" mass="0.001" diaginertia="1e-7 1e-7 1e-7"/>
<joint name="across" axis="1 0 0" stiffness="0.3" damping="0.01" range="-0.5 0.5"/>"""


def test_a_universal_joint_of_two_bodies_is_one_joint() -> None:
    mjcf = finger().replace('<body name="link_2" pos="0 0 0.02">', f'{CROSS}<body name="link_2">')
    mjcf = mjcf.replace("</worldbody>", "</body></worldbody>")
    anatomy = read_anatomy(mjcf)
    assert [part.name for part in anatomy.parts] == ["base", "link_1", "link_2", "link_3"]
    assert [joint.names for joint in anatomy.joints] == [("bend_1",), ("across", "bend_2"), ("bend_3",)]
    assert (anatomy.joints[1].parent, anatomy.joints[1].child) == (1, 2)
    whole = build_robot(mjcf, [], printer_named("fdm"))
    assert whole.hinges.hinges[1].kind == "round"
    model = mujoco.MjModel.from_xml_string(as_built(whole, mjcf))
    assert model.joint("across").stiffness[0] == model.joint("bend_2").stiffness[0]


@pytest.mark.parametrize(
    ("worldbody", "named"),
    [
        ("", "the robot has no solid shape"),
        ('<body name="lump"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>', "lump has no solid shape"),
        ('<body name="stand"><body name="bar"><joint/><geom size="0.01"/></body></body>', "stand has no solid shape"),
        ('<body><geom size="0.01"/><body name="end"><joint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
         "</body></body>", "end has no solid shape"),
        ('<body><geom size="0.01"/><body name="fork"><joint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
         '<body><joint/><geom size="0.01"/></body><body><joint/><geom size="0.01"/></body></body>'
         "</body>", "fork has no solid shape"),
    ],
)  # fmt: skip
def test_a_body_that_cannot_be_printed_is_refused_by_name(worldbody: str, named: str) -> None:
    with pytest.raises(MjcfError, match=named):
        read_anatomy(f"<mujoco><worldbody>{worldbody}</worldbody></mujoco>")
