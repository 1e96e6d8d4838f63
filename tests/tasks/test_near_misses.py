"""Success is where the objective says, and nowhere near it: just inside, and one thing just outside.

The states are those of `states`.
"""

import numpy as np
import pytest
import states
from sights import altered, first, outlined, stacked, touches
from states import JUST

from aidsr.tasks import TASKS, load_task
from aidsr.tasks.reaching.pipe_inserting import branch_direction
from aidsr.tasks.scoring import reset, score

MISSES = [
    ("button_pushing", "standard", {"travel_m": 0.0049}),
    ("button_pushing", "standard", {"tip_n": 0.04}),
    ("button_pushing", "standard", {"tip_n": 0.0, "robot_n": 5.0}),
    ("button_pushing", "standard", {"asked": 0.0}),
    ("surface_adapting", "standard", {"lying": 4}),
    ("surface_adapting", "hard", {"lying": 6}),
    ("surface_adapting", "standard", {"gap_lengths": 0.0301}),
    ("surface_adapting", "standard", {"aside_m": 0.121}),
    ("surface_adapting", "standard", {"spread_lengths": 0.1499}),
    ("surface_adapting", "standard", {"touch_n": 0.049}),
    ("surface_adapting", "standard", {"too_hard_s": 0.501}),
    ("pipe_inserting", "standard", {"branch_m": 0.0999}),
    ("pipe_inserting", "standard", {"branch_m": 0.1601, "beside_m": 0.0}),
    ("pipe_inserting", "standard", {"entered": 0.0}),
    ("pipe_inserting", "standard", {"beside_m": 0.036}),
    *[("pipe_inserting", "standard", {"across_m": across_m}) for across_m in (0.036, -0.036)],
    ("pipe_inserting", "standard", {"way": 1.7, "beside_m": 0.0}),
    ("pipe_inserting", "standard", {"too_hard_s": 0.501}),
    ("around_corners", "standard", {"tip_n": 0.49}),
    ("around_corners", "standard", {"above_m": 0.077}),
    ("ball_from_bowl", "standard", {"raised_m": 0.0999}),
    ("incline", "standard", {"way": 1.0 - JUST}),
    ("incline", "standard", {"climbed": 0.799}),
    ("incline", "standard", {"aside_m": 0.301}),
    ("incline", "standard", {"aside_m": -0.301}),
    ("crank_turning", "standard", {"turned_deg": 269.9}),
    ("crank_turning", "standard", {"turned_deg": -271.0}),
    ("crank_turning", "hard", {"turned_deg": 539.9}),
    ("simple_grasping", "standard", {"raised_m": 0.0999}),
    ("simple_grasping", "standard", {"slip_m": 0.0201}),
    ("simple_grasping", "hard", {"time_s": 4.49}),
    ("delicate_grasping", "standard", {"raised_m": 0.0999}),
    ("zero_gravity_grasping", "standard", {"time_s": 2.99}),
    ("zero_gravity_grasping", "standard", {"drift_m_s": 0.0201}),
    ("zero_gravity_grasping", "standard", {"touched": False}),
    ("zero_gravity_grasping", "standard", {"moved_m": 0.0501}),
    ("dynamic_catching", "standard", {"away_m": 0.1499}),
    ("dynamic_catching", "standard", {"kept": 0.0}),
    ("flat_ground", "standard", {"forward_m": 1.499}),
    ("flat_ground", "standard", {"length_m": 0.376}),
    ("flat_ground", "standard", {"aside_m": 0.301}),
    ("flat_ground", "standard", {"aside_m": -0.301}),
    ("flat_ground", "hard", {"forward_m": 2.999}),
    ("flat_ground", "hard", {"length_m": 0.376}),
    ("stairs", "standard", {"way": 1.0 - JUST}),
    ("stairs", "standard", {"climbed": 0.799}),
    ("stairs", "standard", {"aside_m": 0.301}),
    ("stairs", "standard", {"aside_m": -0.301}),
    ("obstacles", "standard", {"along_m": 1.099}),
    ("obstacles", "standard", {"aside_m": 0.301}),
    ("obstacles", "standard", {"aside_m": -0.301}),
    ("gap", "standard", {"way": 1.0 - JUST}),
    ("gap", "hard", {"way": 1.0 - JUST}),
    ("tunnel", "standard", {"way": 1.0 - JUST}),
    ("drawer_opening", "standard", {"stage": 11.0}),
    *[("drawer_opening", "standard", {"open_m": tuple(0.0101 * np.eye(3)[number])}) for number in range(3)],
    ("force_controlled_brushing", "standard", {"brushed": 17}),
    ("force_controlled_brushing", "hard", {"brushed": 89}),
    ("force_controlled_brushing", "standard", {"stroke_s": 0.099}),
    ("force_controlled_brushing", "standard", {"band_s": 5.999}),
    ("force_controlled_brushing", "standard", {"too_hard_s": 0.501}),
]


