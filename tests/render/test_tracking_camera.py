"""The camera goes along with a free robot that travels, and with no other."""

from __future__ import annotations

import io

import av
import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from aidsr.mjcf.compile import compile_mjcf
from aidsr.render import pictures as rendering
from aidsr.render.tracking_camera import Travel, track_robot
from aidsr.render.view import View

SCENE = """<mujoco><worldbody>
  <geom type="plane" size="0 0 1"/>
  <body name="{name}" pos="0 0 0.05"><freejoint/><geom type="box" size="0.1 0.05 0.05" rgba="1 0 0 1"/></body>
  <body name="robot/fixed" pos="0 5 0"><geom size="0.01"/></body>
</worldbody></mujoco>"""
CRAWLER, BALL = SCENE.format(name="robot/crawler"), SCENE.format(name="ball").replace('pos="0 5 0"', 'pos="0 0.2 0"')
FRAMES = 60


def way(metres: float) -> NDArray[np.float64]:
    """Return the positions of a body that goes along x, (FRAMES, 7)."""
    positions = np.tile([0.0, 0.0, 0.05, 1.0, 0.0, 0.0, 0.0], (FRAMES, 1))
    positions[:, 0] = np.linspace(0, metres, FRAMES)
    return positions


def reddish(picture: NDArray[np.int64]) -> NDArray[np.bool_]:
    return (picture[..., 0] > 100) & (picture[..., 1] < 90) & (picture[..., 2] < 90)


def travel(mjcf: str, positions: NDArray[np.float64]) -> Travel | None:
    model = compile_mjcf(mjcf)
    return track_robot(model, mujoco.MjData(model), positions)


@pytest.fixture(scope="module")
def crawler() -> str:
    """A scene in which only the crawler is the robot."""
    return CRAWLER.replace('<body name="robot/fixed" pos="0 5 0"><geom size="0.01"/></body>', "")


def test_it_looks_ahead_of_a_robot_that_travels_and_knows_its_way(crawler: str) -> None:
    found = travel(crawler, way(2.0))
    assert found is not None
    np.testing.assert_allclose(found.distance_m, np.linspace(0, 2, FRAMES), atol=0.02)
    ahead = found.lookat_m[:, 0] - way(2.0)[:, 0]
    assert ahead.min() > 0.3 * found.radius_m
    assert ahead.max() < found.radius_m
    np.testing.assert_allclose(found.lookat_m[:, 1:], [[0, 0.05]] * FRAMES, atol=1e-9)


def test_it_does_not_follow_what_cannot_be_seen(crawler: str) -> None:
    assert travel(crawler.replace('type="box"', 'type="box" group="3"'), way(2.0)) is None


def test_its_camera_is_as_near_for_a_long_way_as_for_a_short_one(crawler: str) -> None:
    short, long = (found.camera(View()) for metres in (1.0, 9.0) if (found := travel(crawler, way(metres))))
    assert long.distance == pytest.approx(short.distance)
    assert long.distance < 2.0, "a robot 0.2 m long, seen from some lengths away"


@pytest.mark.parametrize("metres", [0.0, 0.1])
def test_it_stands_still_where_the_robot_hardly_moves(crawler: str, metres: float) -> None:
    assert travel(crawler, way(metres)) is None


def test_it_does_not_run_after_what_is_not_the_robot() -> None:
    assert travel(BALL, way(2.0)) is None


def test_it_needs_more_than_one_moment(crawler: str) -> None:
    assert travel(crawler, way(2.0)[:1]) is None


def test_a_film_keeps_the_robot_in_sight_and_says_how_far_it_is(crawler: str) -> None:
    if "no videos" in rendering.gl_status():
        pytest.skip(rendering.gl_status())
    film = rendering.video(crawler, qpos=way(6.0)[::10], width=160, height=120)
    assert film is not None
    with av.open(io.BytesIO(film)) as container:
        frames = [picture.to_ndarray(format="rgb24").astype(int) for picture in container.decode(video=0)]
    for picture in frames:
        columns = np.nonzero(reddish(picture))[1]
        assert reddish(picture).mean() > 0.02
        assert 0 < columns.min() < columns.max() < 159
        assert (picture[95:118, 5:60].min(axis=2) > 225).sum() > 20, "white figures in the lower left corner"


def test_a_strip_shows_the_same_without_opengl(crawler: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AIDSR_INSIDE_WORKER", "yes")  # draw here, where the choice below is seen
    monkeypatch.setenv("AIDSR_GL", "disable")
    strip = rendering.filmstrip(crawler, qpos=way(6.0), frames_per_s=10, count=2, width=80, height=60)
    picture = np.asarray(Image.open(io.BytesIO(strip)).convert("RGB")).astype(int)
    for moment in (picture[:, :80], picture[:, 80:]):
        assert reddish(moment).mean() > 0.02
