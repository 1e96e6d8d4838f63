"""Where success of a goal begins and ends: what just misses it does not count."""

import numpy as np
import pytest
from table import TABLE

from aidsr.tasks import Readings, goal_task, parse_goal
from aidsr.tasks.scoring import reset, score

DT_S = 0.002
"""Between two samples: five of them are 10 ms."""


def read(**sensors) -> Readings:
    """One simulation's sensors: the newest sample of each, (k,), or all of them, (s, k)."""
    samples = {name: np.atleast_2d(np.asarray(value, dtype=float))[None] for name, value in sensors.items()}
    return Readings(samples, np.zeros(1), 0.3, DT_S)


def forces(*newtons: float) -> Readings:
    """A touch with these forces, oldest first."""
    return read(goal_offset=np.zeros(3), goal_gap=[0.0], goal_force=[(0.0, 0.0, force) for force in newtons])


def moved(*way_m: float) -> Readings:
    still = {"com_position": way_m, "com_velocity": np.zeros(3)}
    return read(goal_offset=np.zeros(3), goal_gap=[0.0], goal_position=way_m, **still)


REACH = 'kind = "reach"\ntarget = "hook"\nwithin_m = 0.05'
LIFT = 'kind = "lift"\ntarget = "ball"\nby_m = 0.08'
PUSH = 'kind = "travel"\ntarget = "ball"\ndistance_m = 0.2\ndirection = [0, 2, 0]'
WALK = 'kind = "travel"\ndistance_m = 0.4\ndirection = [0, 0, -3]'
TOUCH = 'kind = "touch"\ntarget = "post"\nforce_n = 1\nat_most_n = 3'
FIRM = 'kind = "touch"\ntarget = "post"\nforce_n = 1'
ENDS = {
    "reach, there": (REACH, read(goal_offset=(0.0, 0.03, -0.039)), True),
    "reach, beside it": (REACH, read(goal_offset=(0.0, 0.03, -0.041)), False),
    "lift, high enough": (LIFT, moved(0.0, 0.0, 0.0801), True),
    "lift, too low": (LIFT, moved(0.0, 0.0, 0.0799), False),
    "lift, only aside": (LIFT, moved(0.3, 0.3, 0.0), False),
    "push, far enough": (PUSH, moved(-0.1, 0.2001, 0.0), True),
    "push, too near": (PUSH, moved(-0.1, 0.1999, 0.0), False),
    "push, the wrong way": (PUSH, moved(0.3, -0.3, 0.3), False),
    "walk, far enough": (WALK, moved(0.0, 0.0, -0.4001), True),
    "walk, too near": (WALK, moved(0.0, 0.0, -0.3999), False),
    "touch, firm enough": (TOUCH, forces(1.01), True),
    "touch, too light": (TOUCH, forces(0.99), False),
    "touch, not too hard": (TOUCH, forces(2.99), True),
    "touch, too hard": (TOUCH, forces(3.01), False),
    "touch, as hard as you like": (FIRM, forces(1000.0), True),
    "touch, too hard before": (TOUCH, forces(*[4.0] * 5, *[2.0] * 15), False),
    "touch, a step of the solver was hard": (TOUCH, forces(2.0, 2.0, 2.0, 2.0, 6.5), True),
    "touch, a step of the solver was light": (TOUCH, forces(*[0.0] * 15, 2.0, 2.0, 2.0, 2.0, 0.0), True),
    "touch, let go": (TOUCH, forces(*[2.0] * 15, *[0.0] * 5), False),
}


@pytest.mark.parametrize(("text", "now", "won"), ENDS.values(), ids=ENDS)
def test_success_ends_where_the_goal_says(text, now, won):
    task = goal_task(parse_goal(text), TABLE)
    first = forces(0.0) if task.name == "goal/touch" else moved(0.0, 0.0, 0.0)
    assert task.is_success(now, task.reset_state(first)).tolist() == [won]


@pytest.mark.parametrize(("hard_n", "lost"), [(2.99, False), (3.01, True)])
def test_a_touch_that_was_too_hard_at_any_moment_is_no_success_later(hard_n, lost):
    task = goal_task(parse_goal(f"{TOUCH}\nhold_s = 0.12"), TABLE)
    state = reset(task, forces(0.0))
    first = None
    for force_n in (hard_n, 0.0, 2.0, 2.0, 2.0):
        state, worth = score(task, state, forces(force_n), np.zeros((1, 1)))
        first = worth if first is None else first
    assert first.failure.tolist() == [lost], "the episode ends there"
    assert task.judging()["Lost at once"] == "More than 3 N by the functional part on post at any moment."
    assert "Lost at once" not in goal_task(parse_goal(FIRM), TABLE).judging()


