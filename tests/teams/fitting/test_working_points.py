"""Of parts that are alike on several sides the side is worked at that a robot comes to first."""

from __future__ import annotations

import math

import numpy as np
import pytest

from aidsr.tasks import goal_task, parse_goal
from aidsr.teams.fitting.views import place_of_work

ROOM = """<mujoco><worldbody>
<site name="mount" pos="{mount}"/>{post}
<body name="wheel" pos="0.3 0 0.3"><joint name="axle" axis="1 0 0" damping="0.01"/>{parts}</body>
</worldbody></mujoco>"""
LONG = 0.06
FOUR_ARMS = "".join(
    f'<geom type="capsule" fromto="-0.02 0 0 -0.02 {LONG * y} {LONG * z}" size="0.006" mass="0.01"/>'
    for y, z in ((0, 1), (1, 0), (0, -1), (-1, 0))
)
RING = "".join(
    f'<geom type="capsule" fromto="0 {LONG * math.cos(a):.5f} {LONG * math.sin(a):.5f} '
    f'0 {LONG * math.cos(a + math.pi / 4):.5f} {LONG * math.sin(a + math.pi / 4):.5f}" size="0.005" mass="0.01"/>'
    for a in np.arange(8) * math.pi / 4
)
DISC = f'<geom type="cylinder" size="{LONG} 0.005" euler="0 90 0" mass="0.05"/>'
BALL = f'<geom type="sphere" size="{LONG}" mass="0.05"/>'
PLATE = f'<geom type="box" size="0.004 {LONG} {LONG}" mass="0.05"/>'
TURN = 'kind = "turn"\njoint = "axle"\nby_deg = 60\n'


def place(parts: str, mount: str, *, goal: str = TURN, post: str = "") -> tuple[float, float, float]:
    mjcf = ROOM.format(mount=mount, parts=parts, post=post)
    task = goal_task(parse_goal(goal), mjcf)
    found = place_of_work(task.brief(), task.goal)
    assert found is not None
    return found


@pytest.mark.parametrize("parts", [FOUR_ARMS, RING, DISC, BALL, PLATE], ids=["arms", "ring", "disc", "ball", "plate"])
@pytest.mark.parametrize("side", [(1, 0), (-1, 0), (0, 1), (0, -1)])
def test_what_is_alike_all_round_is_turned_on_the_side_of_the_mount(parts: str, side: tuple[int, int]) -> None:
    y, z = side
    _, *found = place(parts, f"0.1 {0.3 * y} {0.3 + 0.25 * z}")
    away = np.array(found) - (0, 0.3)
    assert away @ side == pytest.approx(0.8 * LONG, rel=0.15), "towards the mount, a little inside of its end"
    assert abs(away @ (z, -y)) < 0.01


def test_an_arm_behind_a_post_is_left_for_one_in_sight() -> None:
    post = '<geom name="post" type="box" size="0.01 0.05 0.001" pos="0.2 0.16 0.3"/>'
    mount = "0.1 0.3 0.3"
    assert place(FOUR_ARMS, mount)[1] == pytest.approx(0.8 * LONG)
    y, z = place(FOUR_ARMS, mount, post=post)[1:]
    assert y == pytest.approx(0.0, abs=1e-6)
    assert abs(z - 0.3) == pytest.approx(0.8 * LONG)


def test_an_arm_is_measured_from_the_axis_and_not_along_it() -> None:
    stem = '<geom type="capsule" fromto="0 0 0 -0.12 0 0" size="0.008" mass="0.05"/>'
    lever = '<geom type="capsule" fromto="-0.05 0 0 -0.05 0.05 0" size="0.006" mass="0.02"/>'
    assert place(stem + lever, "0 0 0.3") == pytest.approx((0.25, 0.04, 0.3)), "on the lever, not at the stem's end"


@pytest.mark.parametrize("side", [1, -1])
def test_of_two_pads_the_nearer_is_pressed_unless_it_is_hidden(side: int) -> None:
    touch = 'kind = "touch"\ntarget = "wheel"\n'
    pads = '<geom size="0.01" pos="0 0.1 0" mass="0.01"/><geom size="0.01" pos="0 -0.1 0" mass="0.01"/>'
    mount = f"0 {0.02 * side} 0.3"
    post = f'<geom name="post" type="box" size="0.01 0.03 0.1" pos="0.2 {0.073 * side} 0.3"/>'
    assert place(pads, mount, goal=touch)[1] == pytest.approx(0.1 * side)
    assert place(pads, mount, goal=touch, post=post)[1] == pytest.approx(-0.1 * side)
    assert place(RING, f"0.3 {0.3 * side} 0.3", goal=touch)[1] * side > 0.8 * LONG
