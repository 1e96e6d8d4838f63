"""What of a compiled model is out of scope, and what only looks like it; `tests/validation` has a robot for each."""

from __future__ import annotations

import pytest

from aidsr.mjcf.compile import compile_mjcf
from aidsr.sim.scope import find_out_of_scope
from aidsr.sim.soft_body import read_soft_body
from aidsr.sim.structure import read_structure
from scenes import builtin_scene, changed_arm, small_arm, small_scene


def codes(mjcf: str) -> set[str]:
    model = compile_mjcf(mjcf)
    return {finding.code for finding in find_out_of_scope(model, read_structure(model))}


@pytest.mark.parametrize("task", ["flat_ground", "gap", "drawer_opening", "simple_grasping"])
def test_built_in_robots_at_their_tasks_are_in_scope(task: str) -> None:
    assert codes(builtin_scene(task)) == set()


def test_motors_of_the_environment_are_not_the_robots() -> None:
    model = compile_mjcf(small_scene("drawer_opening"))
    structure = read_structure(model)
    assert model.nactuator > len(structure.actuators)
    assert structure.sensors, "a sensor without a name is the robot's where what it measures is"
    assert find_out_of_scope(model, structure) == ()


def test_a_motor_of_the_robot_is_found_in_its_scene() -> None:
    scene = small_scene("drawer_opening", third='<motor name="turn" joint="bend1" ctrlrange="-1 1"/>')
    (finding,) = [found for found in find_out_of_scope(*_read(scene)) if found.code == "motorized_joint"]
    assert finding.names == ("robot/turn",)
    assert (finding.measured, finding.limit) == (1, 0)


def _read(mjcf: str):
    model = compile_mjcf(mjcf)
    return model, read_structure(model)


def test_a_joint_that_only_a_stiff_spring_holds_is_no_axle() -> None:
    assert codes(changed_arm((' range="-40 40"', ""))) == set()
    assert codes(changed_arm((' range="-40 40"', ""), ('stiffness="0.2"', 'stiffness="0"'))) >= {"wheel"}


@pytest.mark.parametrize(("apart_m", "wheel"), [(0.002, True), (0.03, False)])
def test_hinges_about_one_line_turn_as_one(apart_m: float, wheel: bool) -> None:
    ranges = (' range="-40 40"', ' range="-100 100"'), ('stiffness="0.2"', 'stiffness="0.005"')
    assert codes(changed_arm(*ranges)) == set()
    inner = '<geom type="capsule" size="0.004" fromto="0 -0.02 0 0 0.02 0" mass="0.005"/>'
    for k in range(2):
        inner = (
            f'<body name="disc{k}" pos="{apart_m} 0.01 0"><joint axis="0 1 0" range="-100 100" damping="0.001"/>'
            f'<geom size="0.004" mass="0.001"/>{inner}</body>'
        )
    found = codes(changed_arm(('<body name="base">', f'<body name="base">{inner}')))
    assert ("wheel" in found) == wheel


def test_a_limb_too_stiff_for_its_cables_counts_as_rigid() -> None:
    model, structure = _read(small_arm())
    soft = read_soft_body(model, structure, structure.tendon_actuators)
    assert len(soft.bent) == 4
    assert soft.length_m == pytest.approx(0.24)
    model, structure = _read(small_arm().replace('stiffness="0.2"', 'stiffness="200"'))
    soft = read_soft_body(model, structure, structure.tendon_actuators)
    assert soft.bent == ()
    assert soft.largest_part_m > 0.24
    assert "few_bent_joints" in {finding.code for finding in find_out_of_scope(model, structure)}


def test_damping_that_holds_a_joint_for_a_whole_episode_makes_it_rigid() -> None:
    assert "few_bent_joints" in codes(small_arm(damping=2000.0))


