"""Rendering: pictures that show the robot, videos that move, and neither touching the working directory."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator
from pathlib import Path

import av
import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from aidsr.core.errors import MjcfError
from aidsr.mjcf.compile import compile_mjcf, parse_mjcf
from aidsr.render import draw
from aidsr.render import opengl as opengl_module
from aidsr.render import pictures as rendering
from aidsr.render import viewer as viewing
from aidsr.render.camera import frame_robot
from aidsr.render.stage import compile_for_display
from aidsr.render.view import View

RED = '<geom name="red" type="capsule" fromto="0 0 0 0 0 0.3" size="0.02" rgba="1 0 0 1"/>'
ROBOT = f"""<mujoco>
<worldbody>
<body name="robot/arm" pos="{{x}} 0 0.5"><joint name="robot/j" axis="0 1 0" damping="0.1" range="-90 90"/>{RED}</body>
{{environment}}
</worldbody>
<actuator><position name="robot/m" joint="robot/j" kp="1" ctrlrange="-1 1"/></actuator>
</mujoco>"""
FLOOR = '<geom type="plane" size="0 0 1"/>'


@pytest.fixture(scope="module")
def opengl() -> None:
    if "no videos" in rendering.gl_status():
        pytest.skip(rendering.gl_status())


def scene(environment: str = FLOOR, x: float = 0.0) -> str:
    return ROBOT.format(x=x, environment=environment)


def pixels(png: bytes) -> NDArray[np.int64]:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def reddish(picture: NDArray[np.int64]) -> NDArray[np.bool_]:
    return (picture[..., 0] > 100) & (picture[..., 1] < 90) & (picture[..., 2] < 90)


@pytest.mark.parametrize("x", [0.0, 7.0])
def test_the_robot_stands_whole_in_the_middle_wherever_it_is(x: float) -> None:
    seen = reddish(pixels(rendering.picture(scene(x=x), width=160, height=120)))
    rows, columns = np.nonzero(seen)
    assert seen.mean() > 0.02
    assert abs(columns.mean() - 80) < 16
    assert 0 < rows.min() < rows.max() < 119


def test_pictures_have_the_size_asked_for_and_are_the_same_each_time() -> None:
    first = rendering.picture(scene(), width=120, height=80)
    assert pixels(first).shape == (80, 120, 3)
    assert rendering.picture(scene(), width=120, height=80) == first


def test_without_opengl_pictures_are_drawn_by_ray_casting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AIDSR_INSIDE_WORKER", "yes")  # draw here, where the choice below is seen
    monkeypatch.setenv("AIDSR_GL", "disable")
    assert rendering.gl_status() == "no OpenGL (switched off by MUJOCO_GL): pictures by ray casting; no videos"
    assert reddish(pixels(rendering.picture(scene(), width=80, height=60))).mean() > 0.02
    assert pixels(rendering.filmstrip(scene(), seconds=0.2, count=2, width=40, height=40)).shape == (40, 80, 3)
    assert rendering.video(scene(), seconds=0.2) is None


def test_opengl_is_not_loaded_where_no_card_can_be(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AIDSR_INSIDE_WORKER", "anything")
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(opengl_module, "_CARDS", ())
    monkeypatch.setattr(draw, "renderer", lambda: pytest.fail("OpenGL was loaded"))
    assert reddish(pixels(rendering.picture(scene(), width=160, height=120))).any()


def test_a_card_is_asked_whether_it_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AIDSR_INSIDE_WORKER", "anything")
    monkeypatch.setattr(opengl_module, "_CARDS", (str(tmp_path),))
    asked: list[str] = []
    monkeypatch.setattr(draw, "renderer", lambda: asked.append("asked") or "llvmpipe")
    rendering.picture(scene(), width=160, height=120)
    assert asked == ["asked"]


def test_a_wall_between_camera_and_robot_makes_the_camera_go_elsewhere() -> None:
    open_view = camera_of(scene())
    front = -np.array([np.cos(np.deg2rad(open_view.azimuth)), np.sin(np.deg2rad(open_view.azimuth)), 0]) * 0.2
    wall = f'<geom type="box" size="0.02 0.4 0.6" pos="{front[0]} {front[1]} 0.6" euler="0 0 {open_view.azimuth}"/>'
    assert camera_of(scene(FLOOR + wall)).azimuth != open_view.azimuth


def test_what_stands_beside_a_robot_is_in_the_picture_but_not_before_it() -> None:
    """A block near enough to be wanted in the picture, on the side from which the camera would rather look."""
    block = '<geom name="block" type="box" size="0.02 0.15 0.2" pos="{} {} 0.65" euler="0 0 {}"/>'
    azimuth = np.deg2rad(camera_of(scene()).azimuth)
    at = -0.1 * np.array([np.cos(azimuth), np.sin(azimuth)])
    picture = rendering.picture(scene(FLOOR + block.format(*at, np.rad2deg(azimuth))), width=160, height=120)
    assert reddish(pixels(picture)).mean() > 0.01


def test_a_place_can_be_seen_from_where_its_author_looks() -> None:
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><visual><global azimuth="70" elevation="-28"/></visual><statistic center="1 2 3" extent="0.5"/>
        <worldbody><geom size="0.1"/></worldbody></mujoco>"""
    )
    camera = frame_robot(model, [mujoco.MjData(model)], View(authored=True))
    assert (camera.azimuth, camera.elevation) == (70, -28)
    assert list(camera.lookat) == [1, 2, 3]


