"""Pictures and videos of models, rendered in an isolated worker process.

With a graphics card, OpenGL is used. Without one, `aidsr.render.raycasting` renders a picture in a fraction of a
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
"""One row of numbers for each frame, shape `(n_frames, nq)` or `(n_frames, nu)`; NumPy arrays are accepted too."""


@isolated(limits=_PICTURE_LIMITS)
def picture(
    mjcf: str, *, width: int = 640, height: int = 480, view: View | None = None, highlighted: Sequence[str] = ()
) -> bytes:
    """Return a PNG picture of a robot or scene in its initial state.

    The camera shows the whole robot with its surroundings.

    Args:
        mjcf: MJCF of a robot or scene; in a scene, names beginning with "robot/" mark the robot.
        width: Columns [px].
        height: Rows [px].
        view: Viewing direction; chosen automatically by default.
        highlighted: Names of bodies, joints, geoms, tendons and actuators to show in red, with the rest of the robot
            faded.

    Raises:
        MjcfError: The MJCF cannot be loaded.
        IsolationError: Rendering exceeded a limit.
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
    """Return a PNG picture with `count` frames of a motion side by side.

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

    The camera follows a free robot that travels; the frames then show the time and the distance from the start.

    Args:
        mjcf: MJCF of a robot or scene.
        qpos: Positions to show, one row per frame, shape `(n_frames, nq)`.
        ctrl: Controls to simulate from the initial state, one row per frame, shape `(n_frames, nu)`. Without `qpos` and
            `ctrl`, every actuator swings through its range, each with a phase lag to the one before.
        seconds: Length of this default motion [s]; not used with `qpos` or `ctrl`.
        frames_per_s: Frames, and rows of `qpos` or `ctrl`, per second.
        width: Columns [px], rounded down to an even number.
        height: Rows [px], rounded down to an even number.
        view: Viewing direction; chosen automatically by default.

    Raises:
        MjcfError: The MJCF cannot be loaded.
        IsolationError: Simulation or rendering exceeded a limit.
    """
    from aidsr.render.draw import Motion, draw_video

    size = (width - width % 2, height - height % 2)
    return draw_video(mjcf, Motion(qpos, ctrl, seconds, frames_per_s), *size, view or View())


@isolated(limits=_PICTURE_LIMITS)
def gl_status() -> str:
    """Return in one sentence how pictures are rendered on this machine, for `aidsr doctor`."""
    from aidsr.render.draw import describe_graphics

    return describe_graphics()
