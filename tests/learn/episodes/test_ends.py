"""Where episodes end is kept with them, and told in words."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.tools.carts import cart

from aidsr.core.artifacts import EpisodeResult, Evaluation
from aidsr.core.ends import ends_in_words, evaluation_in_words, rules_in_words
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.openloop.script_policy import script_policy

FAST = '\n[[limits]]\nkind = "speed"\nof = "robot"\nat_most_m_s = 0.3\n'


def played(folder: Path, goal: str, script: str) -> EpisodeResult:
    scene = cart(folder)
    assert scene.goal is not None
    scene.goal.write_text(goal)
    loaded = scene.load()
    variation = loaded.task.variation("development", 0)
    episodes = Episodes(loaded.model, loaded.task, loaded.actions, [variation], threads=1)
    return rollout(episodes, script_policy(loaded, script)).result(0, 0)


GOAL = 'kind = "travel"\ndistance_m = 0.2\ntime_limit_s = 2\nhold_s = 0.6\n'


def test_a_goal_that_is_passed_by_and_left_says_how_long_it_was_held(tmp_path: Path) -> None:
    there_and_back = "drive: t=0 0.5, t=1 0.5, t=1.01 -0.5"
    end = played(tmp_path, GOAL, there_and_back)
    assert end.ended == "out_of_time"
    assert end.reached.endswith("but success was not held")
    assert end.held_s == pytest.approx(0.4, abs=0.08), "0.25 m/s for 1 s, then back: 0.2 s beyond 0.2 m, twice"
    (line,) = ends_in_words([end], 0.6)
    assert line == f"1 of 1: {end.reached}; held for at most {end.held_s:.3g} s of 0.6 s"


def test_a_limit_that_was_passed_is_named_with_how_much_and_how_long(tmp_path: Path) -> None:
    end = played(tmp_path, GOAL.replace("0.2", "0.55") + FAST, "drive: t=0 0.8, t=1 0.8, t=1.01 0.1")
    (limit,) = end.exceeded_limits
    assert (limit.limit, limit.allowed, limit.unit) == ("speed of robot", 0.3, "m/s")
    assert limit.worst == pytest.approx(0.4, rel=0.02)
    assert limit.time_s == pytest.approx(1.0, abs=0.08)
    assert ends_in_words([end, end], 0.4)[-1].startswith(
        "a limit exceeded in 2 of 2, worst: speed of robot 0.4 m/s of 0.3 m/s"
    )
    assert played(tmp_path, GOAL + FAST, "drive: 0.5").exceeded_limits == ()


def test_limits_in_older_files_are_read() -> None:
    limit = {"limit": "speed of robot", "worst": 0.4, "allowed": 0.3, "unit": "m/s", "time_s": 1.0}
    numbers = {"progress": 0.0, "best_progress": 0.0, "reward": 0.0, "time_s": 2.0}
    older = EpisodeResult.model_validate({"variation": 0, "ended": "failed", **numbers, "passed": [limit]})
    assert [each.limit for each in older.exceeded_limits] == ["speed of robot"]
    assert EpisodeResult.model_validate_json(older.model_dump_json()) == older
    assert "passed" not in older.model_dump()


def test_the_band_of_a_touch_is_such_a_limit(tmp_path: Path) -> None:
    scene = cart(tmp_path)
    walled = scene.mjcf.replace(
        '<geom name="wall" type="box" size="0.01 0.5 0.2" pos="0.51 0 0.2"/>',
        '<body name="wall" pos="0.51 0 0.2"><geom type="box" size="0.01 0.5 0.2"/></body>',
    )
    assert scene.goal is not None
    scene.goal.write_text('kind = "touch"\ntarget = "wall"\nforce_n = 1\nat_most_n = 6\ntime_limit_s = 2\n')
    loaded = scene.model_copy(update={"mjcf": walled}).load()
    episodes = Episodes(loaded.model, loaded.task, loaded.actions, [loaded.task.variation("development", 0)], threads=1)
    ended = rollout(episodes, script_policy(loaded, "drive: 1")).result(0, 0)
    (limit,) = ended.exceeded_limits
    assert (limit.limit, limit.allowed) == ("force on wall", 6.0)
    assert limit.worst > 100.0
    assert (ended.ended, limit.time_s, limit.tolerated_s) == ("failed", 0.04, 0.0), "none of it is tolerated"
    assert limit.text.endswith(f"of 6 N allowed, for {limit.time_s:.3g} s")


def test_ways_to_end_are_counted_and_those_of_older_results_left_out() -> None:
    def ended(reached: str, held_s: float) -> EpisodeResult:
        won = reached == "held success"
        numbers = {"progress": 1.0, "best_progress": 1.0, "reward": 0.0, "time_s": 1.0}
        return EpisodeResult(
            variation=0, ended="succeeded" if won else "out_of_time", reached=reached, held_s=held_s, **numbers
        )

    left = "there, but success was not held"
    some = [ended("held success", 0.5), ended(left, 0.1), ended(left, 0.3)]
    assert ends_in_words(some, 0.5) == [f"2 of 3: {left}; held for at most 0.3 s of 0.5 s", "1 of 3: held success"]
    assert ends_in_words([ended("", 0.0)], 0.5) == []


def test_the_rules_that_end_episodes_are_counted() -> None:
    def ended(how: str) -> EpisodeResult:
        numbers = {"progress": 0.0, "best_progress": 0.0, "reward": 0.0, "time_s": 1.0}
        return EpisodeResult.model_validate({"variation": 0, "ended": how, **numbers})

    some = [
        ended("succeeded"),
        ended("failed"),
        ended("failed"),
        ended("failed"),
        ended("out_of_time"),
        ended("failed"),
    ]
    assert rules_in_words(some, time_limit_s=30.0, failure="It fell off.") == (
        "6 episodes ended: 4 by the task's own rule (It fell off), 1 by success, 1 by the time limit of 30 s"
    )
    assert rules_in_words([ended("diverged")], time_limit_s=30.0, failure="") == (
        "1 episodes ended: 1 by a simulation that diverged"
    )


def test_the_time_in_which_a_penalty_applied_is_kept_and_told(tmp_path: Path) -> None:
    end = played(tmp_path, GOAL.replace("0.2", "0.55") + FAST, "drive: t=0 0.8, t=1 0.8, t=1.01 0.1")
    assert end.penalized_s == pytest.approx(1.0, abs=0.08), "0.4 m/s of 0.3 m/s for 1 s"
    assert played(tmp_path, GOAL + FAST, "drive: 0.5").penalized_s == 0.0


def evaluated(*episodes: EpisodeResult) -> Evaluation:
    return Evaluation(task="a/b", level="standard", benchmark_version=6, episodes=episodes, checks=())


def test_penalties_are_told_of_successful_episodes_alone() -> None:
    def ended(how: str, time_s: float, penalized_s: float | None) -> EpisodeResult:
        numbers = {"progress": 1.0, "best_progress": 1.0, "reward": 0.0, "time_s": time_s}
        return EpisodeResult(variation=0, ended=how, penalized_s=penalized_s, **numbers)

    lost, clean = ended("out_of_time", 9.0, 9.0), ended("succeeded", 3.0, 0.0)
    found = evaluated(ended("succeeded", 1.0, 0.5), clean, lost)
    assert found.penalized_share == 0.125
    assert evaluation_in_words(found) == ["the task's penalty applied in 12.5% of the time of the successful episodes"]
    assert evaluation_in_words(evaluated(clean, lost)) == []
    assert evaluated(lost).penalized_share is None
    assert evaluated(ended("succeeded", 1.0, None)).penalized_share is None, "an older result"
