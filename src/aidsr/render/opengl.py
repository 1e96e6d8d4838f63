"""A canvas to draw on off-screen with OpenGL, where the machine has it.

MuJoCo chooses its OpenGL when it is imported, which costs 0.3 s and fails where the libraries are missing. A worker
therefore imports MuJoCo without any, and this module adds the context when a picture is wanted.
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
    """There is no OpenGL to draw with; the message says why."""


class Canvas:
    """An off-screen picture of a model, drawn as often as wanted.

    Args:
        model: The compiled model.
        width: Columns [px].
        height: Rows [px].

    Raises:
        NoOpenGLError: There is no OpenGL to draw with.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        self._model, self._viewport = model, mujoco.MjrRect(0, 0, width, height)
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._window = _window(width, height, _kinds())
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._scene = mujoco.MjvScene(model, _MAX_GEOMS)
        self._options = mujoco.MjvOption()
        # Colours each tendon by its control, which hides the colour it was given.
        self._options.flags[mujoco.mjtVisFlag.mjVIS_ACTUATOR] = False

    def draw(self, data: mujoco.MjData, camera: mujoco.MjvCamera, *, shadows: bool = True) -> NDArray[np.uint8]:
        """Return the model in its current state as RGB values, shape `(height, width, 3)`."""
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
    """Return what draws with OpenGL here, in its own words.

    Raises:
        NoOpenGLError: There is no OpenGL to draw with.
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
    """Return whether a graphics card may be there, without loading OpenGL, which takes a third of a second.

    On Linux one that draws has a device file, of the kernel's own drivers or of NVIDIA's; elsewhere one is expected.
    """
    return sys.platform != "linux" or any(Path(name).exists() for name in _CARDS)


def in_software(name: str) -> bool:
    """Return whether a renderer of this name draws with the processor, without a graphics card."""
    return any(word in name.lower() for word in _IN_SOFTWARE)


def _window(width: int, height: int, kinds: Sequence[str]) -> Any:
    """Return a current OpenGL context of the first kind that works here."""
    reasons = []
    for kind in kinds:
        try:
            window = _context_class(kind)(width, height)
            window.make_current()
        except Exception as error:  # each OpenGL binding fails in ways of its own; all mean that it is not there
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
