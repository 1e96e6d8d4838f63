"""The reward, held success and episodes that begin anew, with a task made for the purpose."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from aidsr.tasks import Criteria, Readings, Task, Variation
from aidsr.tasks.scoring import merge, reset, score


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
    criteria = Criteria(
        variation="Nothing.",
        progress="The dial's reading.",
        success="The dial is at 1.",
        violation="Beyond 1.",
        failure="Beyond 2.",
    )

    def sample_variation(self, rng):
        return Variation()

    def observe(self, readings, state):
        return readings["dial"]

    def reset_state(self, readings):
        return {"steps": np.zeros(readings.n)}

    def update_state(self, readings, state):
        return {"steps": state["steps"] + 1}

    def progress(self, readings, state):
        return np.clip(readings.scalar("dial"), 0, 1)

    def violation(self, readings):
        return np.clip(readings.scalar("dial") - 1, 0, 1)

    def is_success(self, readings, state):
        return readings.scalar("dial") >= 1

    def is_failure(self, readings, state):
        return readings.scalar("dial") > 2


@dataclass(frozen=True)
class DialOfRules(Dial):
    """The same by rules, each with its sentence."""

    is_failure = Task.is_failure

    def losses(self, readings, state):
        return {**super().losses(readings, state), "Beyond 2.": readings.scalar("dial") > 2}


@dataclass(frozen=True)
class DialOfBoth(DialOfRules):
    """One more way to lose, beside the rules."""

    def is_failure(self, readings, state):
        return super().is_failure(readings, state) | (readings.scalar("dial") < -1)


@dataclass(frozen=True)
class EndlessDial(Dial):
    """Never lost."""

    is_failure = Task.is_failure


DIAL = Dial()
NO_ACTION = np.zeros((2, 3))


def at(*dials: float) -> Readings:
    return Readings(
        sensors={"dial": np.array(dials)[:, None, None]},
        time_s=np.zeros(len(dials)),
        length_m=0.3,
        sample_dt_s=0.002,
    )


@pytest.mark.parametrize(
    ("task", "lost", "rules"),
    [
        (Dial, [True, False, False], ["Beyond 2."]),
        (DialOfRules, [True, False, False], ["Beyond 2."]),
        (DialOfBoth, [True, False, True], ["Beyond 2."]),
        (EndlessDial, [False, False, False], []),
    ],
)
def test_an_episode_is_lost_by_whichever_of_the_two_methods_a_task_defines(task, lost, rules):
    readings = at(2.1, 1.9, -1.1)
    state, result = score(task(), reset(task(), at(0.0, 0.0, 0.0)), readings, np.zeros((3, 1)))
    assert result.failure.tolist() == lost
    assert list(task().losses(readings, state.task_state)) == rules
    assert task.can_be_lost() == any(lost)


def test_reward_is_ten_times_the_gain_in_progress():
    state, result = score(DIAL, reset(DIAL, at(0.0, 0.5)), at(0.3, 0.4), NO_ACTION)
    assert result.reward == pytest.approx([3.0, -1.0])
    assert state.progress == pytest.approx([0.3, 0.4])


def test_reward_charges_violation_and_mean_squared_action():
    _, result = score(DIAL, reset(DIAL, at(0.9, 0.9)), at(0.9, 0.9), np.array([[1.0, -1.0, 0.0], [0.0, 0.0, 0.0]]))
    assert result.reward == pytest.approx([-0.01 * 2 / 3, 0.0])
    _, result = score(DIAL, reset(DIAL, at(1.0, 1.0)), at(1.25, 1.0), NO_ACTION)
    assert result.reward == pytest.approx([-0.25, 0.0])
    assert result.violation == pytest.approx([0.25, 0.0])


def test_success_must_be_held_without_a_break_and_is_paid_once():
    state = reset(DIAL, at(0.0, 0.0))
    rewards, won = [], []
    # 0.2 s are five control steps of 0.04 s; the second simulation lets go in between
    for step in range(8):
        state, result = score(DIAL, state, at(1.0, 0.99 if step == 3 else 1.0), NO_ACTION)
        rewards.append(result.reward)
        won.append(result.success)
    assert np.array(won)[:, 0].tolist() == [False] * 4 + [True] * 4
    assert np.array(won)[:, 1].tolist() == [False] * 8
    assert np.array(rewards)[:, 0] == pytest.approx([10.0, 0, 0, 0, 5.0, 0, 0, 0])


def test_a_failed_episode_holds_nothing():
    state, result = score(DIAL, reset(DIAL, at(1.0, 1.0)), at(3.0, 1.0), NO_ACTION)
    assert result.failure.tolist() == [True, False]
    assert state.held_s == pytest.approx([0.0, 0.04])


def test_success_that_need_not_be_held_must_still_come():
    class Quick(Dial):
        hold_s: ClassVar = 0.0

    _, result = score(Quick(), reset(Quick(), at(0.0, 0.0, 0.0)), at(0.5, 1.0, 3.0), np.zeros((3, 1)))
    assert result.success.tolist() == [False, True, False]


def test_a_start_is_remembered_when_the_simulation_writes_over_it():
    class Turned(Dial):
        def reset_state(self, readings):
            return {"start": readings["dial"]}

    readings = at(0.25, 0.5)
    state = reset(Turned(), readings)
    readings.sensors["dial"][:] = 1.0
    assert state.task_state["start"][:, 0].tolist() == [0.25, 0.5]


def test_merge_replaces_some_episodes_and_keeps_the_others():
    state = reset(DIAL, at(0.0, 0.0))
    for _ in range(5):
        state, _ = score(DIAL, state, at(1.0, 1.0), NO_ACTION)
    fresh = reset(DIAL, at(0.2, 0.2))
    mixed = merge(state, fresh, np.array([True, False]))
    assert mixed.progress == pytest.approx([0.2, 1.0])
    assert mixed.held_s == pytest.approx([0.0, 0.2])
    assert mixed.success.tolist() == [False, True]
    assert mixed.task_state["steps"] == pytest.approx([0.0, 5.0])
