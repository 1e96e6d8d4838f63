"""What a motion is worth for a goal: what lasts counts, and what breaks a limit is worth half."""

import importlib

import numpy as np
import pytest

from aidsr.learn.episodes.batch import StepResult
from aidsr.learn.episodes.rollout import EpisodeOutcomes
from aidsr.learn.openloop.fitness import SustainedProgress
from aidsr.learn.openloop.motion_search import MOTION_KINDS, TRAVELLING_KINDS, WORKING_KINDS, MotionSpace
from aidsr.learn.openloop.probe_scene import budget_for, kinds_for
from aidsr.tasks import goal_task, load_task, parse_goal

module = importlib.import_module("aidsr.learn.openloop.probe_scene")  # the package has a function of this name
REACH = 'kind = "reach"\ntarget = "button"\nhold_s = 0.4\n'
SPEED = '[[limits]]\nkind = "speed"\nof = "functional_part"\nat_most_m_s = 0.5\n'


def worth(goal, courses, against=None):
    """Fitness of motions by their courses of progress, (n, steps), and of violation."""
    task = goal_task(parse_goal(goal), load_task("button_pushing").environment)
    progress = np.array(courses, dtype=float)
    violation = np.zeros_like(progress) if against is None else np.array(against, dtype=float)
    n = len(progress)
    sustained, no, zeros = SustainedProgress(task, n), np.zeros(n, dtype=bool), np.zeros(n)
    for now, bad in zip(progress.T, violation.T, strict=True):
        sustained(StepResult(np.zeros((n, 1), np.float32), zeros, now, bad, no, no, no, no, zeros))
    return sustained.fitness(EpisodeOutcomes(no, no, no, progress[:, -1], progress.max(axis=1), *[zeros] * 6))


def test_a_motion_that_stays_near_is_worth_more_than_one_that_passes_through():
    # 0.04 s a step: the hold takes ten
    stays, passes = worth(REACH, [[0.8] * 20, [0.1] * 9 + [1.0] * 3 + [0.1] * 8])
    assert stays == pytest.approx(0.8)
    assert passes == pytest.approx((0.1 + 1.0) / 2)


def test_what_counts_against_it_halves_a_motion_and_a_limit_passed_for_long_does_for_good():
    still, knocks, breaks = worth(
        REACH + SPEED, [[1.0] * 30] * 3, [[0.0] * 30, [1.0] * 4 + [0.0] * 26, [1.0] * 6 + [0.0] * 24]
    )
    # what passed a limit for 0.16 and 0.24 s loses up to a tenth for 0.4 s: near the end it would be stopped
    assert (still, knocks, breaks) == pytest.approx((1.0, 0.96, 0.5 * 0.94))
    assert worth(REACH, [[1.0] * 30], [[1.0] * 30])[0] == pytest.approx(0.5)


def test_a_motion_late_over_a_limit_is_worth_less_than_one_that_keeps_it_a_little_shorter_of_the_goal():
    progress = np.concatenate([np.linspace(0, 0.96, 30), np.full(15, 0.96)])
    late, clean = np.zeros((2, 45))
    late[36:] = 1.0  # after all of its progress was held
    over, under = worth(REACH + SPEED, [progress, 0.98 * progress], [late, clean])
    assert under > over


def test_refining_may_keep_to_few_of_the_best():
    space = MotionSpace(rest=np.array([-1.0, -1.0]), longest_s=8.0)
    rng = np.random.default_rng(0)
    rows = space.sample("pull", 200, rng)
    fitness = -np.linalg.norm(rows - rows[7], axis=1)

    def far(most):
        drawn = space.refine(rows, fitness, 400, np.random.default_rng(1), most=most)
        return float(np.linalg.norm(drawn - rows[7], axis=1).mean())

    assert far(8) < 0.9 * far(None)


def test_what_is_best_in_one_variation_of_a_goal_is_tried_in_the_others():
    space, rng = MotionSpace(rest=np.array([-1.0]), longest_s=8.0), np.random.default_rng(0)
    task = goal_task(parse_goal(REACH), load_task("button_pushing").environment)
    searches = [module._Search(index, task.variation("development", index)) for index in range(2)]
    for search in searches:
        search.add("pull", space.sample("pull", 16, rng), rng.random(16), solved=False)
    best = searches[1].best
    (owner, kind, row), (_, _, rest) = module._refined(space, searches[0], searches, 16, rng)
    assert owner is searches[0]
    assert (kind, len(row), len(rest)) == ("pull", 1, 15)
    assert np.array_equal(row[0], best)
    searches[0].add("pull", row, np.zeros(1), solved=False)
    assert [len(rows) for _, _, rows in module._refined(space, searches[0], searches, 16, rng)] == [16], "not twice"
    searches[0].add("hold", space.sample("hold", 16, rng), np.full(16, 0.01), solved=False)
    again = module._refined(space, searches[0], searches, 16, rng)
    assert [(kind, len(rows)) for _, kind, rows in again] == [("pull", 11), ("hold", 5)], "the next best kind as well"


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
