"""Off-screen rendering with OpenGL, on machines that have it.

MuJoCo loads its OpenGL backend when it is imported, which takes 0.3 s and fails where the libraries are missing. A
worker therefore imports MuJoCo without OpenGL, and this module creates the context when a picture is requested.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sandbox.environment import GL_WANTED

_MAX_GEOMS = 20_000
_IN_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader", "software")
_CARDS = (*(f"/dev/dri/renderD{number}" for number in range(128, 144)), "/dev/nvidiactl")
_OFF = ("disable", "disabled", "off", "false", "0")


class NoOpenGLError(Exception):
    """OpenGL is not available; the message says why."""


class Canvas:
    """Off-screen OpenGL renderer of a model.

    Args:
        model: The compiled model.
        width: Columns [px].
        height: Rows [px].

    Raises:
        NoOpenGLError: OpenGL is not available.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        self._model, self._viewport = model, mujoco.MjrRect(0, 0, width, height)
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._window = _window(width, height, _kinds())
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._scene = mujoco.MjvScene(model, _MAX_GEOMS)
        self._options = mujoco.MjvOption()
        # This flag would colour tendons by their control values and hide their own colours.
        self._options.flags[mujoco.mjtVisFlag.mjVIS_ACTUATOR] = False

    def draw(self, data: mujoco.MjData, camera: mujoco.MjvCamera, *, shadows: bool = True) -> NDArray[np.uint8]:
        """Return a picture of the model as RGB values, shape `(height, width, 3)`.

        Args:
            data: State with kinematics computed.
            camera: Camera to look from.
            shadows: Whether to draw shadows and reflections.
        """
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, data, self._options, None, camera, everything, self._scene)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = shadows
        mujoco.mjr_render(self._viewport, self._scene, self._context)
        upside_down = np.empty((self._viewport.height, self._viewport.width, 3), np.uint8)
        mujoco.mjr_readPixels(upside_down, None, self._viewport, self._context)
        return np.ascontiguousarray(upside_down[::-1])

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._context.free()
        self._window.free()


def renderer() -> str:
    """Return the name of the OpenGL renderer on this machine.

    Raises:
        NoOpenGLError: OpenGL is not available.
    """
    return _renderer(_kinds())


@cache
def _renderer(kinds: Sequence[str]) -> str:
    window = _window(16, 16, kinds)
    try:
        from OpenGL.GL import GL_RENDERER, glGetString

        return str(glGetString(GL_RENDERER), "utf-8", "replace")
    finally:
        window.free()


def has_graphics_card() -> bool:
    """Return whether there may be a graphics card, without loading OpenGL, which takes a third of a second.

    On Linux this checks for the device files of the kernel's drivers or NVIDIA's; on other systems it is always true.
    """
    return sys.platform != "linux" or any(Path(name).exists() for name in _CARDS)


def in_software(name: str) -> bool:
    """Return whether an OpenGL renderer of this name is a software renderer."""
    return any(word in name.lower() for word in _IN_SOFTWARE)


def _window(width: int, height: int, kinds: Sequence[str]) -> Any:
    """Return an OpenGL context, made current, of the first kind that works on this machine.

    Raises:
        NoOpenGLError: No kind works.
    """
    reasons = []
    for kind in kinds:
        try:
            window = _context_class(kind)(width, height)
            window.make_current()
        except Exception as error:  # each binding raises its own exceptions; all mean that it is not available
            reasons.append(f"{kind}: {str(error).splitlines()[0] if str(error) else type(error).__name__}")
        else:
            return window
    raise NoOpenGLError("; ".join(reasons) or "switched off by MUJOCO_GL")


def _kinds() -> Sequence[str]:
    wanted = os.environ.get(GL_WANTED, "").lower().strip()
    if wanted in _OFF:
        return ()
    if wanted in ("egl", "osmesa", "cgl", "glfw"):
        return (wanted,)
    return {"linux": ("egl", "osmesa"), "darwin": ("cgl",)}.get(sys.platform, ("glfw",))


def _context_class(kind: str) -> Any:
    if kind == "egl":
        from mujoco.egl import GLContext
    elif kind == "osmesa":
        from mujoco.osmesa import GLContext
    elif kind == "cgl":
        from mujoco.cgl import GLContext
    else:
        from mujoco.glfw import GLContext
    return GLContext
