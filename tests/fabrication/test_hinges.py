"""Hinges have the stiffness that was simulated, and joints that cannot be made are told."""

import math

import pytest
from exported import ROBOTS, made, mjcf
from fingers import finger

from aidsr.core.errors import UserError
from aidsr.fabrication.anatomy import read_anatomy
from aidsr.fabrication.build import build_robot
from aidsr.fabrication.hinges import design_hinges
from aidsr.fabrication.materials import LINE_SAFETY, line_for, lines, material_for
from aidsr.fabrication.printers import printer_named
from aidsr.fabrication.skeleton import Skeleton


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("material", ["tpu95a", "petg"])
def test_hinges_have_the_stiffness_of_the_joints(robot: str, material: str) -> None:
    robot_made = made(robot, material)
    assert len(robot_made.hinges.hinges) == len(robot_made.anatomy.joints)
    for index, hinge in robot_made.hinges.hinges.items():
        asked = robot_made.anatomy.joints[index].stiffness_n_m_rad[0]
        assert hinge.stiffness_n_m_rad == pytest.approx(asked, rel=0.05)
        assert hinge.strain <= hinge.allowed_strain


def test_a_rod_bends_as_the_beam_formula_says() -> None:
    robot_made = made("arm", "petg")
    (backbone,) = robot_made.hinges.backbones
    for hinge in robot_made.hinges.hinges.values():
        inertia = math.pi * (backbone.diameter_mm / 1000) ** 4 / 64
        stiffness = backbone.count * backbone.rod.young_modulus_pa * inertia / (hinge.free_mm / 1000)
        assert hinge.stiffness_n_m_rad == pytest.approx(stiffness, rel=1e-6)


def test_a_flat_neck_has_the_thickness_of_the_beam_formula() -> None:
    robot_made = made("gripper", "tpu95a")
    hinge = robot_made.hinges.hinges[0]
    assert hinge.kind == "flat"
    modulus, free = robot_made.material.young_modulus_pa, hinge.free_mm / 1000
    asked = robot_made.anatomy.joints[0].stiffness_n_m_rad[0]
    exact = (12 * asked * free / (modulus * hinge.width_mm / 1000)) ** (1 / 3)
    assert hinge.thickness_mm == pytest.approx(1000 * exact, abs=0.03)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (
            ('<joint name="seg01_bend_x" axis="1 0 0"/>', '<joint name="seg01_bend_x" type="slide" axis="1 0 0"/>'),
            "slides",
        ),
        (
            ('<joint name="seg01_bend_x" axis="1 0 0"/>', '<joint name="seg01_bend_x" axis="1 0 0" stiffness="0"/>'),
            "spring",
        ),
        (
            ('<joint name="seg01_bend_x" axis="1 0 0"/>', '<joint name="seg01_bend_x" axis="1 0 0" pos="0 0 .005"/>'),
            "meet",
        ),
    ],
)
def test_joints_that_no_rod_can_stand_for_are_told(change: tuple[str, str], word: str) -> None:
    text = mjcf("arm")
    assert change[0] in text
    anatomy = read_anatomy(text.replace(*change))
    material = material_for(printer_named("fdm"), "petg")[0]
    faults = design_hinges(anatomy, Skeleton(anatomy), material).faults
    assert [fault.code for fault in faults if word in fault.message] == ["joint_not_elastic"]


def _axis_of_link_2(axis: str) -> str:
    return finger().replace('name="bend_2" axis="0 1 0"', f'name="bend_2" axis="{axis}"')


CROSSED_BY_TWIST = finger().replace(
    '<joint name="bend_2"', '<joint name="twist_2" axis="0 0 1" stiffness="0.3" damping="0.01"/><joint name="bend_2"'
)


@pytest.mark.parametrize("material", ["tpu95a", "petg"])
@pytest.mark.parametrize(
    ("mjcf", "told"),
    [
        (_axis_of_link_2("0 1 0.2"), []),
        (_axis_of_link_2("0 0 1"), ["bend_2"]),
        (_axis_of_link_2("0 1 -1"), ["bend_2"]),
        (CROSSED_BY_TWIST, ["twist_2"]),
    ],
    ids=["nearly across", "along", "oblique", "one of two"],
)
def test_a_hinge_that_twists_the_limb_is_not_built_as_one_that_bends_it(
    mjcf: str, told: list[str], material: str
) -> None:
    anatomy = read_anatomy(mjcf)
    hinges = design_hinges(anatomy, Skeleton(anatomy), material_for(printer_named("fdm"), material)[0])
    faults = [fault for fault in hinges.faults if fault.code == "joint_not_elastic"]
    assert [name for fault in faults for name in fault.names if name in told] == told
    assert bool(faults) == bool(told)
    if told:
        assert "twist" in faults[0].message
        assert "perpendicular to the limb" in faults[0].cure
        assert 1 not in hinges.hinges


