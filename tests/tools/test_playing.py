"""What is measured of a played script, against motions whose figures are known."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import pytest
from tests.scenes import small_arm, small_scene
from tests.tools.carts import cart, play_once

from aidsr.core.artifacts import Placement, Robot
from aidsr.core.errors import UserError
from aidsr.core.formatting import format_number
from aidsr.sim.assembly import assemble
from aidsr.tasks import goal_task, load_task, read_goal
from aidsr.tools.distances import distance_m, find_pairs
from aidsr.tools.playing import film_script, play_variations
from aidsr.tools.recording import validity_in_words
from aidsr.tools.scene import MeasuredScene
from aidsr.tools.statics import bends


def test_a_cart_of_constant_speed_has_its_path_velocity_and_distances(tmp_path: Path) -> None:
    found = play_once(
        cart(tmp_path, 9.0), "drive: 0.4", seconds=1.0, distances=[("nose", "mark"), ("robot/cart", "wall")]
    )
    assert found.duration_s == pytest.approx(1.0)
    assert found.mean_velocity_m_s == pytest.approx((0.2, 0.0, 0.0), abs=0.002), "0.4 of 0.5 m/s"
    assert found.path_m == pytest.approx(0.2, abs=0.002)
    assert found.heading_deg == pytest.approx(0.0, abs=1e-6)
    marked, wall = found.distances
    assert (marked.start_m, marked.end_m, marked.least_s) == pytest.approx((0.3, 0.1, 1.0), abs=0.002)
    assert (wall.start_m, wall.end_m) == pytest.approx((0.45, 0.25), abs=0.002), "between surfaces"
    assert found.ended == "all that was to be played was played"
    assert found.touches == ()
    assert "mean velocity 199" in found.text()


def test_a_turntable_counts_whole_turns_to_the_left(tmp_path: Path) -> None:
    found = play_once(cart(tmp_path, 9.0), "turn: 1")
    assert found.duration_s == pytest.approx(4.0)
    assert found.heading_deg == pytest.approx(360.0, abs=2.0), "a quarter of a turn each second"
    assert found.ended == "the task's time is over"
    assert play_once(cart(tmp_path, 9.0), "turn: -1", seconds=1.0).heading_deg == pytest.approx(-90.0, abs=1.0)


def test_the_first_wall_is_named_with_time_force_and_body(tmp_path: Path) -> None:
    found = play_once(cart(tmp_path, 9.0), "drive: t=0 1")
    (touch,) = found.touches
    assert (touch.geom, touch.bodies, touch.at_start) == ("wall", ("cart",), False)
    assert touch.first_s == pytest.approx(0.45 / 0.5, abs=0.05)
    assert touch.mean_n == pytest.approx(500.0, rel=0.05), "stalled: kv times the speed that is asked for"
    assert "touches wall first at 0.9" in found.text()


def test_the_peak_force_has_its_time_and_the_two_parts_that_touch(tmp_path: Path) -> None:
    found = play_once(cart(tmp_path, 9.0), "drive: t=0 1, t=2 1, t=2.01 0.5")
    (touch,) = found.touches
    (peak,) = (figure for figure in found.figures if figure.name == "peak contact force")
    assert (peak.value, touch.peak_by) == (touch.peak_n, "cart")
    assert 0.9 - 0.05 <= touch.peak_s <= 2.05, "pressed half as hard from then on"
    assert peak.cell == f"{format_number(touch.peak_n)} at {format_number(touch.peak_s)} s, cart on wall"
    assert f"peak {format_number(touch.peak_n)} N at {format_number(touch.peak_s)} s by cart" in found.text()
    (none,) = (one for one in play_once(cart(tmp_path, 9.0), "drive: 0").figures if one.name == "peak contact force")
    assert none.cell == "0"


def test_a_winch_with_a_time_constant_presses_as_hard_as_it_pulls(tmp_path: Path) -> None:
    scene = cart(tmp_path, 9.0)
    drive = '<velocity name="robot/drive" joint="robot/along" kv="1000" ctrlrange="-0.5 0.5"/>'
    winch = (
        '<general name="robot/drive" joint="robot/along" dyntype="filterexact" dynprm="0.05" gainprm="20" '
        'biastype="affine" biasprm="0 0 -20" ctrlrange="-0.5 0.5"/>'
    )
    assert drive in scene.mjcf
    (touch,) = play_once(scene.model_copy(update={"mjcf": scene.mjcf.replace(drive, winch)}), "drive: t=0 1").touches
    assert touch.peak_n >= touch.mean_n
    assert touch.mean_n == pytest.approx(10.0, rel=0.05), "stalled: 20 N s/m times 0.5 m/s"
    assert touch.share > 0.5


def test_success_ends_it_and_is_said(tmp_path: Path) -> None:
    found = play_once(cart(tmp_path, 0.2), "drive: t=0 1, t=0.4 1, t=0.41 0")
    assert found.succeeded
    assert found.ended == "success, held"
    assert found.moments[-1].progress == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("place_m", "lost_by"),
    [
        ((0.6, 0.0, 0.2), "A part of the robot starts beyond the first edge."),
        ((0.0, 0.5, 0.2), "The centre of mass is 0.1 m outside the lane."),
    ],
)
def test_of_several_rules_the_one_that_applied_is_told(place_m: tuple[float, float, float], lost_by: str) -> None:
    task = load_task("stairs")
    robot = Robot(mjcf=small_arm(), functional_part="tip")
    placement = Placement(mount="world", base="free", position_m=place_m)
    scene = assemble(robot, task.environment, placement, task.sensors).mjcf
    found = play_once(MeasuredScene(mjcf=scene, task=task.name), "pull_left: 1")
    assert found.ended == f"lost by the task's own rule: {lost_by}"


def test_what_the_task_observes_is_told_with_its_change(tmp_path: Path) -> None:
    found = play_once(cart(tmp_path, 9.0), "drive: 0.4", seconds=1.0)
    changed = {name for name, _, start, end in found.features if start != end}
    (line,) = (line for line in found.text().splitlines() if line.startswith("the task observes"))
    assert changed
    assert line.count("->") == 1 + len([name for name in changed if f"{name} " in line])


def test_the_text_is_short_and_the_file_has_every_control_step(tmp_path: Path) -> None:
    found = play_once(cart(tmp_path, 9.0), "drive: 0.2", distances=[("nose", "mark")])
    assert len(found.text().splitlines()) <= 40
    assert len(found.csv().splitlines()) == 1 + len(found.moments) == 102


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        (("nos", "mark"), 'no site, geom or body "nos"; did you mean nose'),
    ],
)
def test_distances_that_cannot_be_measured_are_refused(tmp_path: Path, pair: tuple[str, str], message: str) -> None:
    with pytest.raises(UserError, match=message):
        play_once(cart(tmp_path), "drive: 0", distances=[pair])


def test_a_point_is_measured_to_a_surface_and_the_body_plays_as_without(tmp_path: Path) -> None:
    without = play_once(cart(tmp_path, 9.0), "drive: 1", seconds=2.0)
    found = play_once(cart(tmp_path, 9.0), "drive: 1", seconds=2.0, distances=[("nose", "wall"), ("wall", "nose")])
    for one in found.distances:
        assert (one.start_m, one.end_m) == pytest.approx((0.5, 0.05), abs=0.005), "the nose is in the cart's middle"
    assert [moment.center_m for moment in found.moments] == [moment.center_m for moment in without.moments]
    assert found.touches == without.touches


def test_limits_that_are_passed_are_told_with_how_much_and_how_long(tmp_path: Path) -> None:
    scene = cart(tmp_path, 0.55)
    assert scene.goal is not None
    goal = scene.goal.read_text() + '\n[[limits]]\nkind = "speed"\nof = "robot"\nat_most_m_s = 0.2\n'
    scene.goal.write_text(goal)
    told = play_once(scene, "drive: t=0 0.8, t=0.5 0.8, t=0.51 0.1", seconds=1.0)
    assert re.search(
        r"^a limit exceeded: speed of robot 0\.\d+ m/s of 0\.2 m/s allowed, for 0\.\d+ s of 0\.2 s tolerated$",
        told.text(),
        re.M,
    )
    assert told.phase.endswith(told.exceeded_limits[0].text)
    assert "a limit exceeded" not in play_once(scene, "drive: 0.3", seconds=1.0).text()


def test_a_goal_that_is_left_again_says_how_long_it_was_held(tmp_path: Path) -> None:
    found = play_once(cart(tmp_path, 0.2), "drive: t=0 0.5, t=0.86 0.5, t=0.87 -0.5", seconds=1.5)
    assert not found.succeeded
    assert f"held for {found.held_s:.3g} s of 0.2 s at most" in found.text()
    assert 0.0 < found.held_s < 0.2


def test_an_overlap_at_the_start_is_told(tmp_path: Path) -> None:
    scene = cart(tmp_path, 9.0)
    inside = scene.model_copy(update={"mjcf": scene.mjcf.replace('pos="0 0 0.1">', 'pos="0.46 0 0.1">')})
    assert "overlaps wall by 10 mm at the start" in play_once(inside, "drive: 0", seconds=0.2).text()
    assert "overlaps" not in play_once(scene, "drive: 0", seconds=0.2).text()


def test_an_overlap_is_told_as_assembled_too_where_the_variation_moves_what_is_overlapped(tmp_path: Path) -> None:
    scene = cart(tmp_path)
    wall = '<geom name="wall" type="box" size="0.01 0.5 0.2" pos="0.51 0 0.2"/>'
    moved = f'<body name="block"><joint type="slide" axis="1 0 0"/>{wall.replace("wall", "block")}</body>'
    mjcf = scene.mjcf.replace(wall, moved).replace('pos="0 0 0.1">', 'pos="0.46 0 0.1">')
    goal = (
        'kind = "travel"\ntarget = "block"\ndistance_m = 0.2\ntime_limit_s = 4\nhold_s = 0.2\nvary_m = [0.008, 0, 0]\n'
    )
    scene.goal.write_text(goal)
    told = play_once(scene.model_copy(update={"mjcf": mjcf}), "drive: 0", seconds=0.2).text()
    found = re.search(r"^overlaps block by (\S+) mm at the start of this variation, (\S+) mm where", told, re.M)
    assert found
    here, described = map(float, found.groups())
    assert described == pytest.approx(10.0, abs=0.01)
    assert 0.1 < abs(here - described) <= 8.01


def test_a_name_of_several_things_says_which_is_measured(tmp_path: Path) -> None:
    scene = cart(tmp_path)
    mjcf = scene.mjcf.replace('<site name="mark"', '<site name="wall"')
    told = play_once(scene.model_copy(update={"mjcf": mjcf}), "drive: 0", seconds=0.2, distances=[("nose", "wall")])
    assert "nose to wall (site): 300.0 mm at the start" in told.text()
    assert "nose to mark: 300.0 mm" in play_once(scene, "drive: 0", seconds=0.2, distances=[("nose", "mark")]).text()


def test_what_the_task_observes_has_axes_and_progress_says_what_it_counts(tmp_path: Path) -> None:
    told = play_once(cart(tmp_path), "drive: 0.3", seconds=1.0).text()
    assert re.search(r"centre of mass, from where it was at the start x 0 -> 0\.\d+ m; .* start y 0", told)
    assert re.search(r"^progress: best .*; it counts distance travelled", told, re.M)


def test_parts_of_the_robot_that_touch_each_other_are_named(tmp_path: Path) -> None:
    scene = cart(tmp_path, 9.0)
    hand = """<body name="robot/hand" pos="-0.1 0 0"><joint name="robot/slide" type="slide" axis="1 0 0"/>
      <geom name="robot/hand" type="sphere" size="0.055" mass="0.1"/></body><body name="robot/other" pos="0.1 0 0">
      <joint name="robot/slide2" type="slide" axis="1 0 0" stiffness="100" springref="-0.2"/>
      <geom name="robot/other" type="sphere" size="0.055" mass="0.1"/></body><site name="robot/nose"/>"""
    told = play_once(
        scene.model_copy(update={"mjcf": scene.mjcf.replace('<site name="robot/nose"/>', hand)}),
        "drive: 0",
        seconds=1.0,
    ).text()
    assert re.search(r"^touches itself \d+% of the time, mostly hand with other$", told, re.M)


def test_commands_beyond_the_range_are_told_as_cut_off(tmp_path: Path) -> None:
    told = play_once(cart(tmp_path, 9.0), "drive: mean -0.8 amplitude 0.6 hz 1", seconds=1.0).text()
    assert re.search(r"^drive is asked for -1\.4, cut off at -1, \d\d% of the time$", told, re.M)
    assert "cut off" not in play_once(cart(tmp_path, 9.0), "drive: mean -0.4 amplitude 0.6 hz 1", seconds=1.0).text()


def arm_that_reaches(
    folder: Path, flag: str, within_m: float = 0.03, hold_s: float = 0.2, things: str = ""
) -> MeasuredScene:
    """The small arm, and a place that its tip is to come to: at 0 0 0.398, under one cable at 0.15 0 0.108."""
    goal = folder / "goal.toml"
    goal.write_text(f'kind = "reach"\ntarget = "flag"\nwithin_m = {within_m}\nhold_s = {hold_s}\ntime_limit_s = 2\n')
    places = f'<site name="mount" pos="0 0 0.1"/><site name="flag" pos="{flag}"/>'
    environment = f"<mujoco><worldbody>{places}{things}</worldbody></mujoco>"
    robot, placement = Robot(mjcf=small_arm(), functional_part="tip"), Placement(mount="mount", base="fixed")
    sensors = goal_task(read_goal(goal), environment).sensors
    return MeasuredScene(mjcf=assemble(robot, environment, placement, sensors).mjcf, goal=goal)


def test_a_success_by_cables_and_soft_body_says_that_it_would_be_valid(tmp_path: Path) -> None:
    found = play_once(arm_that_reaches(tmp_path, "0.15 0 0.108"), "pull_left: 1\npull_right: -1")
    assert found.succeeded
    assert (found.not_valid, found.fragile) == ((), ())
    assert "the same motion fails, as it must for a valid policy" in found.text()
    assert "computed" not in found.text()


def test_a_success_that_hangs_on_how_the_physics_is_computed_says_so(tmp_path: Path) -> None:
    """The tip flies past the goal; where it is after 0.12 s differs by a millimetre."""
    found = play_once(arm_that_reaches(tmp_path, "0.13662 0 0.3389", within_m=0.0005, hold_s=0.02), "pull_left: 1")
    assert (found.succeeded, found.not_valid, found.fragile) == (True, (), ("at half the time step",))
    delicate = "too delicate to rely on: give it more clearance, or steadier contact"
    assert f"{delicate}: computed at half the time step it fails" in found.text().splitlines()
    assert found.phase.endswith("; valid; lost at half the time step")
    sturdy = found.model_copy(update={"fragile": ()})
    assert validity_in_words([found, sturdy]).endswith("; 1 of these 2 are won at half the time step")
    assert validity_in_words([found, found, sturdy]).endswith(
        f"; 1 of these 3 are won at half the time step: less than half is not valid ({delicate})"
    )
    assert validity_in_words([sturdy]).endswith(
        "; all are won at half the time step and with another integrator as well"
    )


def test_a_success_that_one_of_the_other_integrators_denies_is_not_fragile(tmp_path: Path) -> None:
    """With "discrete" the joint limits that this arm rests on give way by 5 mm at the tip; with "Euler" as here."""
    found = play_once(arm_that_reaches(tmp_path, "0.15 0 0.108", within_m=0.002, hold_s=0.02), "pull_left: 1")
    assert (found.succeeded, found.fragile) == (True, ())


def test_a_success_without_cables_says_why_it_is_not_valid(tmp_path: Path) -> None:
    found = play_once(arm_that_reaches(tmp_path, "0 0 0.38"), "pull_left: -1\npull_right: -1")
    assert found.not_valid is not None
    *first, still = found.not_valid
    assert first == [
        "the same motion succeeds with every cable slack",
        "the same motion succeeds with the joints of the soft body locked",
    ]
    assert "0 of the robot's length (at least 0.02)" in still
    assert "no valid policy wins so" in found.text()
    assert "not valid" in found.phase, "rows of several variations say so too"


def test_a_success_by_passing_through_something_is_not_valid(tmp_path: Path) -> None:
    mist = '<geom name="mist" type="sphere" size="0.04" pos="0.075 0 0.2" solref="-0.1 -0.01"/>'
    found = play_once(arm_that_reaches(tmp_path, "0.15 0 0.108", things=mist), "pull_left: 1\npull_right: -1")
    assert found.succeeded
    (deep,) = found.not_valid or ()
    assert deep.startswith("how deep the robot overlaps itself or anything else")
    assert f"no valid policy wins so: {deep}" in found.text().splitlines()


def test_a_success_by_other_actuators_says_that_it_fails_without_them(tmp_path: Path) -> None:
    found = play_once(cart(tmp_path, 0.2), "drive: t=0 1, t=0.4 1, t=0.41 0")
    assert "it fails without the 2 actuators of the robot that pull on no cable" in (found.not_valid or ())


def test_a_motion_that_does_not_succeed_is_not_asked_what_it_needs(tmp_path: Path) -> None:
    found = play_once(arm_that_reaches(tmp_path, "0.15 0 0.108"), "pull_left: -1\npull_right: -1")
    assert found.not_valid is None
    assert "valid" not in found.text()


def test_each_variation_says_what_sets_it_apart_and_whether_its_success_is_valid(tmp_path: Path) -> None:
    scene = arm_that_reaches(tmp_path, "0.15 0 0.108")
    assert scene.goal is not None
    scene.goal.write_text(scene.goal.read_text() + "vary_m = [0.045, 0, 0]\n")
    script = "pull_left: 1\npull_right: -1"
    task = goal_task(read_goal(scene.goal), scene.mjcf)
    found = play_variations(scene, script, variations=tuple(range(6)))
    assert found == tuple(play_once(scene, script, variation=one.variation) for one in found), "as each is played alone"
    for one in found:
        ((x_m, _, _),) = (change.value for change in task.variation("development", one.variation).changes)
        assert one.variation_text == f"flag {1000 * (x_m - 0.15):+.1f} mm along x"
        assert f"in this variation: {one.variation_text}" in one.text()
        assert one.phase.endswith("; valid") == one.succeeded
    won = [str(one.variation) for one in found if one.succeeded]
    assert 0 < len(won) < 6
    assert validity_in_words(found).startswith(f"won {len(won)} of 6. A policy that does the same would be valid in ")
    assert f"valid in {', '.join(won)}: " in validity_in_words(found)


def test_variations_that_are_won_without_cables_are_told_from_those_that_need_them(tmp_path: Path) -> None:
    scene = arm_that_reaches(tmp_path, "0 0 0.38")
    assert scene.goal is not None
    scene.goal.write_text(scene.goal.read_text() + "vary_m = [0.06, 0, 0]\n")
    found = play_variations(scene, "pull_left: -0.95", variations=tuple(range(8)))
    assert any(one.not_valid for one in found)
    told = validity_in_words(found)
    for one in found:
        listed = re.search(rf"not valid in [\d, ]*\b{one.variation}\b", told)
        assert bool(listed) == bool(one.not_valid)
        if one.not_valid:
            assert one.phase.endswith(f"; not valid: {' and '.join(one.not_valid)}")


def test_a_picture_shows_the_motion_that_is_played_with_what_the_job_itself_drives() -> None:
    lowered = MeasuredScene(mjcf=small_scene("simple_grasping"), task="simple_grasping")
    pair = [("robot/base", "table")]
    played = play_once(lowered, "*: -1", seconds=2.0, distances=pair)
    shown = film_script(lowered, "*: -1", seconds=2.0)
    model = mujoco.MjModel.from_xml_string(shown.mjcf)
    data = mujoco.MjData(model)
    data.qpos[:] = shown.qpos[-1]
    mujoco.mj_forward(model, data)
    ((base, table),) = find_pairs(model, pair)
    end_m, start_m = played.distances[0].end_m, played.distances[0].start_m
    assert distance_m(model, data, base, table) == pytest.approx(end_m, abs=1e-4)
    assert start_m - end_m > 0.02
    assert shown.duration_s == pytest.approx(played.duration_s)


PILLOW = """
<mujoco>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body name="pillow" pos="0 0 0.05">
      <flexcomp name="foam" type="grid" count="4 4 2" spacing="0.05 0.05 0.03" dim="3" mass="0.5" radius="0.005" {dof}>
        <contact selfcollide="none"/>{edge}
      </flexcomp>
    </body>
    <geom name="floor" type="plane" size="5 5 0.1"/>
    <body name="robot/base" pos="0 0 {height_m}">
      <geom size="0.03" mass="0.3" pos="0.01 0.01 0"/><site name="robot/functional_part"/>
      <joint name="robot/down" type="slide" axis="0 0 1"/>
    </body>
    <body name="other" pos="3 0 1"><geom name="last" size="0.01"/></body>
  </worldbody>
  <actuator><motor name="robot/push" joint="robot/down" ctrlrange="-1 0"/></actuator>
