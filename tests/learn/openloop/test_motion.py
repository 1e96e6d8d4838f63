"""Motions are what their numbers say."""

import numpy as np
import pytest

from aidsr.learn.openloop.motion import GroupMotion, Motion, Motions, OpenLoopPolicy
from aidsr.learn.openloop.motion_search import ALL_KINDS, MotionSpace

RAMP = Motion(begin_s=1.0, ramp_s=2.0, frequency_hz=0.5, groups=(GroupMotion(group="a", first=-1.0, last=0.5),) * 2)
SWING = Motion(
    begin_s=0.1,
    ramp_s=0.1,
    frequency_hz=0.5,
    groups=(
        GroupMotion(group="a", first=0.0, last=0.0, amplitude=0.5, phase_rad=np.pi / 2),
        GroupMotion(group="b", first=0.25, last=0.25),
    ),
)


def test_a_ramp_goes_from_first_to_last_and_a_sinusoid_swings_about_it():
    motions = Motions.of([RAMP, SWING])
    assert np.allclose(motions.at(0.5), [[-1.0, -1.0], [0.0, 0.25]], atol=1e-12)
    assert np.allclose(motions.at(2.0), [[-0.25, -0.25], [0.5 * np.cos(2 * np.pi), 0.25]])
    assert np.allclose(motions.at(9.0), [[0.5, 0.5], [-0.5, 0.25]])


def test_actions_stay_in_their_range():
    wide = SWING.groups[0].model_copy(update={"amplitude": 7.0})
    motions = Motions.of([SWING.model_copy(update={"groups": (wide,)})])
    seen = np.array([motions.at(t)[0, 0] for t in np.linspace(0, 4, 100)])
    assert (seen.min(), seen.max()) == (-1.0, 1.0)


def test_words_say_how_many_groups_move():
    assert RAMP.summary == "ramp from 1 s for 2 s (2 of 2 groups)"
    assert SWING.summary == "swing at 0.5 Hz (1 of 2 groups)"


@pytest.mark.parametrize("family", ALL_KINDS)
def test_families_are_what_they_are_called(family):
    space = MotionSpace(np.array([-1.0, 0.0]), 8.0)
    motions = space.motions(space.sample(family, 40, np.random.default_rng(0)))
    assert bool(motions.change.any()) == (family != "swing")
    assert bool(motions.amplitude.any()) == (family != "pull")
    assert motions.frequency_hz.min() >= 0.3
    assert motions.ramp_s.min() >= 0.1
    assert motions.begin_s.max() <= 4.0


@pytest.mark.parametrize("family", ALL_KINDS)
def test_the_search_stays_in_its_family_and_closes_in_on_the_best(family):
    space, rng = MotionSpace(np.array([-1.0, 0.0]), 8.0), np.random.default_rng(0)
    rows = space.sample(family, 40, rng)
    goal = rows[17].copy()
    for _ in range(12):
        fitness = -np.abs(rows - goal).sum(axis=1)
        rows = np.concatenate([rows, space.refine(rows, fitness, 16, rng)])
    found = space.motions(rows[-16:])
    assert bool(found.change.any()) == (family != "swing")
    assert bool(found.amplitude.any()) == (family != "pull")
    assert np.abs(rows[-15::2] - goal).max(axis=1).mean() < np.abs(rows[:40] - goal).max(axis=1).mean() / 3


def test_a_gait_begins_at_rest_leaves_groups_there_and_gives_each_its_frequency():
    rest = np.array([-1.0, 0.0, -1.0])
    space = MotionSpace(rest, 8.0)
    motions = space.motions(space.sample("gait", 40, np.random.default_rng(0)))
    still = (motions.amplitude == 0.0) & (motions.change == 0.0)
    assert np.all(motions.first == rest)
    assert 0.2 < still.mean() < 0.6
    assert np.allclose(motions.at(3.3)[still], np.tile(rest, (40, 1))[still])
    assert motions.frequency_hz.shape == (40, 3)
    assert np.ptp(motions.frequency_hz, axis=1).max() > 0.3
    again = Motions.of([motions.motion(index, ["a", "b", "c"]) for index in range(40)])
    assert np.allclose(again.at(1.7), motions.at(1.7), atol=5e-3)


def test_batches_of_different_kinds_are_joined():
    space, rng = MotionSpace(np.array([-1.0, 0.0]), 8.0), np.random.default_rng(0)
    parts = [space.motions(space.sample(kind, 3, rng)) for kind in ("swing", "gait")]
    joined = Motions.joined(parts)
    assert np.array_equal(joined.at(1.7), np.concatenate([part.at(1.7) for part in parts]))


def test_a_rounded_motion_is_nearly_the_same():
    space = MotionSpace(np.array([-1.0, 0.0]), 8.0)
    motions = space.motions(space.sample("both", 5, np.random.default_rng(0)))
    again = Motions.of([motions.motion(index, ["a", "b"]) for index in range(5)])
    assert np.allclose(again.at(1.7), motions.at(1.7), atol=5e-3)


def test_an_open_loop_begins_at_its_beginning():
    actor = OpenLoopPolicy(Motions.of([RAMP]), 1.0)
    acted = [actor.act(np.zeros((1, 3)))[0, 0] for _ in range(4)]
    assert np.allclose(acted, [-1.0, -1.0, -0.25, 0.5])


@pytest.mark.parametrize("kind", ALL_KINDS)
@pytest.mark.parametrize("longest_s", [0.2, 1.0])
def test_motions_of_short_episodes_are_drawn_as_well(kind, longest_s):
    rows = MotionSpace(np.array([-1.0, 0.0]), longest_s).sample(kind, 5, np.random.default_rng(0))
    assert len(rows) == 5
    assert np.isfinite(rows).all()