def test_a_joint_too_stiff_for_any_rod_is_told() -> None:
    text = mjcf("arm").replace('stiffness="', 'stiffness="99')
    anatomy = read_anatomy(text)
    material = material_for(printer_named("fdm"), "petg")[0]
    assert "hinge_stiffness" in {fault.code for fault in design_hinges(anatomy, Skeleton(anatomy), material).faults}


@pytest.mark.parametrize(
    ("stiffness", "told"),
    [
        (0.3, []),
        (4.0, [("warning", pytest.approx(10.0))]),
        (20.0, [("error", pytest.approx(19.0)), ("warning", pytest.approx(10.0))]),
    ],
    ids=["slender", "thicker than its gap of 10 mm", "between cables 19 mm apart"],
)
def test_necks_too_thick_for_their_gap_or_their_cables_are_told(stiffness: float, told: list) -> None:
    anatomy = read_anatomy(finger(stiffness=stiffness))
    hinges = design_hinges(anatomy, Skeleton(anatomy), material_for(printer_named("fdm"), "tpu95a")[0])
    assert [(fault.severity, fault.limit) for fault in hinges.faults if fault.code == "hinge_stiffness"] == told
    assert len(hinges.hinges) == 3


def test_a_limb_whose_necks_would_lie_in_its_cables_way_is_made_on_rods() -> None:
    assert not build_robot(finger(stiffness=20.0), [], printer_named("fdm")).material.elastomer


CROSSED = '<joint name="across_{0}" axis="1 0 0" stiffness="0.3" damping="0.01"/>'
"""A second hinge through the point of the first."""


def _links_that_turn(axes: str) -> str:
    """Return a finger of links that turn about an axis each ("y", "x", "-y"), or about two ("xy") or three ("b")."""
    kinds = axes.split()
    mjcf = finger([f"link_{number}" for number in range(1, len(kinds) + 1)], joint="")
    for number, kind in enumerate(kinds, start=1):
        joint = f'<joint name="bend_{number}" axis="0 1 0"'
        turned = {"x": joint.replace("0 1 0", "1 0 0"), "-y": joint.replace("0 1 0", "0 -1 0")}
        turned |= {"b": f'<joint name="bend_{number}" type="ball"', "xy": CROSSED.format(number) + joint}
        mjcf = mjcf.replace(joint, turned.get(kind, joint))
    return mjcf


@pytest.mark.parametrize("axes", ["y x y x", "y xy", "xy y", "y b"])
def test_no_rods_pass_joints_that_turn_about_different_axes(axes: str) -> None:
    """Two glued rods in the plane of a bend resist it with 2 E A y^2 / g, as the flanges of a beam, and hardly bend."""
    anatomy = read_anatomy(_links_that_turn(axes))
    faults = design_hinges(anatomy, Skeleton(anatomy), material_for(printer_named("fdm"), "petg")[0]).faults
    (fault,) = [fault for fault in faults if fault.code == "hinge_stiffness"]
    assert "about different axes" in fault.message
    assert "parallel" in fault.cure
    assert fault.names == tuple(name for joint in anatomy.joints for name in joint.names)


@pytest.mark.parametrize(("axes", "kind"), [("y -y y", "pair"), ("xy xy", "rod"), ("xy b", "rod")])
def test_one_backbone_passes_joints_that_turn_alike(axes: str, kind: str) -> None:
    anatomy = read_anatomy(_links_that_turn(axes))
    hinges = design_hinges(anatomy, Skeleton(anatomy), material_for(printer_named("fdm"), "petg")[0])
    assert {hinge.kind for hinge in hinges.hinges.values()} == {kind}
    assert len(hinges.backbones) == 1


def test_guides_at_unequal_distances_leave_the_joint_in_the_middle_of_its_gap() -> None:
    """A neck bends about its middle, so one from -2 to +9 mm would turn 3.5 mm away from the simulated joint."""
    mjcf = finger(joint="").replace('0.0095 0 0.015"', '0.0095 0 0.018"').replace('0.0095 0 0.005"', '0.0095 0 0.009"')
    anatomy = read_anatomy(mjcf)
    first, second, _ = Skeleton(anatomy).gaps
    assert (first.before_mm, first.after_mm) == pytest.approx((1.0, 1.0)), "a guide of the base at 9 mm of 10"
    assert (second.before_mm, second.after_mm) == pytest.approx((2.0, 2.0))
    assert second.touch_rad == pytest.approx(2 * math.atan(2.0 / 9.5))
    hinges = design_hinges(anatomy, Skeleton(anatomy), material_for(printer_named("fdm"), "tpu95a")[0]).hinges
    assert hinges[1].free_mm == pytest.approx(4.0)


def test_what_a_printer_cannot_print_is_refused() -> None:
    with pytest.raises(UserError, match="tough2000"):
        material_for(printer_named("sla"), "tpu95a")
    with pytest.raises(UserError, match="fdm, sla"):
        printer_named("laser")


def test_lines_hold_four_times_their_pull() -> None:
    for pull_n in (10.0, 60.0, 150.0):
        line = line_for(pull_n)
        assert line is not None
        assert line.breaking_n >= LINE_SAFETY * pull_n
    assert line_for(max(line.breaking_n for line in lines())) is None
