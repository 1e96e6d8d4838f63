"""Motions that look like progress and lead nowhere are worth little."""

import numpy as np
import pytest
from stick import Episode

from aidsr.tasks import load_task
from aidsr.tasks.locomotion.tunnel import along_tunnel_m


def test_a_body_that_turns_sideways_before_the_tunnel_comes_no_nearer():
    straight, beside = np.array([[[-0.3, 0.0]]]), np.array([[[-0.02, 0.3]]])
    unbent = np.zeros((1, 1))
    assert along_tunnel_m(straight, unbent) == pytest.approx(-0.3)
    assert along_tunnel_m(beside, unbent) < -0.3
    assert along_tunnel_m(np.array([[[0.5, 0.0]]]), unbent) == pytest.approx(0.5)


def test_standing_tall_is_no_way_up_the_stairs():
    episode = Episode(load_task("stairs"))
    start = episode.sensor("lane_position")
    for height_m in (0.1, 0.3):
        episode.place(start + np.array([0.0, 0.0, height_m]), (0.0, 0.0, 1.0))
        tall = episode.step()
    assert 0.0 < tall.progress[0] <= 0.1
