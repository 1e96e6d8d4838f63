"""What a motion is worth for a goal: what lasts counts, and what breaks a limit is worth half."""

import numpy as np
import pytest

from aidsr.learn.episodes.batch import StepResult
from aidsr.learn.episodes.rollout import EpisodeOutcomes
from aidsr.learn.openloop.holding import Holding
from aidsr.learn.openloop.motion_search import MOTION_KINDS, TRAVELLING_KINDS, WORKING_KINDS, MotionSpace
from aidsr.learn.openloop.probe_scene import budget_for, kinds_for
from aidsr.tasks import goal_task, load_task, parse_goal

REACH = 'kind = "reach"\ntarget = "button"\nhold_s = 0.4\n'
SPEED = '[[limits]]\nkind = "speed"\nof = "functional_part"\nat_most_m_s = 0.5\n'


def worth(goal, courses, against=None):
    """Fitness of motions by their courses of progress, (n, steps), and of violation."""
    task = goal_task(parse_goal(goal), load_task("button_pushing").environment)
    progress = np.array(courses, dtype=float)
    violation = np.zeros_like(progress) if against is None else np.array(against, dtype=float)
    n = len(progress)
    holding, no, zeros = Holding(task, n), np.zeros(n, dtype=bool), np.zeros(n)
    for now, bad in zip(progress.T, violation.T, strict=True):
        holding(StepResult(np.zeros((n, 1), np.float32), zeros, now, bad, no, no, no, no, zeros))
    return holding.fitness(EpisodeOutcomes(no, no, no, progress[:, -1], progress.max(axis=1), *[zeros] * 5))


def test_a_motion_that_stays_near_is_worth_more_than_one_that_passes_through():
    # 0.04 s a step: the hold takes ten
    stays, passes = worth(REACH, [[0.8] * 20, [0.1] * 9 + [1.0] * 3 + [0.1] * 8])
    assert stays == pytest.approx(0.8)
    assert passes == pytest.approx((0.1 + 1.0) / 2)


def test_what_counts_against_it_halves_a_motion_and_a_limit_passed_for_long_does_for_good():
    still, knocks, breaks = worth(
        REACH + SPEED, [[1.0] * 30] * 3, [[0.0] * 30, [1.0] * 4 + [0.0] * 26, [1.0] * 6 + [0.0] * 24]
    )
    assert (still, knocks, breaks) == pytest.approx((1.0, 1.0, 0.5))
    assert worth(REACH, [[1.0] * 30], [[1.0] * 30])[0] == pytest.approx(0.5)


def test_a_goal_is_searched_longer_and_by_other_motions():
    own = goal_task(parse_goal(REACH), load_task("button_pushing").environment)
    walk = goal_task(parse_goal('kind = "travel"\ndistance_m = 1'), load_task("button_pushing").environment)
    assert [kinds_for(task) for task in (own, walk, load_task("button_pushing"))] == [
        WORKING_KINDS,
        TRAVELLING_KINDS,
        MOTION_KINDS,
    ]
    assert budget_for(own) > budget_for(load_task("button_pushing"))


def test_a_hold_goes_from_rest_to_a_value_and_keeps_it():
    space = MotionSpace(rest=np.array([-1.0, 0.0]), longest_s=8.0)
    motions = space.motions(space.sample("hold", 50, np.random.default_rng(0)))
    assert np.allclose(motions.at(0.0), [-1.0, 0.0])
    assert np.array_equal(motions.at(2.0), motions.at(8.0)), "ramps of at most a fifth of the time, begun after 0.1 s"
    assert (np.abs(motions.at(8.0) - [-1.0, 0.0]).max(axis=1) > 0.1).mean() > 0.5
