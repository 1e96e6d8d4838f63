"""What progress is worth half way, from states that are written down; see `test_courses` for whole ways."""

import pytest
import states
from table import TABLE

from aidsr.tasks import TASKS, goal_task, load_task, parse_goal

HALF_WAY = [
    ("button_pushing", {"travel_m": 0.0025, "away_m": 0.01}, 0.75),
    ("button_pushing", {"travel_m": 0.0025, "asked": 0.0}, 0.5),
    ("button_pushing", {"travel_m": 0.0, "away_m": 0.05}, 0.25 / 1.36 + 0.25 * 0.1),
    ("surface_adapting", {"lying": 3, "gap_lengths": 0.029}, 0.832),
    ("surface_adapting", {"lying": 3, "gap_lengths": 0.029, "spread_lengths": 0.075}, 0.732),
    ("surface_adapting", {"lying": 0, "touch_n": 0.0}, 0.392),
    ("pipe_inserting", {"branch_m": 0.1}, 1.0),
    ("pipe_inserting", {"way": -1.5, "beside_m": 0.0}, 0.0185),
    *[
        (name, state, progress)
        for name in ("simple_grasping", "delicate_grasping")
        for state, progress in (
            ({"raised_m": 0.0, "away_m": 0.25}, 0.03),
            ({"raised_m": 0.05, "away_m": 0.25}, 0.23),
            ({"raised_m": 0.05, "away_m": 0.05, "opposed": True}, 0.8),
        )
    ],
    ("zero_gravity_grasping", {"away_m": 0.25}, 0.03),
    ("zero_gravity_grasping", {"away_m": 0.05, "opposed": True, "drift_m_s": 0.12}, 0.64),
    ("zero_gravity_grasping", {"away_m": 0.05, "opposed": True}, 1.0),
    ("dynamic_catching", {"closest_m": 0.24, "touched": 0.0, "caught_s": 0.0, "kept": 0.0}, 0.02),
    ("dynamic_catching", {"closest_m": 0.04, "touched": 0.0, "caught_s": 0.0, "kept": 0.0}, 0.2),
    ("dynamic_catching", {"caught_s": 1.25, "kept": 0.0}, 0.65),
    ("dynamic_catching", {"away_m": 0.075}, 0.95),
    ("around_corners", {"tip_n": 0.25}, 0.95),
    ("around_corners", {"tip_n": 0.0, "above_m": 0.05}, 0.7 + 0.1 / 1.36 + 0.1 * 0.1),
    ("ball_from_bowl", {"raised_m": 0.0, "away_m": 0.25}, 0.03),
    ("ball_from_bowl", {"raised_m": 0.05, "away_m": 0.05, "opposed": True}, 0.8),
    ("incline", {"way": 0.5, "climbed": 0.0}, 0.45),
    ("incline", {"way": 0.5, "climbed": 0.4}, 0.5),
    ("crank_turning", {"turned_deg": 135.0}, 0.6),
    ("crank_turning", {"turned_deg": 135.0, "near": False}, 0.5),
    ("crank_turning", {"turned_deg": -90.0}, 0.2),
    ("flat_ground", {"forward_m": 0.75}, 0.5),
    ("flat_ground", {"forward_m": 0.75, "length_m": 0.75}, 0.25),
    ("flat_ground", {"forward_m": -0.6}, 0.0),
    ("stairs", {"way": 0.5, "climbed": 0.0}, 0.45),
    ("stairs", {"way": 0.5, "climbed": 0.4}, 0.5),
    ("gap", {"way": 0.4}, 0.4),
    ("tunnel", {"way": 0.4}, 0.4),
    ("tunnel", {"way": 0.8}, 0.8),
]


@pytest.mark.parametrize(("name", "state", "progress"), HALF_WAY)
def test_half_way_is_worth_what_the_task_says(name, state, progress):
    task, seen, memory = states.of(name, **state)
    assert task.progress(seen, memory) == pytest.approx([progress], abs=5e-3)


def test_each_task_says_which_of_its_stages_is_decisive():
    assert load_task("gap").decisive_stage() == (1.0, "on the far side")
    assert goal_task(parse_goal('kind = "reach"\ntarget = "ball"'), TABLE).decisive_stage() == (1.0, "there"), "of two"
    assert load_task("simple_grasping").decisive_stage() == (0.7, "off the table"), "the last but one unless named"
    for name in TASKS:
        task = load_task(name)
        assert task.decisive_stage() in task.stages
        assert task.decisive_stage() != task.stages[0], "beginning is not enough"
