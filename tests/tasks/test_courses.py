"""What holds all along a way to the goal of each task."""

import goals
import numpy as np
import pytest
from sights import stacked
from stick import Episode

from aidsr.tasks import TASKS, Task, load_task
from aidsr.tasks.scoring import reset, score

BOTH_LEVELS = [(name, level) for name in TASKS for level in ("standard", "hard")]

ENDS = {
    "grasping/ball_from_bowl": 0.65,
    "grasping/simple_grasping": 0.55,
    "grasping/delicate_grasping": 0.55,
    "grasping/zero_gravity_grasping": 0.29,
}
"""Progress at the goal where no hand grips the object from two sides; elsewhere it is 0.9 at least."""

MOVES = {
    "reaching/button_pushing": {0, 1, 2, 6, 7, 8},
    "reaching/surface_adapting": {0, 2, 7, 8, 9, 10},
    "reaching/pipe_inserting": {0, 1, 2, 3, 4, 5, 9},
    "reaching/around_corners": {0, 2, 3, 5, 9},
    "grasping/ball_from_bowl": {2, 5, 8, 10},
    "locomotion/incline": {0, 2},
    "manipulation/crank_turning": {1, 2, 3, 4, 5},
    "grasping/simple_grasping": {2, 5, 8, 9, 10},
    "grasping/zero_gravity_grasping": {2, 3, 4, 5, 8, 9, 10, 11, 13, 14},
    "grasping/delicate_grasping": {2, 3, 4, 5, 8, 9, 10},
    "grasping/dynamic_catching": {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13},
    "locomotion/flat_ground": {0},
    "locomotion/stairs": {0, 2},
    "locomotion/obstacles": {0, 1, 8, 9, 10, 11},
    "locomotion/gap": {0, 8, 9},
    "locomotion/tunnel": {0, 1, 8, 9},
    "manipulation/drawer_opening": {0, 1, 2, 3, 4, 5, 8, 9, 10},
    "manipulation/force_controlled_brushing": {0, 1, 2, 8},
}
"""Features that change on the way."""


@pytest.mark.parametrize(("name", "level"), BOTH_LEVELS)
def test_a_goal_reached_by_hand_succeeds_and_progress_leads_there(name, level):
    episode = goals.played(name, level)
    progress = np.array(episode.progress)
    assert episode.won
    assert not episode.score.failure[0]
    assert 0.0 <= progress.min() <= progress.max() <= 1.0
    assert np.diff(progress).min() > -0.02
    assert progress[-1] > progress.max() - 0.02
    assert progress[0] < 0.5
    assert progress[-1] >= ENDS.get(name, 0.9)
    way = (progress - progress[0]) / (progress[-1] - progress[0])
    assert ((way > 0.1) & (way < 0.9)).any()


@pytest.mark.parametrize(("name", "level"), BOTH_LEVELS)
def test_nothing_on_the_way_counts_against_it(name, level):
    episode = goals.played(name, level)
    assert not any(episode.task.violation(seen).any() for seen, _ in episode.course)


@pytest.mark.parametrize("name", TASKS)
def test_features_lie_in_their_ranges_and_change_on_the_way(name):
    episode = goals.played(name)
    low, high = _ranges(episode.task)
    features = np.concatenate([episode.task.observe(seen, memory) for seen, memory in episode.course])
    # what is pressed against a stop gives way a little
    slack = 0.05 * (high - low)
    assert (features >= low - slack).all()
    assert (features <= high + slack).all()
    assert MOVES[name] <= set(np.flatnonzero(np.ptp(features, axis=0) > 1e-3))


@pytest.mark.parametrize("name", TASKS)
def test_many_episodes_are_scored_as_each_alone(name):
    task, goal = load_task(name), goals.played(name)
    idle = Episode(task, base=goal.base, index=1)
    for _ in goal.course[1:]:
        idle.step()
    still, there = ([seen for seen, _ in episode.course] for episode in (idle, goal))
    courses = (still, there, there[:1] * 3 + there[:-3])
    alone = [_scored(task, course) for course in courses]
    together = _scored(task, [stacked(moment) for moment in zip(*courses, strict=True)])
    for what, course in together.items():
        apart = np.concatenate([one[what] for one in alone], axis=1)
        assert course == pytest.approx(apart, rel=1e-9, abs=1e-12), what


def _scored(task, course) -> dict[str, np.ndarray]:
    """What a course is worth, what is remembered of it and what a policy sees, (steps, n, ...) by name."""
    state, steps = reset(task, course[0]), []
    for seen in course[1:]:
        state, worth = score(task, state, seen, np.zeros((seen.n, 1)))
        succeeded = task.is_success(seen, state.task_state)
        features = task.observe(seen, state.task_state)
        steps.append({**vars(worth), **state.task_state, "features": features, "at the goal": succeeded})
    return {what: np.array([step[what] for step in steps], dtype=float) for what in steps[0]}


def _ranges(task: Task) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper ends of all features."""
    ends = [feature.range for feature in task.features for _ in range(feature.size)]
    return tuple(np.array(ends, dtype=float).T)