def succeeded(name: str, level: str, **amiss) -> list[bool]:
    task, seen, memory = states.of(name, level, **amiss)
    return task.is_success(seen, memory).tolist()


@pytest.mark.parametrize(("name", "level"), [(name, level) for name in TASKS for level in ("standard", "hard")])
def test_just_inside_is_success(name, level):
    assert succeeded(name, level) == [True]


@pytest.mark.parametrize(("name", "level", "amiss"), MISSES)
def test_one_thing_just_outside_is_none(name, level, amiss):
    assert succeeded(name, level, **amiss) == [False]


def test_every_task_is_missed_here():
    assert {name for name, _, _ in MISSES} == {name.rpartition("/")[2] for name in TASKS}


def test_a_lifted_object_need_not_be_shaken_at_the_standard_level():
    assert succeeded("simple_grasping", "standard", time_s=3.9) == [True]


MOUTH, DOWN, JUNCTION, DEEP, END = "over the mouth", "in the pipe", "at the branch", "deep", "beyond the branch's end"
BESIDE, UNDER, THROUGH_WALL, PRESSED = "beside the pipe", "under the pipe", "outside its wall", "sunk into its wall"


def in_pipe_m(task, seen, where: str) -> np.ndarray:
    """A place in or beside the pipe, in world coordinates [m]."""
    direction, junction_m = branch_direction(seen)[0], seen.parameters["junction_m"][0, 0]
    left, down = np.cross(direction, (0.0, 0.0, 1.0)), np.array([0.0, 0.0, -1.0])
    left /= np.linalg.norm(left)
    return (
        seen["pipe_position"][0]
        + {
            MOUTH: -0.02 * down,
            DOWN: 0.05 * down,
            JUNCTION: junction_m * down,
            DEEP: junction_m * down + 0.11 * direction,
            END: junction_m * down + 0.17 * direction,
            BESIDE: junction_m * down + 0.11 * direction + 0.1 * left,
            UNDER: 0.32 * down,
            PRESSED: junction_m * down + 0.05 * direction + 0.038 * left,
            THROUGH_WALL: junction_m * down + 0.05 * direction + 0.044 * left,
        }[where]
    )


@pytest.mark.parametrize(
    ("way", "there"),
    [
        ((MOUTH, DOWN, JUNCTION, DEEP), True),
        ((DOWN, JUNCTION, DEEP), True),
        ((MOUTH, DOWN, JUNCTION, PRESSED, DEEP), True),
        ((MOUTH, DOWN, MOUTH, BESIDE, MOUTH, DOWN, JUNCTION, DEEP), True),
        ((MOUTH, BESIDE, END, DEEP), False),
        ((MOUTH, BESIDE, DEEP), False),
        ((MOUTH, DEEP), False),
        ((MOUTH, BESIDE, DOWN, JUNCTION, DEEP), False),
        ((MOUTH, BESIDE, UNDER, JUNCTION, DEEP), False),
        ((MOUTH, DOWN, JUNCTION, THROUGH_WALL, DEEP), False),
        ((MOUTH, DOWN, JUNCTION, DEEP, END), False),
        ((MOUTH, DOWN, JUNCTION, DEEP, END, DEEP), False),
    ],
)
def test_a_tip_is_in_the_branch_only_if_it_came_in_through_the_mouth_and_stayed_inside(way, there):
    task = load_task("pipe_inserting")
    seen = first(task.name)
    course = [altered(seen, {"tip_position": in_pipe_m(task, seen, where)}) for where in way]
    memory = task.reset_state(course[0])
    for then in course[1:]:
        memory = task.update_state(then, memory)
    assert task.is_success(course[-1], memory).tolist() == [there]
    assert (task.progress(course[-1], memory)[0] > 0.9) == there
    assert task.observe(course[-1], memory)[0, 13] == float(there)


