"""Bodies that cheat: each is a body that could win, and each is refused by name."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from benchmarks.cheats.bodies import CHEATS
from benchmarks.cheats.honest import FOUND, look, refusals
from benchmarks.cheats.matrix import PAGE, current, page, tried_at
from benchmarks.cheats.parts import Parts, Player, chain, constant
from benchmarks.cheats.playing import lift_m, place, play
from benchmarks.cheats.wins import BEFORE, FOUND_LATER, fingerprint, read_rows
from benchmarks.episode_clock import EpisodeClock

from aidsr import validate
from aidsr.core.artifacts import Placement, Robot
from aidsr.core.errors import UserError
from aidsr.learn.episodes.plausibility import part_check
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.assembly import assemble
from aidsr.sim.scope import find_out_of_scope
from aidsr.sim.structure import read_structure
from aidsr.tasks import TASKS, load_task

BY_NAME = {cheat.name: cheat for cheat in CHEATS}


BY_CODE = {
    "motorized_joint": (
        "four_wheels six_wheels six_wheels_incline narrow_wheels spoked_wheels spoked_wheels_obstacles belt_wheels "
        "pull_only_wheels rigid_legs flywheel_drum piston_sled riser_on_top motor_jaws motor_scoop belt_jaws "
        "gentle_jaws motor_pointer"
    ),
    "wheel": (
        "stacked_wheels crank_engine wheels_on_necks weight_clock wound_wheels limit_cart cable_piston_sled "
        "tilted_world"
    ),
    "thruster": "jet_puck jet_over_gap",
    "adhesion": "sticky_pad sticky_pad_in_space sticky_worm",
    "moving_surface": "conveyor_worm",
    "loaded_spring": "spring_jaws heavy_spring_jaws spring_umbrella spring_pin latched_jaws curved_latched_jaws",
    "ghost_shape": "ghost_rope ghost_arm stacked_ghost_arm",
    "few_bent_joints": (
        "knuckle_jaws one_hinge_arm integrator_arm clipped_filter_arm one_soft_hinge_arm spring_belt_arm "
        "stopped_belt_arm damped_belt_arm curved_spring_arm early_stop_arm geared_arm geared_belt_arm"
    ),
    "contact_margin": "margin_arm",
    "cable_on_linkage": (
        "cable_jaws threaded_jaws geared_jaws pinned_jaws welded_jaws force_field welded_object glued_jaws "
        "lifts_the_object"
    ),
    "mostly_rigid": (
        "heavy_hoop passive_petals limp_rope basket rigid_rod rod_on_mount rigid_hook first_link_jaws weak_latched_jaws"
    ),
}
"""Bodies by the code of scope that says what they are."""
BY_PHYSICS = {"implausible_inertia": "gyro_worm keel_worm", "free_joint_resists": "damped_worm"}
"""Bodies by the code of physics."""
BY_SCENE = {
    "tendon belt is none of the environment": "belted_crank",
    "1 elements of the kind equality": "geared_crank",
}
"""Bodies by what of their scene is not the task's."""
BY_CHECK = {
    "starts_at_mount": (
        "starts_behind_the_gap starts_behind_the_tunnel coils_behind_the_gap drawn_behind_the_gap "
        "coils_behind_the_tunnel rears_up_on_the_stairs held_over_the_obstacles"
    ),
    "functional_part_is_a_part": "thirteen_fingers thirteen_fingers_with_ballast",
    "in_scope": "ghost_tip",
    "starts_low": "falling_limb",
}


def expected(table):
    return [(name, code) for code, names in table.items() for name in names.split()]


def test_every_body_is_refused_somewhere():
    named = [name for name, _ in expected(BY_CODE) + expected(BY_PHYSICS) + expected(BY_SCENE) + expected(BY_CHECK)]
    assert sorted(named) == sorted(BY_NAME)


@pytest.mark.parametrize(("name", "code"), expected(BY_CODE))
def test_a_body_is_out_of_scope_for_what_it_is(name, code):
    model = mujoco.MjModel.from_xml_string(BY_NAME[name].mjcf)
    assert code in {finding.code for finding in find_out_of_scope(model, read_structure(model))}