JAW = (
    '<body name="jaw" pos="0.05 0 0"><joint name="jaw" axis="0 1 0" range="-40 40" stiffness="0.2" damping="0.01"/>'
    '<geom type="capsule" fromto="0.01 0 0 0.04 0 0" size="0.004" mass="0.005"/></body>'
)
GEARS = {
    "a joint": '</tendon><equality><joint joint1="jaw" joint2="bend1" polycoef="0 0.6 0 0 0"/></equality>',
    "by its square": '</tendon><equality><joint joint1="jaw" joint2="bend1" polycoef="0 0 2 0 0"/></equality>',
    "leads": '</tendon><equality><joint joint1="bend2" joint2="jaw" polycoef="0 0.6 0 0 0"/></equality>',
    "one by one": (
        '</tendon><equality><joint joint1="more" joint2="bend1"/><joint joint1="jaw" joint2="more"/></equality>'
    ),
    "tendons": (
        '<fixed name="sum"><joint joint="bend1" coef="1"/><joint joint="bend2" coef="1"/></fixed>'
        '<fixed name="own"><joint joint="jaw" coef="1"/></fixed></tendon>'
        '<equality><tendon tendon1="own" tendon2="sum"/></equality>'
    ),
}


@pytest.mark.parametrize("gear", GEARS.values(), ids=GEARS)
def test_a_part_geared_to_a_limb_is_a_linkage(gear: str) -> None:
    more = JAW.replace("jaw", "more").replace("0.05 0 0", "0 0.05 0")
    jaws = ('<body name="base">', f'<body name="base">{JAW}{more}')
    assert "cable_on_linkage" not in codes(changed_arm(jaws))
    assert "cable_on_linkage" in codes(changed_arm(jaws, ("</tendon>", gear)))


PINS = {
    "pinned": '<connect body1="jaw" body2="seg1" anchor="0.01 0 0.02"/>',
    "welded": '<weld body1="jaw" body2="seg1"/>',
}


@pytest.mark.parametrize("pin", PINS.values(), ids=PINS)
def test_a_part_joined_to_a_limb_on_a_hinge_of_its_own_is_a_linkage(pin: str) -> None:
    jaws = ('<body name="base">', f'<body name="base">{JAW}')
    assert "cable_on_linkage" in codes(changed_arm(jaws, ("</tendon>", f"</tendon><equality>{pin}</equality>")))


@pytest.mark.parametrize("joint", ["connect", "weld"])
def test_limbs_whose_ends_are_joined_are_one_soft_body(joint: str) -> None:
    other, passive = '<body name="base">', ""
    for i in (4, 3, 2, 1):
        passive = (
            f'<body name="other{i}" pos="{0.03 if i == 1 else 0} 0 0.06"><joint axis="0 1 0" stiffness="0.2" '
            f'damping="0.02" range="-40 40"/><geom type="capsule" size="0.008" fromto="0 0 0 0 0 0.05" '
            f'mass="0.005"/>{passive}</body>'
        )
    anchor = 'anchor="0 0 0.05"' if joint == "connect" else ""
    end = f'</tendon><equality><{joint} body1="other4" body2="seg4" {anchor}/>'
    assert codes(changed_arm((other, other + passive), ("</tendon>", f"{end}</equality>"))) == set()


@pytest.mark.parametrize(("reach_m", "rigid"), [(0.11, False), (0.14, True)])
@pytest.mark.parametrize("link", [1, 2])
def test_a_rigid_part_on_one_or_two_joints_of_a_limb_reaches_at_most_half_its_length(
    link: int, reach_m: float, rigid: bool
) -> None:
    jaw = f'<geom type="capsule" size="0.002" fromto="0 0 0.01 {reach_m} 0 0.01" mass="0.001"/>'
    site = f'<site name="left{link}"'
    assert ("mostly_rigid" in codes(changed_arm((site, jaw + site)))) == rigid


def test_a_rigid_part_on_three_joints_may_reach_farther() -> None:
    rod = '<geom type="capsule" size="0.002" fromto="0 0 0.01 0.14 0 0.01" mass="0.001"/><site name="left3"'
    assert codes(changed_arm(('<site name="left3"', rod))) == set()


