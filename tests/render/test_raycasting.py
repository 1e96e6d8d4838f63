import mujoco
import numpy as np
import pytest

from aidsr.render import raycasting
from aidsr.render.raycasting import RayCanvas

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
    return RayCanvas(model, 120, 80).draw(data, camera).astype(int)


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


def test_what_collides_with_nothing_is_seen_beyond_what_does() -> None:
    """The bounds of a body that MuJoCo keeps hold only geoms that collide."""
    post = '<geom type="capsule" size="0.02" fromto="0 0 0 0.4 0 0" rgba="0 1 0 1" contype="0" conaffinity="0"/>'
    picture = picture_of(f'<mujoco><worldbody><body><geom size="0.02"/>{post}</body></worldbody></mujoco>')
    green = (picture[..., 1] > 60) & (picture[..., 0] < 20)
    assert np.ptp(np.nonzero(green)[1]) > 30


@pytest.mark.parametrize("elevation", [-90, -50, -20, 10])
def test_rays_meet_what_they_meet_one_by_one(elevation: float) -> None:
    """Cast together, MuJoCo's rays lose the end of the post and the corner of the table, whose bodies are turned."""
    top = '<geom size="0.2 0.2 0.015" pos="0 0 -0.015" type="box"/>'
    leg = '<geom size="0.03 0.185" pos="0 0 -0.215" type="cylinder" mass="9"/>'
    mount = '<geom size="0.02 0.006" pos="0 0 -0.006" type="cylinder" mass="0.05"/>'
    post = '<geom size="0.007 0.108" pos="-0.019 -0.077 0.112" quat="0 1 0 0" type="capsule" mass="0.05"/>'
    table, robot = f"<body>{top}{leg}</body>", f'<body pos="0 0 0.35" quat="0 1 0 0">{mount}{post}</body>'
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{table}{robot}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.azimuth, camera.elevation, camera.distance = (0, 0, 0.1), 70, elevation, 0.6
    canvas, groups = raycasting.RayCanvas(model, 80, 60), np.ones(6, np.uint8)
    canvas.draw(data, camera)
    eye, number = raycasting._Eye(canvas._scene, 80 / 60), np.zeros(1, np.int32)
    across, down = np.meshgrid((np.arange(80) + 0.5) / 80, (np.arange(60) + 0.5) / 60)
    rays = eye.rays(across.ravel(), down.ravel())
    one_by_one = []
    for ray in rays:
        mujoco.mj_ray(model, data, eye.position, ray, groups, True, -1, number)
        one_by_one.append(int(number[0]))
    together, _, _ = raycasting._Layer(canvas._model, data, np.zeros((model.ngeom, 3))).cast(eye.position, rays)
    assert (np.array(one_by_one) >= 0).sum() > 100
    assert together.tolist() == one_by_one


@pytest.mark.parametrize("uniform", ["texuniform='true' texrepeat='5 5'", "texrepeat='4 4'"])
def test_the_squares_of_a_floor_are_seen(uniform: str) -> None:
    picture = picture_of(
        f"""<mujoco><asset><texture name="t" type="2d" builtin="checker" rgb1="0 0 1" rgb2="1 1 0"
        width="8" height="8"/><material name="floor" texture="t" {uniform}/></asset>
        <worldbody><geom type="plane" size="0.4 0.4 0.1" material="floor"/></worldbody></mujoco>"""
    )
    blue, yellow = picture[..., 2] - picture[..., 0] > 90, picture[..., 0] - picture[..., 2] > 90
    middle = blue[35:45, 40:80] + 2 * yellow[35:45, 40:80]
    assert 0.3 < (middle == 1).mean() < 0.7
    assert 0.3 < (middle == 2).mean() < 0.7
    assert 1 <= (np.abs(np.diff(middle.astype(int), axis=1)) > 0).sum(axis=1).max() < 12


def test_outlines_are_smooth(picture: np.ndarray) -> None:
    """A pixel that a ball half covers has a colour between the ball's and the sky's."""
    rows = picture[20:60, 40:80]
    between = (rows[..., 1] > 60) & (rows[..., 1] < 160)
    assert between.sum() > 20