def test_a_stage_that_bounds_a_force_bounds_it_from_beginning_to_end():
    stages = f'kind = "stages"\n[[stages]]\n{REACH}\nby_s = 4\n[[stages]]\n{TOUCH}\n'
    task = goal_task(parse_goal(stages), TABLE)
    now = {"goal1_offset": (0.5, 0.0, 0.0), "goal2_offset": (0.0, 0.0, 0.0), "goal2_gap": [0.0]}
    for force_n, rules in ((2.0, []), (4.0, ["More than 3 N by the functional part on post at any moment."])):
        seen = read(**now, goal2_force=(0.0, 0.0, force_n))
        lost = task.losses(seen, task.reset_state(seen))
        assert list(lost) == [
            "Stage 1 is not over after 4 s.",
            "More than 3 N by the functional part on post at any moment.",
        ]
        assert [rule for rule, where in lost.items() if where[0]] == rules
        assert task.is_failure(seen, task.reset_state(seen)).tolist() == [bool(rules)]
    assert task.judging()["Lost at once"] == " ".join(lost)


@pytest.mark.parametrize("hard", ["goal1_force", "goal2_force"])
def test_two_stages_that_bound_the_same_force_of_different_parts_are_two_rules(hard):
    stages = "".join(f'[[stages]]\n{TOUCH}\npart = "{part}"\n' for part in ("robot", "functional_part"))
    task = goal_task(parse_goal(f'kind = "stages"\n{stages}'), TABLE)
    still = {f"goal{i}_{name}": np.zeros(k) for i in (1, 2) for name, k in (("offset", 3), ("gap", 1), ("force", 3))}
    seen = read(**{**still, hard: (0.0, 0.0, 4.0)})
    lost = task.losses(seen, task.reset_state(seen))
    by = "the robot" if hard == "goal1_force" else "the functional part"
    assert [rule for rule, where in lost.items() if where[0]] == [f"More than 3 N by {by} on post at any moment."]
    assert task.is_failure(seen, task.reset_state(seen)).tolist() == [True]
    assert task.judging()["Lost at once"] == " ".join(lost)


@pytest.mark.parametrize("hard", ["goal1_force", "goal2_force"])
def test_two_stages_with_the_same_bound_are_one_rule_that_either_breaks(hard):
    task = goal_task(parse_goal('kind = "stages"\n' + f"[[stages]]\n{TOUCH}\n" * 2), TABLE)
    still = {f"goal{i}_{name}": np.zeros(k) for i in (1, 2) for name, k in (("offset", 3), ("gap", 1), ("force", 3))}
    seen = read(**{**still, hard: (0.0, 0.0, 4.0)})
    lost = task.losses(seen, task.reset_state(seen))
    assert {rule: where.tolist() for rule, where in lost.items()} == {
        "More than 3 N by the functional part on post at any moment.": [True]
    }


@pytest.mark.parametrize("part", ["robot", "functional_part"])
def test_the_part_that_must_touch_is_the_one_that_is_measured(part):
    task = goal_task(parse_goal(f'{TOUCH}\npart = "{part}"'), TABLE)
    assert [sensor.part for sensor in task.sensors if sensor.name == "goal_force"] == [part]


def test_time_and_base_are_those_of_the_goal():
    task = goal_task(parse_goal(f'{LIFT}\nhold_s = 0.12\ntime_limit_s = 3\nbase = "free"'), TABLE)
    assert (task.hold_s, task.time_limit_s, task.base) == (0.12, 3.0, "free")
    assert (task.brief().base, task.brief().judging["Time"][:3]) == ("free", "3 s")
    state, won = reset(task, moved(0.0, 0.0, 0.0)), []
    for _ in range(4):
        state, result = score(task, state, moved(0.0, 0.0, 0.1), np.zeros((1, 1)))
        won.append(bool(result.success[0]))
    assert won == [False, False, True, True]


def test_a_goal_that_need_not_be_held_must_still_be_reached():
    task = goal_task(parse_goal(f"{LIFT}\nhold_s = 0"), TABLE)
    state = reset(task, moved(0.0, 0.0, 0.0))
    state, result = score(task, state, moved(0.0, 0.0, 0.07), np.zeros((1, 1)))
    assert not result.success[0]
    _, result = score(task, state, moved(0.0, 0.0, 0.09), np.zeros((1, 1)))
    assert result.success[0]