@pytest.mark.parametrize(("reach_m", "rigid"), [(0.11, False), (0.14, True)])
def test_a_rigid_part_on_a_hinge_that_no_cable_bends_reaches_at_most_half_the_longest_limb(
    reach_m: float, rigid: bool
) -> None:
    jaw = JAW.replace("0.04 0 0", f"{reach_m} 0 0")
    assert ("mostly_rigid" in codes(changed_arm(('<body name="base">', f'<body name="base">{jaw}')))) == rigid


CLAMP = (
    '<body name="jaw" pos="0.05 0 0"><joint name="jaw" {joint} damping="0.01"/><geom type="capsule" '
    'fromto="0.01 0 0 0.04 0 0" size="0.004" mass="0.005"/><site name="on_jaw" pos="0.03 0 0.005"/></body>'
    '<site name="on_base" pos="0.05 0 0.03"/>'
)
HINGE = 'axis="0 1 0" range="-40 40"'
LOADED = {
    "a spring of a tendon": (HINGE, 'stiffness="300" springlength="0.02"'),
    "of which the stiffness grows": (HINGE, 'stiffness="0 0 5e5" springlength="0.015"'),
    "a spring of the joint whose stiffness grows": (f'{HINGE} stiffness="0.001 0 0.3" springref="40"', ""),
    "a spring of a slide": ('type="slide" axis="0 0 1" range="-0.02 0.02" stiffness="20" springref="0.02"', ""),
}


@pytest.mark.parametrize(("joint", "tendon"), LOADED.values(), ids=LOADED)
def test_a_loaded_spring_on_a_joint_that_no_cable_bends_is_found(joint: str, tendon: str) -> None:
    spring = f'<spatial name="shut" {tendon}><site site="on_base"/><site site="on_jaw"/></spatial></tendon>'
    base = '<body name="base">'
    text = changed_arm((base, base + CLAMP.format(joint=joint)), ("</tendon>", spring if tendon else "</tendon>"))
    assert "loaded_spring" in codes(text)
    rest = changed_arm((base, base + CLAMP.format(joint=HINGE + ' stiffness="0.2"')))
    assert codes(rest) == set()


@pytest.mark.parametrize(
    ("stiffness", "found"), [("0.2 -0.5 0", True), ("0.2 0 -1", True), ("0.2 -0.2 0", False), ("0.2 -0.5 1", False)]
)
def test_a_spring_that_pushes_away_from_its_rest_within_the_range_is_found(stiffness: str, found: bool) -> None:
    assert ("loaded_spring" in codes(changed_arm(('stiffness="0.2"', f'stiffness="{stiffness}"')))) == found


def test_a_limit_that_acts_before_the_end_of_the_range_is_a_spring_too() -> None:
    """The margin of a limit is in radians, whatever the angles are in."""
    base = '<body name="base">'
    jaw = f"{base}{CLAMP.format(joint=HINGE)}"
    assert codes(changed_arm((base, jaw))) == set()
    assert "loaded_spring" in codes(changed_arm((base, jaw.replace('range="-40 40"', 'range="-40 40" margin="0.75"'))))


def test_a_spring_of_a_tendon_that_pushes_away_from_its_rest_is_found() -> None:
    assert "loaded_spring" in codes(
        changed_arm(('<spatial name="left">', '<spatial name="left" stiffness="5 -100 0">'))
    )


def test_joints_of_one_limb_may_be_coupled() -> None:
    gear = '</tendon><equality><joint joint1="bend4" joint2="bend3"/></equality>'
    assert codes(changed_arm(("</tendon>", gear))) == set()


def test_discs_that_collide_stand_for_the_backbone_between_them() -> None:
    bare = changed_arm(('mass="0.01"/>', 'mass="0.01" contype="0" conaffinity="0"/>'))
    assert "ghost_shape" in codes(bare)
    disc = 'mass="0.01" contype="0" conaffinity="0"/>'
    for at in (0.01, 0.03, 0.05):
        disc += f'<geom type="cylinder" size="0.012 0.001" pos="0 0 {at}" mass="0.001"/>'
    assert codes(changed_arm(('mass="0.01"/>', disc))) == set()


