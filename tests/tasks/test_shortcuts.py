"""Motions that look like progress and lead nowhere are worth little."""

import numpy as np
import pytest
from stick import Episode

from aidsr.tasks import load_task
from aidsr.tasks.locomotion.obstacles import way_left_m
from aidsr.tasks.locomotion.tunnel import along_tunnel_m


def test_a_body_that_turns_sideways_before_the_tunnel_comes_no_nearer():
    straight, beside = np.array([[[-0.3, 0.0]]]), np.array([[[-0.02, 0.3]]])
    unbent = np.zeros((1, 1))
    assert along_tunnel_m(straight, unbent) == pytest.approx(-0.3)
    assert along_tunnel_m(beside, unbent) < -0.3
    assert along_tunnel_m(np.array([[[0.5, 0.0]]]), unbent) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("point_m", "left_m"),
    [
        ((0.0, 0.0), np.hypot(0.45, 0.12) + np.hypot(0.5, 0.24) + 0.15),
        ((0.4, -0.25), np.hypot(0.55, 0.37) + 0.15),
        ((0.44, 0.2), np.hypot(0.01, 0.32) + np.hypot(0.5, 0.24) + 0.15),
        ((0.5, -0.2), np.hypot(0.45, 0.32) + 0.15),
        ((0.9, -0.2), np.hypot(0.05, 0.32) + 0.15),
        ((0.9, 0.25), 0.2),
        ((1.3, 0.0), 0.0),
    ],
)
def test_the_way_left_leads_around_the_obstacles(point_m, left_m):
    turns_m = np.array([[(0.45, -0.12), (0.95, 0.12)]])
    mirrored = np.array([1.0, -1.0])
    assert way_left_m(np.array([point_m]), turns_m) == pytest.approx(left_m)
    assert way_left_m(np.array([point_m]) * mirrored, turns_m * mirrored) == pytest.approx(left_m)


def test_standing_tall_is_no_way_up_the_stairs():
    episode = Episode(load_task("stairs"))
    start = episode.sensor("lane_position")
    for height_m in (0.1, 0.3):
        episode.place(start + np.array([0.0, 0.0, height_m]), (0.0, 0.0, 1.0))
        tall = episode.step()
    assert 0.0 < tall.progress[0] <= 0.1
