"""Kept parts are compared as MuJoCo sees them, not as they are written."""

from __future__ import annotations

import pytest

from aidsr.core.artifacts import Keep
from aidsr.core.errors import MjcfError
from aidsr.mjcf.kept_parts import changes_to_kept_parts, part_names

ROBOT = """<mujoco>
  <default><default class="soft"><joint stiffness="0.2" damping="0.01"/></default></default>
  <worldbody>
    <body name="palm">
      <body name="finger" childclass="soft"><joint name="bend" range="0 1"/><geom name="skin" size="0.01"/></body>
    </body>
  </worldbody>
</mujoco>"""
FINGER = (Keep(name="finger"),)


def test_the_same_written_differently_is_the_same() -> None:
    written_out = ROBOT.replace(
        '<joint name="bend" range="0 1"/>', '<joint name="bend" stiffness=".20" range="0  1.0"/>'
    )
    assert changes_to_kept_parts(ROBOT, written_out, FINGER) == []


def test_a_second_section_of_defaults_takes_nothing_from_the_first() -> None:
    first = ROBOT.replace("<mujoco>", '<mujoco><default><geom rgba="1 0 0 1"/></default>')
    second = first.replace("<worldbody>", "<default><site/></default><worldbody>")
    assert changes_to_kept_parts(first, second, FINGER) == []
    (change,) = changes_to_kept_parts(first, second.replace('rgba="1 0 0 1"', 'rgba="0 1 0 1"'), FINGER)
    assert "rgba was 1 0 0 1 and is 0 1 0 1" in change


def test_what_a_class_says_of_all_tendons_is_a_tendons_own() -> None:
    cable = ROBOT.replace(
        "</mujoco>", '<tendon><fixed name="cable"><joint joint="bend" coef="1"/></fixed></tendon></mujoco>'
    )
    wider = cable.replace("<mujoco>", '<mujoco><default><tendon damping="3"/></default>')
    (change,) = changes_to_kept_parts(cable, wider, (Keep(name="cable"),))
    assert "damping was not set and is 3" in change


def test_what_stands_around_may_change() -> None:
    assert changes_to_kept_parts(ROBOT, ROBOT.replace('name="palm"', 'name="hand"'), FINGER) == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('stiffness="0.2"', 'stiffness="0.3"', "'bend' changed: stiffness was 0.2 and is 0.3"),
        ('size="0.01"', 'size="0.02"', "'skin' changed: size was 0.01 and is 0.02"),
        (' range="0 1"', "", "range was 0 1 and is not set"),
        ('name="finger"', 'name="thumb"', '"finger" is to be kept and is gone'),
        ('<geom name="skin" size="0.01"/>', "", "<geom> 'skin' became nothing"),
        ('<geom name="skin"', '<site name="mark"/><geom name="skin"', "<geom> 'skin' became <site> 'mark'"),
    ],
)
def test_what_changed_is_said(old: str, new: str, said: str) -> None:
    (change,) = changes_to_kept_parts(ROBOT, ROBOT.replace(old, new), FINGER)
    assert said in change


def test_attributes_that_may_change_are_left_out() -> None:
    softer = ROBOT.replace('stiffness="0.2"', 'stiffness="0.1"').replace('damping="0.01"', 'damping="0.02"')
    (change,) = changes_to_kept_parts(ROBOT, softer, (Keep(name="finger", but=("stiffness",)),))
    assert "damping" in change


def test_a_part_that_never_was_is_said_and_a_document_that_is_none_is_refused() -> None:
    assert changes_to_kept_parts(ROBOT, ROBOT, (Keep(name="thumb"),)) == ['There was no part named "thumb" to keep.']
    with pytest.raises(MjcfError):
        changes_to_kept_parts(ROBOT, "<mujoco>", FINGER)


def test_every_named_element_but_the_root_is_a_part() -> None:
    named = ROBOT.replace("<mujoco>", '<mujoco name="robot">')
    assert part_names(named) == ["palm", "finger", "bend", "skin"]
