"""What cannot be made good any more ends an episode as lost."""

import numpy as np
import pytest
from sights import outlined
from stick import Episode

from aidsr.tasks import TASKS, load_task
from aidsr.tasks.scoring import reset, score

LANES = ["flat_ground", "stairs", "incline", "obstacles", "gap", "tunnel"]


@pytest.mark.parametrize("name", LANES)
@pytest.mark.parametrize(("aside_m", "lost"), [(0.25, False), (-0.25, False), (0.45, True), (-0.45, True)])
def test_a_robot_far_outside_its_lane_is_lost(name, aside_m, lost):
    episode = Episode(load_task(name))
    left, start = episode.sensor("lane_left"), episode.sensor("lane_position")
    episode.place(start + aside_m * left + (0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    assert episode.step().failure[0] == lost


@pytest.mark.parametrize("name", ["flat_ground", "gap"])
@pytest.mark.parametrize(("back_m", "lost"), [(0.045, False), (0.055, True)])
def test_a_robot_that_falls_back_is_lost(name, back_m, lost):
    episode = Episode(load_task(name))
    forward = episode.sensor("lane_forward")
    for along_m in (0.1, 0.2, 0.2 - back_m):
        episode.place(along_m * forward + (0.0, 0.0, 0.02), forward)
        episode.step()
    assert episode.score.failure[0] == lost


@pytest.mark.parametrize(
    ("name", "begin_m"), [("stairs", 0.4), ("obstacles", 0.42), ("gap", 1.0), ("tunnel", 0.35), ("incline", 0.35)]
)
@pytest.mark.parametrize(("beyond_m", "lost"), [(-0.001, False), (0.001, True)])
def test_a_robot_that_starts_beyond_the_beginning_is_lost(name, begin_m, beyond_m, lost):
    episode = Episode(load_task(name))
    seen, forward = episode.look(), episode.sensor("lane_forward")
    along_m = np.array([[-0.1], [begin_m + beyond_m - 0.008]])
    _, worth = score(episode.task, reset(episode.task, outlined(seen, along_m * forward)), seen, np.zeros((1, 1)))
    assert worth.failure.tolist() == [lost]


def test_an_object_off_the_table_is_lost():
    episode = Episode(load_task("simple_grasping"))
    assert not episode.step().failure[0]
    episode.put("object_free", (0.6, 0.0, 0.1))
    assert episode.step().failure[0]


def test_a_ball_beside_its_bowl_is_lost():
    episode = Episode(load_task("ball_from_bowl"))
    assert not episode.step().failure[0]
    episode.put("object_free", (0.15, 0.0, 0.43))
    assert episode.step().failure[0]


def test_an_object_pushed_far_away_in_weightlessness_is_lost():
    episode = Episode(load_task("zero_gravity_grasping"))
    tip_m = episode.tip_m.copy()
    for away_m, lost in ((0.4, False), (0.8, True)):
        episode.put("object_free", (tip_m[0] + away_m, *tip_m[1:]))
        assert episode.step().failure[0] == lost


def test_a_ball_on_the_floor_is_lost():
    episode = Episode(load_task("dynamic_catching"))
    assert not episode.step().failure[0]
    episode.put("ball_free", (0.5, 0.0, 0.03))
    assert episode.step().failure[0]


@pytest.mark.parametrize(("over_bottom_m", "lost"), [(0.005, False), (-0.002, True)])
def test_a_robot_on_the_bottom_of_the_gap_is_lost(over_bottom_m, lost):
    episode = Episode(load_task("gap"))
    middle = (1.0 + episode.variation.parameters["width_m"][0] / 2) * episode.sensor("lane_forward")
    across = episode.sensor("lane_left")
    bottom_m = episode.data.body("pit").xpos[2]
    goal_m = middle + 0.06 * across + (0.0, 0.0, bottom_m + 0.008 + over_bottom_m)
    episode.place(goal_m, across)
    for _ in range(5):
        episode.step(lambda e: e.hold("robot/stick", e.tip_m, goal_m, along=across))
    assert episode.score.failure[0] == lost


@pytest.mark.parametrize(("force_n", "lost"), [(1.0, False), (3.0, True)])
def test_a_fragile_object_that_is_pressed_too_hard_is_lost(force_n, lost):
    episode = Episode(load_task("delicate_grasping"))
    episode.put("object_free", episode.tip_m - (0.0, 0.0, 0.03))
    weight_n = 9.81 * episode.model.body("object").mass[0]

    def press(e: Episode) -> None:
        e.data.xfrc_applied[e.model.body("object").id, 2] = weight_n + force_n

    for _ in range(4):
        episode.step(press)
    assert episode.score.failure[0] == lost


@pytest.mark.parametrize("name", TASKS)
def test_designers_read_the_sentence_of_each_rule_and_no_other(name):
    task, seen = load_task(name), Episode(load_task(name)).look()
    rules, told = task.losses(seen, task.reset_state(seen)), task.criteria.failure
    assert all(sentence in told for sentence in rules)
    assert len(" ".join(rules)) == len(told)
