"""Worker side of `aidsr.render.pictures`: load, simulate, render and encode."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from aidsr.mjcf.compile import load_mjcf, parse_mjcf
from aidsr.render.camera import frame_robot
from aidsr.render.highlight import highlight
from aidsr.render.opengl import Canvas, NoOpenGLError, has_graphics_card, in_software, renderer
from aidsr.render.raycasting import RayCanvas
from aidsr.render.stage import compile_for_display, mark_mounts
from aidsr.render.tracking_camera import track_robot
from aidsr.render.view import View
from aidsr.sim.ownership import read_ownership

_Pixels = NDArray[np.uint8]
_Positions = NDArray[np.float64]
_SWING_HZ = 0.4  # our choice: slow enough to follow, fast enough to see each actuator twice in 6 s
_FRAMED_STATES = 12


@dataclass(frozen=True)
class Motion:
    """A motion to show; for the fields see `aidsr.render.pictures.video`.

    Raises:
        ValueError: Both `qpos` and `ctrl` are given.
    """

    qpos: Sequence[Sequence[float]] | None
    ctrl: Sequence[Sequence[float]] | None
    seconds: float
    frames_per_s: float

    def __post_init__(self) -> None:
        if self.qpos is not None and self.ctrl is not None:
            raise ValueError("found both qpos to show and ctrl to simulate; give one of them")


def draw_picture(mjcf: str, width: int, height: int, view: View, highlighted: Sequence[str]) -> bytes:
    """Return a picture of a model in its initial state as PNG."""
    model = compile_for_display(parse_mjcf(mjcf))
    highlight(model, highlighted)
    mark_mounts(model, view.shown)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    camera = frame_robot(model, [data], view)
    with _canvas(model, width, height, see_through=bool(highlighted)) as canvas:
        return _png(canvas.draw(data, camera))


def draw_filmstrip(mjcf: str, motion: Motion, count: int, width: int, height: int, view: View) -> bytes:
    """Return `count` frames of a motion side by side as PNG."""
    loaded = load_mjcf(mjcf)
    positions = _positions(loaded.model, motion)
    chosen = np.linspace(0, len(positions) - 1, count).round().astype(int)
    model = compile_for_display(loaded.spec)
    film = _Film(model, positions, chosen, motion.frames_per_s, view)
    with _canvas(model, width, height) as canvas:
        return _png(np.concatenate([*film.pictures(canvas.draw)], axis=1))


def draw_video(mjcf: str, motion: Motion, width: int, height: int, view: View) -> bytes | None:
    """Return a motion as MP4, or None without OpenGL."""
    loaded = load_mjcf(mjcf)
    positions = _positions(loaded.model, motion)
    model = compile_for_display(loaded.spec)
    film = _Film(model, positions, np.arange(len(positions)), motion.frames_per_s, view)
    try:
        with Canvas(model, width, height) as canvas:
            pictures = film.pictures(lambda data, camera: canvas.draw(data, camera, shadows=False))
            return _mp4(pictures, motion.frames_per_s)
    except NoOpenGLError:
        return None


def _canvas(model: mujoco.MjModel, width: int, height: int, *, see_through: bool = False) -> Canvas | RayCanvas:
    """Return the fastest renderer for a single picture.

    Ray casting takes half the time of OpenGL in software; only OpenGL supports transparency (`see_through`).
    """
    try:
        if see_through or (has_graphics_card() and not in_software(renderer())):
            return Canvas(model, width, height)
    except NoOpenGLError:
        pass
    return RayCanvas(model, width, height)


class _Film:
    """Frames of a motion and their camera, which is fixed or follows a robot that travels.

    Args:
        model: The compiled model; its field of view and clipping planes are set here, before a canvas is made.
        positions: Positions of the whole motion (n_frames, nq).
        chosen: Numbers of the frames to render.
        frames_per_s: Frames of the motion per second.
        view: Viewing direction.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        positions: _Positions,
        chosen: NDArray[np.int_],
        frames_per_s: float,
        view: View,
    ) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        self._positions, self._chosen = positions, chosen
        self._frames_per_s = frames_per_s
        some = positions[chosen[:: max(1, len(chosen) // _FRAMED_STATES)]]
        self._travel = track_robot(model, self._data, positions)
        self._camera = self._travel.camera(view) if self._travel else frame_robot(model, self._states(some), view)

    def pictures(self, draw: Callable[[mujoco.MjData, mujoco.MjvCamera], _Pixels]) -> Iterator[_Pixels]:
        """Yield the chosen frames, captioned with time and distance from the start if the camera follows the robot."""
        for number, data in zip(self._chosen, self._states(self._positions[self._chosen]), strict=True):
            if self._travel is None:
                yield draw(data, self._camera)
            else:
                self._camera.lookat[:] = self._travel.lookat_m[number]
                caption = f"{number / self._frames_per_s:.1f} s, {self._travel.distance_m[number]:.2f} m"
                yield _draw_caption(draw(data, self._camera), caption)

    def _states(self, positions: _Positions) -> Iterator[mujoco.MjData]:
        for qpos in positions:
            self._data.qpos[:] = qpos
            mujoco.mj_forward(self._model, self._data)
            yield self._data


def describe_graphics() -> str:
    """Return in one sentence how pictures are rendered on this machine."""
    try:
        name = renderer()
    except NoOpenGLError as error:
        return f"no OpenGL ({error}): pictures by ray casting; no videos"
    if in_software(name):
        return f"OpenGL in software ({name}): videos; pictures by ray casting, which is faster"
    return f"OpenGL off-screen ({name}): pictures and videos"


def _positions(model: mujoco.MjModel, motion: Motion) -> _Positions:
    """Return the positions of a motion, shape `(n_frames, nq)`, up to the first frame that is not finite."""
    if motion.qpos is not None:
        positions = np.array(motion.qpos, float)
    else:
        ctrl = np.array(motion.ctrl, float) if motion.ctrl is not None else _swing_controls(model, motion)
        positions = _simulate(model, ctrl, motion.frames_per_s)
    broken = np.flatnonzero(~np.isfinite(positions).all(axis=1))
    return positions[: broken[0]] if broken.size else positions


def _swing_controls(model: mujoco.MjModel, motion: Motion) -> NDArray[np.float64]:
    """Return controls that swing each actuator of the robot, with phase lags; other actuators get zero control.

    Zero is clipped to an actuator's control range.
    """
    times = np.arange(round(motion.seconds * motion.frames_per_s)) / motion.frames_per_s
    limited = model.actuator_ctrllimited.astype(bool)
    low = np.where(limited, model.actuator_ctrlrange[:, 0], -1.0)
    high = np.where(limited, model.actuator_ctrlrange[:, 1], 1.0)
    phase = 2 * np.pi * (_SWING_HZ * times[:, None] - np.arange(model.nu) / max(model.nu, 1))
    onset = np.clip(times, 0, 1)[:, None]
    swing: NDArray[np.float64] = (low + high) / 2 + onset * (high - low) / 2 * np.sin(phase)
    owned = read_ownership(model)
    counts = np.asarray(model.actuator_ctrlnum)
    theirs = ~np.repeat([owned.actuator(actuator) for actuator in range(model.nactuator)], counts).astype(bool)
    swing[:, theirs] = np.clip(0.0, low[theirs], high[theirs])
    return swing


def _simulate(model: mujoco.MjModel, ctrl: NDArray[np.float64], frames_per_s: float) -> NDArray[np.float64]:
    data = mujoco.MjData(model)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    positions = [data.qpos.copy()]
    steps = max(1, round(1 / (frames_per_s * model.opt.timestep)))
    for row in ctrl[:-1]:
        data.ctrl[:] = row
        mujoco.mj_step(model, data, nstep=steps)
        positions.append(data.qpos.copy())
    return np.array(positions)


def _draw_caption(pixels: _Pixels, caption: str) -> _Pixels:
    """Return a picture with a line of text in its lower left corner."""
    picture = Image.fromarray(pixels)
    size = picture.height / 12  # our choice: readable in a strip of small pictures
    place = (size / 2, picture.height - size / 2)
    font = ImageFont.load_default(size)
    ImageDraw.Draw(picture).text(place, caption, "white", font, anchor="ld", stroke_width=2, stroke_fill="black")
    return np.asarray(picture)


def _png(pixels: _Pixels) -> bytes:
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


def _mp4(pictures: Iterator[_Pixels], frames_per_s: float) -> bytes:
    import av  # not needed for pictures

    file = io.BytesIO()
    with av.open(file, "w", format="mp4") as container:
        stream = None
        for pixels in pictures:
            if stream is None:
                stream = container.add_stream("libx264", rate=Fraction(frames_per_s).limit_denominator(1000))
                stream.height, stream.width = pixels.shape[:2]
                stream.pix_fmt = "yuv420p"  # the format that every browser plays
                stream.options = {"crf": "22", "preset": "veryfast"}
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")))
        if stream is not None:
            container.mux(stream.encode())
    return file.getvalue()
