"""What stands beside a robot in its document is not blamed on it, nor is toppling on how it was put down."""

from __future__ import annotations

import pytest
import robots
from faulty import arm

from aidsr.validation import validate

BALL = '<body name="ball" pos="0.3 0 0.05"><freejoint/><geom size="0.03" mass="0.1"/></body>'
PLANAR = (
    '<body name="puck" pos="0.3 0 0.05"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>'
    '<geom size="0.03" mass="0.1"/></body>'
)
FLOOR = '<geom name="floor" type="plane" size="1 1 0.1" pos="0 0 -0.0206"/>'
TABLE = '<body name="table" pos="0.3 0 0.05"><geom type="box" size="0.05 0.05 0.02"/></body>'


def beside(text: str, *others: str) -> str:
    return text.replace("<worldbody>", f"<worldbody>{''.join(others)}", 1)


@pytest.mark.parametrize("thing", [BALL, PLANAR])
def test_an_object_to_play_with_is_no_part_of_the_robot(thing: str) -> None:
    alone, with_it = validate(beside(arm(), FLOOR)), validate(beside(arm(), FLOOR, thing))
    assert with_it.faults == alone.faults == ()
    for measured in ("characteristic_length_m", "degrees_of_freedom"):
        assert with_it.measurements[measured] == alone.measurements[measured]


def test_a_fixed_body_without_joints_is_a_warning() -> None:
    report = validate(beside(arm(), TABLE))
    assert [(fault.code, fault.severity, fault.names) for fault in report.faults] == [
        ("disconnected", "warning", ("table",))
    ]


def test_a_second_robot_is_an_error() -> None:
    second = robots.limb_bodies(robots.Limb(segments=3), "other_", 'pos="0.4 0 0.2"')
    assert "disconnected" in {fault.code for fault in validate(beside(arm(), second)).errors}


def test_memory_for_contacts_is_left_to_mujoco() -> None:
    text = arm().replace("<worldbody>", '<size njmax="8000" nconmax="4000"/><worldbody>', 1)
    report = validate(text)
    assert report.stable
    assert "Ignored njmax and nconmax of <size>: MuJoCo reserves memory as it is needed." in report.notes


def on_a_mast(height_m: float) -> str:
    """An arm with its root on top of a mast that stands, a little tilted, at a height over the floor."""
    mast = '<geom name="mast" type="capsule" fromto="0 0 -0.03 0 0 -0.4" size="0.006" mass="0.05"/>'
    base = f'<body name="base" pos="0 0 {0.406 + height_m}" euler="0 4 0"><freejoint/>{mast}'
    floor = '<geom name="floor" type="plane" size="1 1 0.1"/>'
    return beside(arm().replace('<body name="base">', base, 1), floor)


def test_a_robot_that_stands_and_topples_was_not_dropped() -> None:
    codes = [{fault.code for fault in validate(on_a_mast(height_m)).errors} for height_m in (0.0, 0.2)]
    assert "base_not_attached" not in codes[0]
    assert "base_not_attached" in codes[1]
