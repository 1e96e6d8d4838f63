"""Environment variables of a child process: those that libraries need, and none that could contain a secret."""

from __future__ import annotations

import os
import site
from pathlib import Path

import aidsr

INSIDE = "AIDSR_INSIDE_WORKER"
"""Variable that is set in every child process, to its private folder; it marks that code there is already isolated."""

GL_WANTED = "AIDSR_GL"
"""Variable with the user's value of MUJOCO_GL, for rendering code in a child."""

_KEPT = {"PATH", "LANG", "LC_ALL", "LC_CTYPE", "TZ", "PYTHONPATH", "PYTHONHOME", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH"}
_KEPT |= {"SYSTEMROOT", "WINDIR", "COMSPEC", "PATHEXT", "MUJOCO_EGL_DEVICE_ID"}
_KEPT |= {"CUDA_VISIBLE_DEVICES", "NVIDIA_VISIBLE_DEVICES", "NVIDIA_DRIVER_CAPABILITIES", "PYTHONDONTWRITEBYTECODE"}
_KEPT_PREFIXES = ("__EGL_", "EGL_", "LIBGL_", "MESA_", "GALLIUM_")


def inside_worker() -> bool:
    """Return whether this process is an isolated child process."""
    return INSIDE in os.environ


def child_environment(folder: Path) -> dict[str, str]:
    """Return the environment of a child, with home and temporary directories in its private folder."""
    kept = {name: value for name, value in os.environ.items() if name in _KEPT or name.startswith(_KEPT_PREFIXES)}
    root = str(Path(aidsr.__file__).parents[1])
    private = str(folder)
    if site.ENABLE_USER_SITE:  # MuJoCo may be installed there, and Python would search it in the changed HOME
        kept["PYTHONUSERBASE"] = site.getuserbase()
    return kept | {
        "PYTHONPATH": os.pathsep.join([root, *filter(None, [kept.get("PYTHONPATH")])]),
        INSIDE: private,
        "HOME": private,
        "USERPROFILE": private,
        "TMPDIR": private,
        "TEMP": private,
        "TMP": private,
        # Each extra arena or thread reserves address space, which counts towards the memory limit.
        "MALLOC_ARENA_MAX": "2",
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        # MuJoCo would load OpenGL when imported, but most calls need none; others get it from `aidsr.render.opengl`.
        "MUJOCO_GL": "disable",
        GL_WANTED: os.environ.get("MUJOCO_GL", ""),
    }
