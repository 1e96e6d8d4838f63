"""Designers are told what the code judges by, from the docstrings of the code that judges."""

import re

import pytest

from aidsr.errors import UserError
from aidsr.tasks import load_task, task_names
from aidsr.tasks.judging import judging
from aidsr.tasks.locomotion.flat_ground import FlatGround


@pytest.mark.parametrize("name", task_names())
def test_every_task_says_how_it_is_judged(name):
    task = load_task(name)
    told = task.brief().judging
    assert {"Episodes differ", "Success", "Counts against it", "Time"} <= told.keys()
    assert f"Held for {task.hold_s:g} s." in told["Success"]
    assert ("Lost at once" in told) == name.startswith(("grasping/", "locomotion/"))
    assert ("Who moves the mount" in told) == (task.base == "moving")
    for sentence in told.values():
        assert re.match(r"[A-Z0-9]", sentence), sentence
        assert sentence.isascii()
        assert "See `Task`" not in sentence


def test_a_mount_is_moved_by_the_policy_or_by_a_timetable():
    assert (
        "the policy drives base_x, base_z" in load_task("drawer_opening").brief().judging["Who moves the mount"].lower()
    )
    assert load_task("simple_grasping").brief().judging["Who moves the mount"] == "A timetable does."


class Draws(FlatGround):
    name = "test/draws"

    def draw(self, rng):
        return super().draw(rng)


class Succeeds(FlatGround):
    name = "test/succeeds"

    def succeeded(self, readings, memory):
        """ """
        return super().succeeded(readings, memory)


class Violates(FlatGround):
    name = "test/violates"

    def violation(self, readings):
        return super().violation(readings)


class Fails(FlatGround):
    name = "test/fails"

    def failed(self, readings, memory):
        return super().failed(readings, memory)


@pytest.mark.parametrize(
    ("kind", "method"), [(Draws, "draw"), (Succeeds, "succeeded"), (Violates, "violation"), (Fails, "failed")]
)
def test_a_method_without_docstring_is_named_and_no_empty_sentence_told(kind, method):
    with pytest.raises(UserError, match=rf'"{kind.name}".* `{method}`.*found none.*Write a sentence') as error:
        judging(kind.at("standard"))
    assert "\n" not in str(error.value)


def test_a_method_that_is_inherited_says_what_its_own_docstring_says():
    class Same(FlatGround):
        name = "test/same"

    assert judging(Same.at("standard")) == judging(FlatGround.at("standard"))