def test_a_view_asked_for_is_the_view_that_is_taken() -> None:
    model = compile_mjcf(scene())
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = frame_robot(model, [data], View(azimuth_deg=10, elevation_deg=-80))
    nearer = frame_robot(model, [data], View(azimuth_deg=10, elevation_deg=-80, closeness=2))
    assert (camera.azimuth, camera.elevation) == (10, -80)
    assert nearer.distance == pytest.approx(camera.distance / 2)


def camera_of(mjcf: str) -> mujoco.MjvCamera:
    model = compile_mjcf(mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return frame_robot(model, [data], View())


def test_surroundings_that_move_are_wanted_in_the_picture() -> None:
    button = '<body pos="0.5 0 0.6"><joint type="slide"/><geom size="0.03"/></body>'
    alone, with_button = camera_of(scene()), camera_of(scene(FLOOR + button))
    assert with_button.lookat[0] > alone.lookat[0]
    assert with_button.distance > alone.distance


def test_staging_colours_what_has_no_colour_and_nothing_else() -> None:
    plain = (
        '<body name="robot/b"><joint/><geom name="plain" size="0.1"/></body><geom name="box" type="box" size="1 1 1"/>'
    )
    model = compile_for_display(parse_mjcf(scene(plain)))
    assert np.allclose(model.geom("red").rgba, [1, 0, 0, 1])
    assert not np.allclose(model.geom("plain").rgba, 0.5)
    assert not np.allclose(model.geom("plain").rgba, model.geom("box").rgba)


def test_staging_leaves_an_authors_names_to_their_author() -> None:
    flat = '<texture name="{}" type="2d" builtin="flat" width="8" height="8"/>'
    textures = flat.format("aidsr_floor") + flat.format("aidsr_sky")
    assets = f'<asset>{textures}<material name="aidsr_floor" rgba="1 0 0 1"/></asset>'
    model = compile_for_display(parse_mjcf(scene().replace("<worldbody>", f"{assets}<worldbody>")))
    assert np.allclose(model.material("aidsr_floor").rgba, [1, 0, 0, 1])
    assert model.geom_matid[0] == model.material("aidsr_floor_").id


def test_staging_changes_nothing_that_moves() -> None:
    before, after = compile_mjcf(scene()), compile_for_display(parse_mjcf(scene()))
    for name in ("body_mass", "body_inertia", "geom_size", "geom_friction", "qpos0", "opt.timestep"):
        first, *rest = name.split(".")
        one, other = getattr(before, first), getattr(after, first)
        assert np.array_equal(getattr(one, rest[0]) if rest else one, getattr(other, rest[0]) if rest else other)


@pytest.mark.usefixtures("opengl")
def test_a_video_shows_the_motion_it_was_given() -> None:
    angles = np.linspace(0, 1.5, 8)[:, None]
    film = rendering.video(scene(), qpos=angles, width=97, height=64)
    assert film is not None
    with av.open(io.BytesIO(film)) as container:
        stream = container.streams.video[0]
        frames = [frame.to_ndarray(format="rgb24").astype(int) for frame in container.decode(stream)]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt, stream.average_rate) == ("h264", "yuv420p", 25)
    assert len(frames) == 8
    assert frames[0].shape == (64, 96, 3)
    height = [np.nonzero(reddish(frame))[0].mean() for frame in frames]
    assert height[-1] > height[0] + 5


@pytest.mark.usefixtures("opengl")
def test_actuators_can_drive_a_video_and_swing_when_nothing_is_asked() -> None:
    held, driven = ([[0.0]] * 20, [[1.0]] * 20)
    moved = [pixels(rendering.filmstrip(scene(), ctrl=ctrl, count=2, width=64, height=64)) for ctrl in (held, driven)]
    change = [np.abs(strip[:, :64] - strip[:, 64:]).mean() for strip in moved]
    assert change[1] > 5 * change[0]
    assert rendering.video(scene(), seconds=0.4, width=64, height=64) is not None


def test_a_motion_is_given_once() -> None:
    with pytest.raises(RuntimeError, match="found both"):
        rendering.video(scene(), qpos=[[0.0]], ctrl=[[0.0]])


