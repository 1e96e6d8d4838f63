"""Motions of the search end as soon as they have nothing more to tell."""

from dataclasses import dataclass

import numpy as np
import pytest

from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.openloop.early_stop import EarlyStop
from aidsr.learn.openloop.motion import GroupMotion, Motion, Motions, OpenLoopPolicy
from scenes import QuickPushing, small_learning


@dataclass(frozen=True)
class LongPushing(QuickPushing):
    """Takes its time."""

    time_limit_s = 6.0


def moved(last: float, amplitude: float = 0.0) -> Motion:
    left = GroupMotion(group="left", first=-1.0, last=last, amplitude=amplitude)
    right = GroupMotion(group="right", first=-1.0, last=-1.0)
    return Motion(begin_s=0.1, ramp_s=0.1, frequency_hz=1.0, groups=(left, right))


REST, PULL, TREMBLE = moved(-1.0), moved(1.0), moved(-1.0, amplitude=1e-3)


def lasted(chosen: list[Motion], owners: list[int]) -> list[float]:
    scene = small_learning(LongPushing())
    motions = Motions.of(chosen)
    variations = [scene.task.variation("development", 0)] * len(chosen)
    episodes = Episodes(scene.model, scene.task, scene.actions, variations, threads=1)
    stop = EarlyStop(episodes, motions, np.array(owners))
    return rollout(episodes, OpenLoopPolicy(motions, scene.task.control_dt_s), stop).time_s.tolist()


def test_a_solved_variation_needs_no_other_motion() -> None:
    solved, rest = lasted([PULL, REST], [0, 0])
    assert rest == solved < 1.0
    apart, other = lasted([PULL, REST], [0, 1])
    assert apart == solved < other


def test_a_motion_ends_when_nothing_comes_of_it_and_a_swing_is_given_a_period_more() -> None:
    rest, tremble = lasted([REST, TREMBLE], [0, 1])
    assert rest == pytest.approx(0.2 + 1.0, abs=0.3)
    assert tremble == pytest.approx(rest + 1.0, abs=0.3)
