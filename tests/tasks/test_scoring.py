"""The reward, held success and restarts, with a task made for the purpose."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from aidsr.tasks import Readings, Task, Variation
from aidsr.tasks.scoring import begin, restart, score


@dataclass(frozen=True)
class Dial(Task):
    """Turn a dial to 1: progress is its reading."""

    name: ClassVar = "test/dial"
    base: ClassVar = "fixed"
    time_limit_s: ClassVar = 4.0
    hold_s: ClassVar = 0.2
    required_names: ClassVar = ()
    sensors: ClassVar = ()

    objective = "Turn the dial to 1."

    def draw(self, rng):
        return Variation()

    def features(self, readings, memory):
        return readings["dial"]

    def begin(self, readings):
        return {"steps": np.zeros(readings.n)}

    def remember(self, readings, memory):
        return {"steps": memory["steps"] + 1}

    def progress(self, readings, memory):
        return np.clip(readings.scalar("dial"), 0, 1)

    def violation(self, readings):
        return np.clip(readings.scalar("dial") - 1, 0, 1)

    def succeeded(self, readings, memory):
        return readings.scalar("dial") >= 1

    def failed(self, readings, memory):
        return readings.scalar("dial") > 2


DIAL = Dial()
NO_ACTION = np.zeros((2, 3))


def at(*dials: float) -> Readings:
    return Readings(
        sensors={"dial": np.array(dials)[:, None, None]},
        time_s=np.zeros(len(dials)),
        length_m=0.3,
        sample_dt_s=0.002,
    )


def test_reward_is_ten_times_the_gain_in_progress():
    standing, result = score(DIAL, begin(DIAL, at(0.0, 0.5)), at(0.3, 0.4), NO_ACTION)
    assert result.reward == pytest.approx([3.0, -1.0])
    assert standing.progress == pytest.approx([0.3, 0.4])


def test_reward_charges_violation_and_mean_squared_action():
    _, result = score(DIAL, begin(DIAL, at(0.9, 0.9)), at(0.9, 0.9), np.array([[1.0, -1.0, 0.0], [0.0, 0.0, 0.0]]))
    assert result.reward == pytest.approx([-0.01 * 2 / 3, 0.0])
    _, result = score(DIAL, begin(DIAL, at(1.0, 1.0)), at(1.25, 1.0), NO_ACTION)
    assert result.reward == pytest.approx([-0.25, 0.0])
    assert result.violation == pytest.approx([0.25, 0.0])


def test_success_must_be_held_without_a_break_and_is_paid_once():
    standing = begin(DIAL, at(0.0, 0.0))
    rewards, won = [], []
    # 0.2 s are five control steps of 0.04 s; the second simulation lets go in between
    for step in range(8):
        standing, result = score(DIAL, standing, at(1.0, 0.99 if step == 3 else 1.0), NO_ACTION)
        rewards.append(result.reward)
        won.append(result.succeeded)
    assert np.array(won)[:, 0].tolist() == [False] * 4 + [True] * 4
    assert np.array(won)[:, 1].tolist() == [False] * 8
    assert np.array(rewards)[:, 0] == pytest.approx([10.0, 0, 0, 0, 5.0, 0, 0, 0])


def test_a_failed_episode_holds_nothing():
    standing, result = score(DIAL, begin(DIAL, at(1.0, 1.0)), at(3.0, 1.0), NO_ACTION)
    assert result.failed.tolist() == [True, False]
    assert standing.held_s == pytest.approx([0.0, 0.04])


def test_success_that_need_not_be_held_must_still_come():
    class Quick(Dial):
        hold_s: ClassVar = 0.0

    _, result = score(Quick(), begin(Quick(), at(0.0, 0.0, 0.0)), at(0.5, 1.0, 3.0), np.zeros((3, 1)))
    assert result.succeeded.tolist() == [False, True, False]


def test_a_start_is_remembered_when_the_simulation_writes_over_it():
    class Turned(Dial):
        def begin(self, readings):
            return {"start": readings["dial"]}

    readings = at(0.25, 0.5)
    standing = begin(Turned(), readings)
    readings.sensors["dial"][:] = 1.0
    assert standing.memory["start"][:, 0].tolist() == [0.25, 0.5]


def test_restart_replaces_some_episodes_and_keeps_the_others():
    standing = begin(DIAL, at(0.0, 0.0))
    for _ in range(5):
        standing, _ = score(DIAL, standing, at(1.0, 1.0), NO_ACTION)
    fresh = begin(DIAL, at(0.2, 0.2))
    mixed = restart(standing, fresh, np.array([True, False]))
    assert mixed.progress == pytest.approx([0.2, 1.0])
    assert mixed.held_s == pytest.approx([0.0, 0.2])
    assert mixed.won.tolist() == [False, True]
    assert mixed.memory["steps"] == pytest.approx([0.0, 5.0])
