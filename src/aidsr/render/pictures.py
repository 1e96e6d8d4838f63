"""Pictures and videos of models, drawn in a worker.

A graphics card draws with OpenGL. Where there is none, `aidsr.render.raycasting` draws a picture in a fraction of a
second; videos need OpenGL, which may be in software.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import PlainSerializer

from aidsr.render.view import View
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits

_PICTURE_LIMITS = Limits(wall_s=60, cpu_s=120)
_VIDEO_LIMITS = Limits(wall_s=600, cpu_s=1200)


def _rows(frames: Sequence[Sequence[float]]) -> list[list[float]]:
    return [[float(value) for value in row] for row in frames]


Frames = Annotated[Sequence[Sequence[float]], PlainSerializer(_rows)]
"""One row of numbers for each frame, shape `(n_frames, nq)` or `(n_frames, nu)`; NumPy arrays too."""


@isolated(limits=_PICTURE_LIMITS)
def picture(
    mjcf: str, *, width: int = 640, height: int = 480, view: View | None = None, highlighted: Sequence[str] = ()
) -> bytes:
    """Return a PNG picture of a robot or scene in its initial state.

    The camera is put where the robot is seen whole, with what stands around it.

    Args:
        mjcf: Robot or scene; names beginning "robot/" mark the robot in a scene.
        width: Columns [px].
        height: Rows [px].
        view: From where to look; chosen when not given.
        highlighted: Names of bodies, joints, geoms, tendons and actuators to show in red, with the rest of the robot
            faded.

    Raises:
        MjcfError: The text cannot be loaded.
        IsolationError: Drawing ran past a limit.
    """
    from aidsr.render.draw import draw_picture

    return draw_picture(mjcf, width, height, view or View(), highlighted)


@isolated(limits=_PICTURE_LIMITS)
def filmstrip(
    mjcf: str,
    *,
    qpos: Frames | None = None,
    ctrl: Frames | None = None,
    seconds: float = 6.0,
    frames_per_s: float = 25.0,
    count: int = 5,
    width: int = 240,
    height: int = 240,
    view: View | None = None,
) -> bytes:
    """Return a PNG picture of a motion: `count` moments of it side by side.

    The motion is given as in `video`.
    """
    from aidsr.render.draw import Motion, draw_filmstrip

    return draw_filmstrip(mjcf, Motion(qpos, ctrl, seconds, frames_per_s), count, width, height, view or View())


@isolated(limits=_VIDEO_LIMITS)
def video(
    mjcf: str,
    *,
    qpos: Frames | None = None,
    ctrl: Frames | None = None,
    seconds: float = 6.0,
    frames_per_s: float = 25.0,
    width: int = 640,
    height: int = 480,
    view: View | None = None,
) -> bytes | None:
    """Return a motion as MP4 (H.264), or None where there is no OpenGL.

    The camera follows a free robot that travels; the picture shows the time and the distance from its start.

    Args:
        mjcf: Robot or scene.
        qpos: Positions to show, one row a frame, shape `(n_frames, nq)`.
        ctrl: Controls to simulate from the initial state, one row a frame, shape `(n_frames, nu)`. Without `qpos` and
            `ctrl` every actuator swings through its range, each a little behind the one before.
        seconds: Length of that motion [s]; not used with `qpos` or `ctrl`.
        frames_per_s: Frames, and rows of `qpos` or `ctrl`, in a second.
        width: Columns [px], rounded down to an even number.
        height: Rows [px], rounded down to an even number.
        view: From where to look; chosen when not given.

    Raises:
        MjcfError: The text cannot be loaded.
        IsolationError: Simulating or drawing ran past a limit.
    """
    from aidsr.render.draw import Motion, draw_video

    size = (width - width % 2, height - height % 2)
    return draw_video(mjcf, Motion(qpos, ctrl, seconds, frames_per_s), *size, view or View())


@isolated(limits=_PICTURE_LIMITS)
def gl_status() -> str:
    """Return in one sentence how pictures are drawn here, for `aidsr doctor`."""
    from aidsr.render.draw import describe_graphics

    return describe_graphics()