@pytest.mark.parametrize(("time_s", "lost"), [(-0.5, True), (0.0, True), (0.02, False), (0.5, False)])
@pytest.mark.parametrize("earlier", [False, True])
def test_who_touches_the_ball_before_it_is_thrown_has_lost(time_s, lost, earlier):
    task = load_task("dynamic_catching")
    seen = first(task.name)
    none, touch = touches(), touches(0.01)
    samples = np.concatenate([touch if earlier else none] * 5 + [none if earlier else touch] * 5, axis=1)
    then = altered(seen, {"grip": samples}, time_s=seen.parameters["throw_s"][0, 0] + time_s)
    assert task.is_failure(then, task.reset_state(seen)).tolist() == [lost]
    untouched = altered(seen, {"grip": none}, time_s=then.time_s[0])
    assert task.is_failure(untouched, task.reset_state(seen)).tolist() == [False]


@pytest.mark.parametrize(
    ("level", "forces_n", "counted"),
    [
        ("standard", (2.5, 2.5), 0.0),
        ("standard", (2.6, 2.5), 1.0),
        ("hard", (1.0, 1.0), 0.0),
        ("hard", (1.0, 1.1), 1.0),
    ],
)
def test_each_step_that_presses_the_pipe_too_hard_is_remembered(level, forces_n, counted):
    task = load_task("pipe_inserting", level)
    seen = first(task.name, level)
    pressed_and_not = stacked([altered(seen, {"wall_contacts": touches(*forces)}) for forces in (forces_n, ())])
    before = {**task.reset_state(pressed_and_not), "touching_s": np.full(2, 7.0), "too_hard_s": np.full(2, 2.0)}
    memory = task.update_state(pressed_and_not, before)
    assert memory["touching_s"] == pytest.approx([7.04, 7.0])
    assert memory["too_hard_s"] == pytest.approx([2.0 + 0.04 * counted, 2.0])


@pytest.mark.parametrize(("force_n", "times_s"), [(0.04, (7.0, 2.0)), (5.0, (7.04, 2.0)), (5.01, (7.04, 2.04))])
def test_each_step_with_a_hard_contact_on_the_surface_is_remembered(force_n, times_s):
    task = load_task("surface_adapting")
    seen = first(task.name)
    memory = {"touching_s": np.full(1, 7.0), "too_hard_s": np.full(1, 2.0)}
    after = task.update_state(altered(seen, {"surface_contacts": touches(force_n, 0.01)}), memory)
    assert (after["touching_s"][0], after["too_hard_s"][0]) == pytest.approx(times_s)


@pytest.mark.parametrize(("force_n", "times_s"), [(0.04, (7.0, 2.0)), (3.0, (7.04, 2.0)), (3.01, (7.04, 2.04))])
def test_each_step_that_presses_the_wall_too_hard_is_remembered(force_n, times_s):
    task = load_task("force_controlled_brushing")
    seen = first(task.name)
    memory = {**task.reset_state(seen), "touching_s": np.full(1, 7.0), "too_hard_s": np.full(1, 2.0)}
    after = task.update_state(altered(seen, {"robot_contacts": touches(force_n)}), memory)
    assert (after["touching_s"][0], after["too_hard_s"][0]) == pytest.approx(times_s)


@pytest.mark.parametrize(
    ("away_m", "turned_deg", "for_s", "kept"),
    [(0.0599, 130.1, 1.0, 1.0), (0.0601, 130.1, 1.0, 0.0), (0.0599, 129.9, 1.0, 0.0), (0.0599, 130.1, 0.98, 0.0)],
)
def test_a_ball_is_kept_that_stays_in_front_of_a_mount_that_is_turned_over(away_m, turned_deg, for_s, kept):
    task, seen = load_task("dynamic_catching"), first("dynamic_catching")
    ball_m = seen["keeping_position"][0] + (0.6 * away_m, 0.0, 0.8 * away_m)
    then, memory = (
        altered(seen, {"ball_position": ball_m, "mount_angle": np.deg2rad(turned_deg)}),
        task.reset_state(seen),
    )
    for _ in range(round(for_s / task.control_dt_s)):
        memory = task.update_state(then, memory)
    assert memory["kept"] == [kept]


