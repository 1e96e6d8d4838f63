import mujoco
import numpy as np
import pytest

from aidsr.render.raycasting import draw

BALL_AND_TENDON = """
<mujoco>
  <worldbody>
    <geom type="sphere" size="0.1" rgba="1 0 0 1"/>
    <site name="left" pos="-0.3 0 0.2" rgba="0 0 0 0"/>
    <site name="right" pos="0.3 0 0.2" rgba="0 0 0 0"/>
    {floor}
  </worldbody>
  <tendon><spatial width="0.02" rgba="0 0 1 1"><site site="left"/><site site="right"/></spatial></tendon>
</mujoco>
"""


def picture_of(mjcf: str) -> np.ndarray:
    model = mujoco.MjModel.from_xml_string(mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = (0, 0, 0), 1.0, 90, -20
    return draw(model, data, camera, 120, 80).astype(int)


@pytest.fixture(scope="module")
def picture() -> np.ndarray:
    return picture_of(BALL_AND_TENDON.format(floor=""))


def test_shows_geoms_tendons_and_sky(picture: np.ndarray) -> None:
    red, green, blue = picture[40, 60]
    assert red > 2 * max(green, blue)
    rows = np.flatnonzero((picture[:, 75, 2] > 80) & (picture[:, 75, 0] < 20))
    assert 0 < len(rows) < 12, "the tendon is a thin blue line above the ball"
    assert picture[0, 0].min() > 180


def test_objects_throw_shadows() -> None:
    lit = picture_of(BALL_AND_TENDON.format(floor='<geom type="plane" size="2 2 0.1" pos="0 0 -0.3" rgba="1 1 1 1"/>'))
    floor = lit[45:, :, :].min(axis=2)
    assert np.percentile(floor, 5) < 0.75 * np.percentile(floor, 95)


def test_an_empty_model_is_all_sky() -> None:
    assert picture_of("<mujoco><worldbody/></mujoco>").min() > 180
