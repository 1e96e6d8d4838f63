"""What is measured of a played script, against motions whose figures are known."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.tools.carts import cart

from aidsr.core.errors import UserError
from aidsr.tools.playing import play


def test_a_cart_of_constant_speed_has_its_path_velocity_and_distances(tmp_path: Path) -> None:
    found = play(cart(tmp_path, 9.0), "drive: 0.4", seconds=1.0, distances=[("nose", "mark"), ("robot/cart", "wall")])
    assert found.duration_s == pytest.approx(1.0)
    assert found.mean_velocity_m_s == pytest.approx((0.2, 0.0, 0.0), abs=0.002), "0.4 of 0.5 m/s"
    assert found.path_m == pytest.approx(0.2, abs=0.002)
    assert found.heading_deg == pytest.approx(0.0, abs=1e-6)
    marked, wall = found.distances
    assert (marked.start_m, marked.end_m, marked.least_s) == pytest.approx((0.3, 0.1, 1.0), abs=0.002)
    assert (wall.start_m, wall.end_m) == pytest.approx((0.45, 0.25), abs=0.002), "between surfaces"
    assert found.ended == "all that was to be played was played"
    assert found.touches == ()
    assert "mean velocity 199" in found.text()


def test_a_turntable_counts_whole_turns_to_the_left(tmp_path: Path) -> None:
    found = play(cart(tmp_path, 9.0), "turn: 1")
    assert found.duration_s == pytest.approx(4.0)
    assert found.heading_deg == pytest.approx(360.0, abs=2.0), "a quarter of a turn each second"
    assert found.ended == "the task's time is over"
    assert play(cart(tmp_path, 9.0), "turn: -1", seconds=1.0).heading_deg == pytest.approx(-90.0, abs=1.0)


def test_the_first_wall_is_named_with_time_force_and_body(tmp_path: Path) -> None:
    found = play(cart(tmp_path, 9.0), "drive: t=0 1")
    (touch,) = found.touches
    assert (touch.geom, touch.bodies, touch.at_start) == ("wall", ("cart",), False)
    assert touch.first_s == pytest.approx(0.45 / 0.5, abs=0.05)
    assert touch.mean_n == pytest.approx(500.0, rel=0.05), "stalled: kv times the speed that is asked for"
    assert "touches wall first at 0.9" in found.text()


def test_a_winch_with_a_time_constant_presses_as_hard_as_it_pulls(tmp_path: Path) -> None:
    scene = cart(tmp_path, 9.0)
    drive = '<velocity name="robot/drive" joint="robot/along" kv="1000" ctrlrange="-0.5 0.5"/>'
    winch = (
        '<general name="robot/drive" joint="robot/along" dyntype="filterexact" dynprm="0.05" gainprm="20" '
        'biastype="affine" biasprm="0 0 -20" ctrlrange="-0.5 0.5"/>'
    )
    assert drive in scene.mjcf
    (touch,) = play(scene.model_copy(update={"mjcf": scene.mjcf.replace(drive, winch)}), "drive: t=0 1").touches
    assert touch.peak_n >= touch.mean_n
    assert touch.mean_n == pytest.approx(10.0, rel=0.05), "stalled: 20 N s/m times 0.5 m/s"
    assert touch.share > 0.5


def test_success_ends_it_and_is_said(tmp_path: Path) -> None:
    found = play(cart(tmp_path, 0.2), "drive: t=0 1, t=0.4 1, t=0.41 0")
    assert found.succeeded
    assert found.ended == "success, held"
    assert found.moments[-1].progress == pytest.approx(1.0)


def test_what_the_task_observes_is_told_with_its_change(tmp_path: Path) -> None:
    found = play(cart(tmp_path, 9.0), "drive: 0.4", seconds=1.0)
    changed = {name for name, _, start, end in found.features if start != end}
    (line,) = (line for line in found.text().splitlines() if line.startswith("the task observes"))
    assert changed
    assert line.count("->") == 1 + len([name for name in changed if f"{name} " in line])


def test_the_text_is_short_and_the_file_has_every_control_step(tmp_path: Path) -> None:
    found = play(cart(tmp_path, 9.0), "drive: 0.2", distances=[("nose", "mark")])
    assert len(found.text().splitlines()) <= 40
    assert len(found.csv().splitlines()) == 1 + len(found.moments) == 102


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        (("nose", "wall"), "one is a site, the other has a surface"),
        (("nos", "mark"), 'no site, geom or body "nos"; did you mean nose'),
    ],
)
def test_distances_that_cannot_be_measured_are_refused(tmp_path: Path, pair: tuple[str, str], message: str) -> None:
    with pytest.raises(UserError, match=message):
        play(cart(tmp_path), "drive: 0", distances=[pair])