</mujoco>"""


@pytest.mark.parametrize("dof", ["", 'dof="trilinear"'])
def test_a_flex_that_is_touched_or_overlapped_is_named(tmp_path: Path, dof: str) -> None:
    edge = "" if dof else '<edge equality="true" damping="1"/>'
    goal = tmp_path / "goal.toml"
    goal.write_text('kind = "travel"\ndistance_m = 1\ntime_limit_s = 4\n')
    pressed = PILLOW.format(dof=dof, edge=edge, height_m=0.085)
    played = play_once(MeasuredScene(mjcf=pressed, goal=goal), "*: -1", seconds=0.5)
    assert [touch.geom for touch in played.touches] == ["foam"]
    assert played.touches[0].bodies == ("base",)
    assert [name for name, _, _ in played.overlaps] == ["foam"]
    assert "foam with base" in bends(MeasuredScene(mjcf=pressed)).text


def test_of_a_success_no_stage_is_told_as_missed(tmp_path: Path) -> None:
    """Some tasks are done below progress 1: then the last stage has no time."""
    found = play_once(cart(tmp_path, 9.0), "drive: 0.4", seconds=1.0)
    some = found.model_copy(update={"stages": (("half way", 0.5), ("there", None))})
    assert '; reached: "half way" at 0.5 s; not: "there"' in some.text()
    assert '"there"' not in some.model_copy(update={"succeeded": True}).text()
