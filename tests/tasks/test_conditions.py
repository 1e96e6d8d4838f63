"""The numbers behind stages such as "around it": they hold at the goal, and one of them does not at the start."""

import numpy as np
import pytest
from goals import played

GRASPS = ("grasping/simple_grasping", "grasping/delicate_grasping", "grasping/ball_from_bowl")
NAMED = (*GRASPS, "grasping/zero_gravity_grasping", "reaching/surface_adapting")


def told(episode, moment: int) -> dict[str, tuple[float, bool]]:
    """Value of each condition at a moment, and whether it holds."""
    readings, state = episode.course[moment]
    found = {}
    for one in episode.task.conditions(readings, state):
        value, limit = float(one.value[0]), float(np.ravel(one.limit)[0])
        found[one.name] = value, value >= limit - 1e-9 if one.at_least else value <= limit + 1e-9
    return found


@pytest.mark.parametrize("name", NAMED)
def test_what_success_asks_for_holds_at_the_goal_and_not_at_the_start(name: str) -> None:
    episode = played(name)
    assert episode.won
    start, goal = told(episode, 0), told(episode, -1)
    asked = [words for words in goal if "face each other" not in words and "functional part" not in words]
    assert all(goal[words][1] for words in asked), goal
    assert not all(holds for _, holds in start.values()), start


def test_the_figures_are_those_of_the_readings() -> None:
    episode = played("grasping/simple_grasping")
    (readings, _), (first, _) = episode.course[-1], episode.course[0]
    risen_mm = 1000 * (readings["object_position"] - first["object_position"])[0, 2]
    assert told(episode, -1)["raised by"][0] == pytest.approx(risen_mm, abs=1.0)
    assert risen_mm > 90