def test_a_gap_that_lets_others_enter_is_as_good_as_no_contact() -> None:
    assert "ghost_shape" in codes(changed_arm(('mass="0.01"/>', 'mass="0.01" gap="0.5"/>')))


@pytest.mark.parametrize(("up_m", "in_the_air"), [(0.058, False), (0.069, False), (0.071, True), (0.45, True)])
def test_a_functional_part_far_from_all_that_can_touch_is_a_point_in_the_air(up_m: float, in_the_air: bool) -> None:
    far = small_scene("pipe_inserting").replace('pos="0 0 0.058"', f'pos="0 0 {up_m}"')
    assert codes(far) == ({"part_in_the_air"} if in_the_air else set())
    model, structure = _read(far)
    assert (model.site("robot/functional_part").id in structure.marks) != in_the_air
    assert (model.site("robot/tip").id in structure.marks) != in_the_air


def test_a_shape_that_touches_nothing_does_not_bring_a_functional_part_to_the_robot() -> None:
    rod = '<geom type="capsule" size="0.001" fromto="0 0 0.06 0 0 0.11" mass="1e-4" contype="0" conaffinity="0"/>'
    scene = small_scene("pipe_inserting").replace('pos="0 0 0.058"', 'pos="0 0 0.1"')
    assert "part_in_the_air" in codes(scene.replace('<site name="robot/tip"', rod + '<site name="robot/tip"'))


def test_an_exclusion_between_parts_of_the_robot_and_with_its_mount_is_allowed() -> None:
    inside = "<contact><exclude body1='seg1' body2='seg3'/></contact><tendon>"
    assert codes(changed_arm(("<tendon>", inside))) == set()
    mount = "<contact><exclude body1='world' body2='seg1'/></contact><tendon>"
    assert codes(changed_arm(("<tendon>", mount))) == set()
    free = changed_arm(("<tendon>", mount), ('<body name="base">', '<body name="base"><freejoint/>'))
    assert codes(free) == {"contact_excluded"}


def test_a_robot_without_joints_has_no_tendons() -> None:
    assert "no_tendons" in codes("<mujoco><worldbody><body name='arm'><geom size='0.1'/></body></worldbody></mujoco>")


def test_a_robot_without_bodies_has_no_tendons() -> None:
    assert "no_tendons" in codes("<mujoco><worldbody><geom size='0.1'/></worldbody></mujoco>")


@pytest.mark.parametrize("side", [1, -1])
def test_a_sum_of_joints_that_bends_to_one_side_is_a_cable_whichever_way_it_is_written(side: int) -> None:
    assert codes(_coupled(f'ctrlrange="0 8" gear="{side}"')) == set()


def test_a_sum_of_joints_that_is_driven_to_both_sides_is_a_motor() -> None:
    assert "motorized_joint" in codes(_coupled('ctrlrange="-8 8"'))


@pytest.mark.parametrize(("share", "motor"), [(0.5, False), (1e-9, True)])
def test_a_sum_in_which_one_joint_has_all_the_weight_is_a_motor(share: float, motor: bool) -> None:
    assert ("motorized_joint" in codes(_coupled('ctrlrange="0 8"', share))) == motor


def _coupled(motor: str, share: float = 1.0) -> str:
    """The small arm bent by a fixed tendon over its four joints; `share` is the weight of all but the first."""
    joints = "".join(f'<joint joint="bend{i}" coef="{0.009 * (share if i > 1 else 1)}"/>' for i in range(1, 5))
    head, _, rest = small_arm().partition("<tendon>")
    tail = rest.partition("</actuator>")[2]
    drive = f'<tendon><fixed name="flex">{joints}</fixed></tendon><actuator><motor tendon="flex" {motor}/></actuator>'
    return f"{head}{drive}{tail}"
