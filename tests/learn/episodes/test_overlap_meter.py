"""Overlap in parallel episodes is measured as the evaluation of a policy measures it."""

import numpy as np
import pytest

from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.overlap_meter import OverlapMeter
from aidsr.learn.episodes.rollout import Constant, rollout
from scenes import small_learning


def two_arms() -> Episodes:
    scene = small_learning()
    variations = [scene.task.variation("development", index) for index in range(2)]
    return Episodes(scene.model, scene.task, scene.actions, variations, threads=1)


def fold_the_first(episodes: Episodes) -> Episodes:
    bends = [episodes.model.joint(f"robot/bend{index}").qposadr[0] for index in (1, 2, 3, 4)]
    episodes.batch.bind("qpos")[0, bends] = np.pi / 2  # four right angles: the tip is in the base
    return episodes


def test_a_folded_arm_overlaps_deeply_and_a_straight_one_does_not():
    episodes = fold_the_first(two_arms())
    meter = OverlapMeter(episodes)
    depth = meter.measure(np.array([True, True]))
    assert depth[0] > 1.0
    assert depth[1] < 0.1
    assert meter.is_deep.tolist() == [True, False]
    assert meter.deepest == pytest.approx(depth)


def test_an_arm_that_passes_through_itself_overlaps_as_deeply():
    on, off = fold_the_first(two_arms()), fold_the_first(two_arms())
    off.model.geom_contype[list(off.structure.geoms)] = 1
    off.model.geom_conaffinity[list(off.structure.geoms)] = 0
    both = np.array([True, True])
    assert OverlapMeter(off).measure(both) == pytest.approx(OverlapMeter(on).measure(both), rel=0.02)


def test_the_deepest_overlap_is_kept_until_the_episode_is_reset():
    episodes = fold_the_first(two_arms())
    meter = OverlapMeter(episodes)
    meter.measure(np.array([True, True]))
    episodes.reset(np.array([0]), [episodes.variations[0]])
    assert meter.measure(np.array([True, True]))[0] < 0.1
    assert meter.is_deep[0]
    meter.reset(np.array([0]))
    assert not meter.is_deep.any()


def test_episodes_that_are_not_asked_for_have_none():
    meter = OverlapMeter(fold_the_first(two_arms()))
    assert meter.measure(np.array([False, True]))[0] == 0.0
    assert not meter.is_deep.any()


def test_a_rollout_is_measured_after_each_of_its_steps():
    episodes = two_arms()
    meter, steps = OverlapMeter(episodes), []

    def fold_once(result):
        steps.append(result)
        if len(steps) == 3:
            fold_the_first(episodes)
        meter.after(result)

    rollout(episodes, Constant(episodes.actions.rest), fold_once)
    assert len(steps) > 3
    assert meter.is_deep.tolist() == [True, False]