@pytest.mark.parametrize(("other_m", "stage"), [(0.0099, 3.0), (0.0101, 2.0), (0.08, 2.0)])
def test_a_drawer_counts_as_open_only_while_the_others_are_shut(other_m, stage):
    task = load_task("drawer_opening")
    seen = first(task.name)
    turn, after = (f"drawer_{int(drawer) + 1}_opening" for drawer in seen.parameters["order"][0, :2])
    memory = {**task.reset_state(seen), "stage": np.full(1, 2.0)}
    then = altered(seen, {turn: 0.061, after: other_m})
    assert task.update_state(then, memory)["stage"] == [stage]
    worth = float(task.progress(then, memory)[0])
    assert (worth > 2.5 / 12) == (stage == 3.0)


@pytest.mark.parametrize(
    ("turn", "opening_m", "stage", "lost"),
    [
        (0, 0.061, 2.0, False),
        (1, 0.059, 2.0, False),
        (1, 0.061, 2.0, True),
        (0, 0.061, 6.0, True),
        (1, 0.061, 12.0, False),
    ],
)
def test_who_opens_a_drawer_out_of_turn_has_lost(turn, opening_m, stage, lost):
    task = load_task("drawer_opening")
    seen = first(task.name)
    drawer = f"drawer_{int(seen.parameters['order'][0, turn]) + 1}_opening"
    memory = {**task.reset_state(seen), "stage": np.full(1, stage)}
    assert task.is_failure(altered(seen, {drawer: opening_m}), memory) == [lost]


@pytest.mark.parametrize(("turned_deg", "lost"), [(-89.9, False), (-90.1, True), (271.0, False)])
@pytest.mark.parametrize("level", ["standard", "hard"])
def test_who_turns_the_crank_the_wrong_way_has_lost(level, turned_deg, lost):
    task = load_task("crank_turning", level)
    seen = first(task.name)
    then, _ = states.crank_turning(task, seen, turned_deg=turned_deg)
    assert task.is_failure(then, task.reset_state(seen)) == [lost]


@pytest.mark.parametrize(("before_m", "lost"), [(0.01, False), (0.004, True), (-0.03, True)])
def test_a_robot_that_starts_among_the_handles_has_lost(before_m, lost):
    task = load_task("drawer_opening")
    seen = first(task.name)
    bar_m = seen["drawer_1_position"][0] - (before_m + 0.008, 0.0, 0.0)
    start = outlined(seen, np.array([bar_m - (0.1, 0.0, 0.0), bar_m]))
    _, worth = score(task, reset(task, start), seen, np.zeros((1, 1)))
    assert worth.failure.tolist() == [lost]


@pytest.mark.parametrize(("time_s", "away_m", "left"), [(2.9, 0.2, False), (3.0, 0.049, False), (3.0, 0.051, True)])
def test_a_ball_that_strays_from_its_place_while_the_mount_draws_back_is_left_for_good(time_s, away_m, left):
    task = load_task("zero_gravity_grasping")
    seen = first(task.name)
    strayed = altered(seen, {"object_position": seen["object_position"][0] + (away_m, 0.0, 0.0)}, time_s=time_s)
    memory = task.update_state(strayed, task.reset_state(seen))
    came_back = seen if time_s >= 3.0 else strayed
    still = {"grip": touches(0.3), "object_velocity": seen["mount_velocity"][0]}
    back = altered(came_back, still, time_s=4.0)
    memory = task.update_state(back, memory)
    assert task.is_success(back, memory).tolist() == [not left]
    (moved,) = (one for one in task.conditions(back, memory) if one.name == "moved in the grip")
    assert moved.value == pytest.approx(1000 * away_m if time_s >= 3.0 else 0.0), (
        "the largest since then, not the present"
    )
