"""Designers are told what the code judges by, in sentences formatted from the numbers it judges with."""

import re
from dataclasses import replace

import pytest

from aidsr.core.errors import UserError
from aidsr.tasks import TASKS, Task, load_task, task_names
from aidsr.tasks.locomotion.flat_ground import FlatGround
from aidsr.tasks.reaching.button_pushing import ButtonPushing


@pytest.mark.parametrize("name", task_names())
def test_every_task_says_how_it_is_judged(name):
    task = load_task(name)
    told = task.brief().judging
    assert {"Episodes differ", "Success", "Penalty", "Stages", "Time"} <= told.keys()
    assert all(words in told["Stages"] for _, words in task.stages)
    assert f"Held for {task.hold_s:g} s." in told["Success"]
    can_be_lost = ("grasping/", "locomotion/", "manipulation/drawer", "manipulation/crank")
    assert ("Lost at once" in told) == name.startswith(can_be_lost)
    assert ("Who moves the mount" in told) == (task.base == "moving")
    for sentence in told.values():
        assert re.match(r"[A-Z0-9]", sentence), sentence
        assert sentence.isascii()


def test_a_mount_is_moved_by_the_policy_or_by_a_timetable():
    assert (
        "the policy drives base_x, base_z" in load_task("drawer_opening").brief().judging["Who moves the mount"].lower()
    )
    assert load_task("simple_grasping").brief().judging["Who moves the mount"] == "A timetable does."


def test_a_task_without_criteria_cannot_be_made():
    class Silent(Task):
        objective = "Do it."

    with pytest.raises(TypeError, match="criteria"):
        Silent.at("standard")


class Quits(ButtonPushing):
    name = "test/quits"

    def is_failure(self, readings, state):
        return readings.scalar("button_travel") > 1.0


class Rules(ButtonPushing):
    name = "test/rules"

    def losses(self, readings, state):
        return {**super().losses(readings, state), "Pushed too far.": readings.scalar("button_travel") > 1.0}


@pytest.mark.parametrize(("task", "method"), [(Quits, "is_failure"), (Rules, "losses")])
def test_a_task_that_ends_episodes_as_lost_must_say_when(task, method):
    says = rf'"{task.name}" defines {method} without a sentence: set Criteria\.failure'
    with pytest.raises(UserError, match=says):
        task.at("standard").judging()


def test_only_tasks_that_can_be_lost_say_when():
    for name in TASKS:
        task = load_task(name)
        assert bool(task.criteria.failure) == type(task).can_be_lost()


def test_criteria_are_what_a_subclass_makes_of_them():
    class Slow(FlatGround):
        time_limit_s = 80.0

        @property
        def criteria(self):
            return replace(super().criteria, success="All of it.")

    told = Slow.at("standard").judging()
    assert (told["Success"], told["Time"]) == ("All of it. Held for 0.5 s.", "80 s, 25 actions a second.")
    assert "within 80 s" in Slow.at("standard").objective
    assert told["Episodes differ"] == FlatGround.at("standard").judging()["Episodes differ"]


# --- the words hold at both levels ---

QUANTITY = re.compile(r"(\d+(?:\.\d+)?)(?: to (\d+(?:\.\d+)?))? (mm|m/s|m|N m|N|g|degrees|deg|%|times|x)(?!\w)")
OF_BOTH_LEVELS = {
    ("height_m", "A part of the robot starts in the tunnel. The centre of mass is 0.1 m outside the lane."),
    (
        "widest_m",
        "A part of the robot starts beyond the near edge. It touches the bottom. The centre of mass is 0.1 m outside "
        "the lane. The centre of mass is 0.05 m behind the farthest it has been.",
    ),
}
"""Numbers that a level happens to share with a rule of both."""
COUNTS = {"goal_lengths": "times", "cells_a_side": "x"}


def quantities(text: str) -> set[tuple[float, str]]:
    """The numbers of a text with their units; both ends of a range."""
    return {(float(number), unit) for low, high, unit in QUANTITY.findall(text) for number in (low, high) if number}


def as_said(field: str, value: float) -> set[tuple[float, str]]:
    """The ways in which a text may say the value of a task's field."""
    if field in COUNTS:
        return {(value, COUNTS[field])}
    if field.endswith("_m_s"):
        return {(value, "m/s")}
    if field.endswith("_kg"):
        return {(round(1000 * value, 6), "g")}
    if field.endswith("_deg"):
        return {(value, "deg"), (value, "degrees")}
    if field.endswith("_nm"):
        return {(value, "N m")}
    if field.endswith("_m"):
        return {(value, "m"), (round(1000 * value, 6), "mm")}
    return {(value, "N")} if field.endswith("_n") else {(round(100 * value, 6), "%")}


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.parametrize("level", ["standard", "hard"])
def test_an_objective_has_the_numbers_of_its_level(name, level):
    task = load_task(name, level)
    for field in task.hard:
        value = getattr(task, field)
        assert not value or as_said(field, value) & quantities(task.objective), field


@pytest.mark.parametrize("name", TASKS)
def test_no_number_of_the_standard_level_is_told_at_the_hard_one(name):
    standard, hard = load_task(name), load_task(name, "hard")
    for field in hard.hard:
        for sentence in hard.judging().values():
            found = as_said(field, getattr(standard, field)) & quantities(sentence)
            assert not found or (field, sentence) in OF_BOTH_LEVELS, (field, sentence)


@pytest.mark.parametrize(
    ("name", "low", "high", "word"),
    [("gap", "narrowest_m", "widest_m", "Width"), ("dynamic_catching", "slowest_m_s", "fastest_m_s", "Speed")],
)
def test_what_differs_at_the_standard_level_only_is_told_there_only(name, low, high, word):
    for level in ("standard", "hard"):
        task = load_task(name, level)
        assert (word in task.judging()["Episodes differ"]) == (getattr(task, low) < getattr(task, high))


@pytest.mark.parametrize("level", ["standard", "hard"])
def test_the_gaps_that_are_told_are_those_that_are_drawn(level):
    task = load_task("gap", level)
    drawn_mm = [1000 * task.variation("development", i).parameters["width_m"][0] for i in range(100)]
    told = f"{task.objective} {task.judging()['Episodes differ']}"
    (ends,) = set(re.findall(r"(?:gap|Width) (\d+(?: to \d+)?) mm", told))
    low, high = ends.split(" to ")[0], ends.split(" to ")[-1]
    assert (min(drawn_mm), max(drawn_mm)) == pytest.approx((float(low), float(high)), abs=2.0)


def test_a_level_of_another_speed_says_its_own():
    fast = replace(load_task("dynamic_catching", "hard"), slowest_m_s=3.0, fastest_m_s=3.0)
    assert "arrives at 3 m/s" in fast.objective
