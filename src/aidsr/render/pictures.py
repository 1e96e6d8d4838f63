"""Pictures and videos of models, drawn in a worker.

With OpenGL a picture takes a fraction of a second. Without, `aidsr.render.raycasting` draws it in about a second;
videos need OpenGL.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from aidsr.sandbox import isolation
from aidsr.sandbox.isolation import Limits

if TYPE_CHECKING:
    from aidsr.render.camera import View

__all__ = ["Frames", "filmstrip", "gl_status", "picture", "video"]

Frames = Sequence[Sequence[float]]
"""One row of numbers for each frame, shape `(n_frames, nq)` or `(n_frames, nu)`; NumPy arrays too."""

_PICTURE_LIMITS = Limits(wall_s=60, cpu_s=120)
_VIDEO_LIMITS = Limits(wall_s=600, cpu_s=1200)
_HOME = "aidsr.render.draw"


def picture(
    mjcf: str, *, width: int = 640, height: int = 480, view: View | None = None, lit: Sequence[str] = ()
) -> bytes:
    """Return a PNG picture of a robot or scene in its initial state.

    The camera is put where the robot is seen whole, with what stands around it.

    Args:
        mjcf: Robot or scene; names beginning "robot/" mark the robot in a scene.
        width: Columns [px].
        height: Rows [px].
        view: From where to look; chosen when not given.
        lit: Names of bodies, joints, geoms, tendons and actuators to show in red while the rest of the robot fades.

    Raises:
        MjcfError: The text cannot be loaded.
        IsolationError: Drawing ran past a limit.
    """
    shown: dict[str, Any] = {"width": width, "height": height, "view": _written(view), "lit": list(lit)}
    return _drawn("draw_picture", _PICTURE_LIMITS, mjcf=mjcf, **shown) or b""


def filmstrip(
    mjcf: str,
    *,
    qpos: Frames | None = None,
    ctrl: Frames | None = None,
    seconds: float = 6.0,
    frames_per_s: float = 25.0,
    count: int = 5,
    width: int = 320,
    height: int = 320,
    view: View | None = None,
) -> bytes:
    """Return a PNG picture of a motion: `count` moments of it side by side.

    The motion is given as in `video`.
    """
    motion = _motion(qpos, ctrl, seconds, frames_per_s)
    size = {"count": count, "width": width, "height": height}
    return _drawn("draw_filmstrip", _PICTURE_LIMITS, mjcf=mjcf, motion=motion, view=_written(view), **size) or b""


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

    The camera goes along with a free robot that travels; the time and the way from its start stand in the picture.

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
    motion = _motion(qpos, ctrl, seconds, frames_per_s)
    size = {"width": width - width % 2, "height": height - height % 2}
    return _drawn("draw_video", _VIDEO_LIMITS, mjcf=mjcf, motion=motion, view=_written(view), **size)


def gl_status() -> str:
    """Return in one sentence how pictures are drawn here, for `aidsr doctor`."""
    status: str = isolation.call(f"{_HOME}:describe_graphics", {}, _PICTURE_LIMITS)["status"]
    return status


def _drawn(function: str, limits: Limits, **argument: Any) -> bytes | None:
    data = isolation.call(f"{_HOME}:{function}", argument, limits)["data"]
    return None if data is None else base64.b64decode(data)


def _written(view: View | None) -> dict[str, Any]:
    return {} if view is None else asdict(view)


def _motion(qpos: Frames | None, ctrl: Frames | None, seconds: float, frames_per_s: float) -> dict[str, Any]:
    if qpos is not None and ctrl is not None:
        raise ValueError("expected qpos to show or ctrl to simulate, found both")
    timing = {"seconds": seconds, "frames_per_s": frames_per_s}
    return timing | {name: _rows(rows) for name, rows in (("qpos", qpos), ("ctrl", ctrl)) if rows is not None}


def _rows(frames: Frames) -> list[list[float]]:
    return [[float(value) for value in row] for row in frames]