@pytest.mark.parametrize(("name", "code"), expected(BY_PHYSICS))
def test_a_body_is_refused_for_its_physics(name, code):
    cheat = BY_NAME[name]
    report = validate(place(cheat, load_task(cheat.task)))
    assert [fault.code for fault in report.errors] == [code]


@pytest.mark.parametrize(("name", "check"), expected(BY_CHECK))
def test_a_body_is_refused_before_an_episode_is_played(name, check):
    cheat = BY_NAME[name]
    task = load_task(cheat.task)
    assert check in refusals(TaskScene.of(place(cheat, task), task, grouping="off"))


@pytest.mark.parametrize(("name", "words"), [("tilted_world", "option has gravity"), *expected(BY_SCENE)])
def test_a_scene_of_its_own_is_refused(name, words):
    cheat = BY_NAME[name]
    with pytest.raises(UserError, match=words):
        TaskScene.of(place(cheat, load_task(cheat.task)), cheat.task)


@pytest.mark.parametrize(
    ("fingers", "on_arm", "passed"),
    [(2, False, False), (1, False, True), (2, True, True)],
    ids=["hub", "one limb", "hand on an arm"],
)
def test_a_hub_of_limbs_is_no_functional_part_however_much_the_rest_weighs(fingers, on_arm, passed):
    hand = sum((chain(f"finger_{k}", f'pos="{0.02 * k} 0 0.012"', links=4) for k in range(fingers)), Parts())
    hub = f'<body name="hub" pos="0 0 0.03"><geom size="0.004"/>{hand.bodies}</body>'
    place = 'pos="0.05 0 0.01" euler="0 90 0"'
    heavy = chain("heavy", place, links=6, end=hub if on_arm else "", geom='density="4000"')
    mjcf = (replace(hand, bodies="" if on_arm else hub) + heavy).document('<geom size="0.01"/>')
    task, placement = load_task("button_pushing"), Placement(mount="mount", base="fixed")
    robot = Robot(mjcf=mjcf, functional_part="hub")
    model = mujoco.MjModel.from_xml_string(assemble(robot, task.environment, placement, task.sensors).mjcf)
    check = part_check(model, read_structure(model), task.sensors)
    assert check.passed == passed
    assert check.unit == ("of the robot's moving mass" if passed else "limbs")


@pytest.mark.parametrize("name", ["button_pushing", "simple_grasping", "gap", "stairs", "drawer_opening"])
def test_an_honest_robot_is_not_refused(name):
    assert look(load_task(name), 1)["refused_by"] == []


def test_no_honest_robot_of_the_page_was_refused():
    rows = read_rows(FOUND)
    assert len(rows) == 5 * len(TASKS)
    assert [row for row in rows if row["refused_by"]] == []


def test_the_page_is_made_of_what_was_decided():
    assert PAGE.read_text(encoding="utf-8") == page()


def test_every_task_but_one_has_a_body_that_cheats_and_no_name_stands_for_two():
    """There is none that gets around both corners."""
    tasks = {name.rpartition("/")[2] for name in TASKS}
    assert tasks - {cheat.task for cheat in CHEATS} == {"around_corners"}
    assert len(BY_NAME) == len(CHEATS) >= 18


@pytest.mark.parametrize("cheat", CHEATS, ids=lambda cheat: cheat.name)
def test_a_body_that_cheats_has_what_a_continuum_robot_is_counted_by(cheat):
    structure = read_structure(mujoco.MjModel.from_xml_string(cheat.mjcf))
    assert structure.longest_series >= 3
    assert structure.tendon_actuators
    assert len(structure.roots) == 1


def test_before_they_were_refused_most_of_them_were_valid_and_successful():
    rows = [row for row in read_rows(BEFORE) if row["commit"] == "2a7e353"]
    called = {row["body"] for row in rows if 2 * row["wins"] >= row["episodes"] and row["valid"] and not row["errors"]}
    assert called <= set(BY_NAME)
    assert len(called) >= 18


