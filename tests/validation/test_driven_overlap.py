"""Parts that get deep into each other when driven: for how long, in what, and what does not count."""

from __future__ import annotations

import faulty
import pytest
import robots

from aidsr.core.artifacts import Fault
from aidsr.validation import validate
from aidsr.validation.rules.crossing import DRIVEN_OVERLAP as RULE
from aidsr.validation.rules_page import EXAMPLE_ARM

POST = '<geom name="post" type="box" size="0.001 0.01 0.05" pos="0.05 0 0.06"/>'
SOFT = 'solref="0.06 1"'
BESIDE = '<body name="base">'


def found(text: str) -> list[Fault]:
    return [fault for fault in validate(text, select=[RULE.code]).faults if fault.code == RULE.code]


def bad() -> str:
    assert RULE.example is not None
    return RULE.example.fails(EXAMPLE_ARM)


def test_parts_that_stay_in_each_other_are_an_error_with_the_command_that_drives_them() -> None:
    (fault,) = found(bad())
    assert fault.severity == "error"
    assert set(fault.names) < {"post", "g5", "g6"}
    assert "mm or more deep in each other for 5 % of the test of pull_" in fault.message
    assert fault.message.endswith("at ctrl 20")
    assert fault.whole == pytest.approx(0.001)  # half the thickness of the post
    assert fault.limit == 3
    assert "farther apart" in fault.cure


def test_parts_that_swing_into_each_other_and_come_apart_are_a_warning() -> None:
    (fault,) = found(faulty.swapped(SOFT, 'solref="0.02 1"', bad()))
    assert (fault.severity, fault.limit) == ("warning", 1)
    assert "for 2 % of the" in fault.message


def test_what_stands_around_counts_too_and_cannot_be_moved_apart() -> None:
    (fault,) = found(EXAMPLE_ARM.replace("<geom type=", f"<geom {SOFT} type=").replace(BESIDE, f"{POST}{BESIDE}"))
    assert fault.names[1] == "post"
    assert fault.cure.startswith("Pull with less force")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (SOFT, 'solref="0.004 1"'),
        ('size="0.001 ', 'size="0.006 '),
        ('ctrlrange="0 20"', 'ctrlrange="0 10"'),
        ('range="-45 45"', 'range="-5 5"'),
        ('pos="0.05 0 0.06"', 'pos="0.15 0 0.06"'),
    ],
    ids=["stiffer contact", "thicker", "less force", "joint ranges", "farther apart"],
)
def test_each_cure_takes_the_error_away(old: str, new: str) -> None:
    assert "error" not in [fault.severity for fault in found(faulty.swapped(old, new, bad()))]


def test_parts_that_may_pass_do_not_count() -> None:
    assert found(bad().replace('name="post"', 'name="post" contype="0" conaffinity="0"')) == []


def test_parts_that_pass_through_each_other_by_contype_and_conaffinity_are_an_error() -> None:
    """The post stands on the base, farther from the end of the arm than neighbours."""
    passing = bad().replace("<geom ", '<geom contype="1" conaffinity="0" ')
    (fault,) = found(passing)
    assert fault.severity == "error"
    assert "post" in fault.names
    assert "contype and conaffinity" in fault.likely_cause
    excluded = "".join(f'<exclude body1="base" body2="s{number}"/>' for number in range(1, 7))
    assert found(passing.replace("</worldbody>", f"</worldbody><contact>{excluded}</contact>")) == []


def test_a_plane_has_no_thickness() -> None:
    floor = "<worldbody><geom type='plane' size='0 0 1' pos='0 0 -0.012'/>"
    assert found(faulty.swapped("<worldbody>", floor, robots.crawler())) == []


def test_what_is_drawn_so_explains_it() -> None:
    """The post stands in the segments that it is to be away from."""
    inside = bad().replace('pos="0.05 0 0.06"', 'pos="0.011 0 0.06"')
    assert [fault.severity for fault in found(inside)] == ["error"]
    codes = [fault.code for fault in validate(inside).errors]
    assert "initial_penetration" in codes
    assert RULE.code not in codes