def test_a_model_that_cannot_be_loaded_is_not_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(MjcfError, match=r"did you mean|not an element"):
        rendering.picture(scene("<gem/>"))
    assert list(tmp_path.iterdir()) == []


def test_without_a_display_viewing_draws_a_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert viewing.view(scene(), tmp_path / "robot.png") == tmp_path / "robot.png"
    assert pixels((tmp_path / "robot.png").read_bytes()).shape == (960, 1280, 3)


def test_the_viewer_gets_the_checked_document() -> None:
    text = viewing.checked_document("```xml\n" + scene("<!-- note -->") + "\n```")
    assert text.startswith("<mujoco>")
    assert "note" not in text
    assert compile_mjcf(text).nu == 1


def test_only_the_robot_swings_when_nothing_is_asked() -> None:
    carriage = (
        '<mujoco><worldbody><body name="{0}a"><joint name="{0}a" type="slide" axis="1 0 0" damping="1"/>'
        '<geom name="{0}a" type="box" size=".1 .1 .1" rgba="1 0 0 1"/></body>'
        '<body name="robot/b" pos="0 0 1"><joint name="robot/b"/><geom name="robot/b" size=".1"/></body></worldbody>'
        '<actuator><motor name="{0}a" joint="{0}a" ctrlrange="-5 20"/></actuator></mujoco>'
    )
    change = {}
    for owner in ("", "robot/"):
        strip = pixels(rendering.filmstrip(carriage.format(owner), seconds=2.0, count=2, width=64, height=64))
        change[owner] = np.abs(strip[:, :64] - strip[:, 64:]).mean()
    assert change["robot/"] > 3 * change[""]


@pytest.mark.parametrize("side", ["0.03 0 0", "-0.03 0 0", "0 0.03 0", "0 -0.03 0"])
def test_a_button_on_any_side_of_a_panel_is_in_sight(side: str) -> None:
    model = mujoco.MjModel.from_xml_string(f"""<mujoco><worldbody>
      <geom type="box" size="0.025 0.025 0.2"/>
      <body name="button" pos="{side}"><joint/><geom name="button" type="sphere" size="0.008"/></body>
    </worldbody></mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = frame_robot(model, [data], View(shown=("button",)))
    forward = forward_of(camera)
    hit = np.zeros(1, np.int32)
    way = data.body("button").xpos - (camera.lookat - camera.distance * forward)
    mujoco.mj_ray(model, data, camera.lookat - camera.distance * forward, way, None, True, -1, hit, None)
    assert model.geom(int(hit[0])).name == "button"


def states_of(model: mujoco.MjModel, rows: list[list[float]]) -> Iterator[mujoco.MjData]:
    """Yield one and the same data object, with the positions of each row in turn."""
    data = mujoco.MjData(model)
    for row in rows:
        data.qpos[:] = row
        mujoco.mj_forward(model, data)
        yield data


def forward_of(camera: mujoco.MjvCamera) -> NDArray[np.float64]:
    azimuth, elevation = np.deg2rad([camera.azimuth, camera.elevation])
    level = np.cos(elevation)
    return np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])


@pytest.mark.parametrize("axis", ["1 0 0", "0 1 0", "1 1 0"])
def test_a_motion_is_seen_from_the_side(axis: str) -> None:
    model = compile_mjcf(scene().replace('axis="0 1 0"', f'axis="{axis}"'))
    camera = frame_robot(model, states_of(model, [[-1.0], [0.0], [1.0]]), View())
    across = np.array(axis.split(), float) / np.linalg.norm(np.array(axis.split(), float))
    assert abs(forward_of(camera) @ across) > 0.7, "the motion would be seen along its plane"


@pytest.mark.parametrize("rows", [[[0.0, 0.0], [0.0, -0.4]], [[0.0, -0.4], [0.0, 0.0]]])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_target_is_in_sight_at_the_start_and_at_the_end(side: int, rows: list[list[float]]) -> None:
    """In one of the two states a plate hides it from one side; in the other it lies below the plate."""
    things = (
        f'<geom name="plate" type="box" size="0.01 0.3 0.2" pos="{-0.15 * side} 0 0.6"/><body name="ring" '
        f'pos="{-0.22 * side} 0 0.6"><joint type="slide"/><geom name="ring" type="sphere" size="0.02"/></body>'
    )
    model = compile_mjcf(scene(FLOOR + things))
    camera = frame_robot(model, states_of(model, rows), View(shown=("ring",)))
    eye, hit = camera.lookat - camera.distance * forward_of(camera), np.zeros(1, np.int32)
    for data in states_of(model, rows):
        mujoco.mj_ray(model, data, eye, data.body("ring").xpos - eye, None, True, -1, hit, None)
        assert model.geom(int(hit[0])).name == "ring"