def test_bodies_found_later_were_valid_and_successful_until_rules_were_written_for_them():
    rows = [row for row in read_rows(BEFORE) if row["commit"] == FOUND_LATER]
    assert len(rows) == 13
    for row in rows:
        assert 2 * row["wins"] >= row["episodes"]
        assert row["valid"]
        assert row["errors"] == []
        assert fingerprint(BY_NAME[row["body"]]) == row["sha256"]


def test_bodies_for_tasks_that_came_later_win_and_are_not_valid():
    later = [row for row in read_rows(BEFORE) if row["commit"] not in ("2a7e353", FOUND_LATER)]
    assert {row["task"] for row in later} == {"incline", "ball_from_bowl", "crank_turning"}
    for row in later:
        assert 2 * row["wins"] >= row["episodes"]
        assert "needs_cables" in row["failed_checks"], "by measurement, whatever the validator says of the body"


@pytest.mark.parametrize(
    "change",
    [
        {"part": "other"},
        {"offset_m": (0.0, 0.1, 0.0)},
        {"rule": lambda: constant({"left": 0.5})},
        {"edit": lambda root: root.find("option").set("gravity", "0 0 -1")},
    ],
    ids=lambda change: next(iter(change)),
)
def test_whatever_decides_a_verdict_changes_the_fingerprint(change):
    cheat = BY_NAME["motor_jaws"]
    assert fingerprint(replace(cheat)) == fingerprint(cheat)
    assert fingerprint(replace(cheat, **change)) != fingerprint(cheat)


def test_every_cell_is_decided_for_the_bodies_of_today():
    assert {(row["body"], row["task"]) for row in current()} == {
        (cheat.name, name)
        for cheat in CHEATS
        for name in (task.rpartition("/")[2] for task in TASKS)
        if tried_at(cheat, name)
    }


def test_a_body_is_lifted_until_it_stands():
    cheat = BY_NAME["four_wheels"]
    assert lift_m(cheat.mjcf) == pytest.approx(0.0005, abs=1e-4)
    assert lift_m(cheat.mjcf.replace('name="root" ', 'name="root" pos="0 0 -0.1"')) == pytest.approx(0.1005, abs=1e-4)


def test_an_edit_is_made_on_its_own_task_alone():
    cheat = BY_NAME["tilted_world"]
    own, other = (mujoco.MjModel.from_xml_string(place(cheat, load_task(name))) for name in (cheat.task, "obstacles"))
    assert own.opt.gravity[0] > 0.0
    assert other.opt.gravity[0] == 0.0


def test_a_player_starts_again_with_episodes_that_start_again():
    cheat, task = BY_NAME["motor_jaws"], load_task("simple_grasping")
    scene = TaskScene.of(place(cheat, task), task, grouping="off")
    started = []

    def make():
        started.append(True)
        return constant({"left": 1.0})

    player = Player(scene, make)
    first, later = np.zeros((1, 40), dtype=np.float32), np.ones((1, 40), dtype=np.float32)
    for seen in (first, first, later, first):
        action = player.act(seen)
    assert len(started) == 3  # once to begin with, and at each first observation
    names = [group.actuators[0] for group in scene.actions.groups]
    assert action[0, names.index("robot/left")] == 1.0
    assert action[0, names.index("robot/right")] == scene.actions.rest[names.index("robot/right")]


def test_a_replay_that_is_not_recognized_is_an_error():
    task = load_task("simple_grasping")
    clock, seen = EpisodeClock(task), np.zeros((1, 3))
    steps = round(task.time_limit_s / task.control_dt_s)
    assert clock.tick(seen)
    assert not any(clock.tick(seen + 1.0) for _ in range(steps))
    assert clock.time_s == pytest.approx(task.time_limit_s)
    assert clock.tick(seen)
    assert clock.time_s == 0.0
    assert not any(clock.tick(seen + 2.0) for _ in range(steps + 1))
    with pytest.raises(RuntimeError, match="other observations"):
        clock.tick(seen + 2.0)


def test_rigid_jaws_win_by_their_rule_where_nothing_refuses_them():
    cheat, task = BY_NAME["motor_jaws"], load_task("simple_grasping")
    scene = TaskScene.of(place(cheat, task), task, grouping="off")
    assert play(scene, cheat.rule, 1).success.all()
