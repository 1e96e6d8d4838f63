"""The environment variables of a child process: what libraries need to load, and nothing that could be a key."""

from __future__ import annotations

import os
import site
from pathlib import Path

import aidsr

INSIDE = "AIDSR_INSIDE_WORKER"
"""Set in every child process, to its private folder: code that runs there is isolated already."""

GL_WANTED = "AIDSR_GL"
"""What the user set MUJOCO_GL to, kept for the code in a child that draws."""

_KEPT = {"PATH", "LANG", "LC_ALL", "LC_CTYPE", "TZ", "PYTHONPATH", "PYTHONHOME", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH"}
_KEPT |= {"SYSTEMROOT", "WINDIR", "COMSPEC", "PATHEXT", "MUJOCO_EGL_DEVICE_ID"}
_KEPT |= {"CUDA_VISIBLE_DEVICES", "NVIDIA_VISIBLE_DEVICES", "NVIDIA_DRIVER_CAPABILITIES", "PYTHONDONTWRITEBYTECODE"}
_KEPT_PREFIXES = ("__EGL_", "EGL_", "LIBGL_", "MESA_", "GALLIUM_")


def inside_worker() -> bool:
    """Return whether this process is a child with limits already."""
    return INSIDE in os.environ


def child_environment(folder: Path) -> dict[str, str]:
    """Return the environment of a child whose home and temporary files are in its private folder."""
    kept = {name: value for name, value in os.environ.items() if name in _KEPT or name.startswith(_KEPT_PREFIXES)}
    root = str(Path(aidsr.__file__).parents[1])
    private = str(folder)
    if site.ENABLE_USER_SITE:  # where MuJoCo may be installed; Python looks for it in HOME, which becomes the folder
        kept["PYTHONUSERBASE"] = site.getuserbase()
    return kept | {
        "PYTHONPATH": os.pathsep.join([root, *filter(None, [kept.get("PYTHONPATH")])]),
        INSIDE: private,
        "HOME": private,
        "USERPROFILE": private,
        "TMPDIR": private,
        "TEMP": private,
        "TMP": private,
        # Each extra arena or thread reserves address space, which is what the memory limit counts.
        "MALLOC_ARENA_MAX": "2",
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        # MuJoCo loads OpenGL when imported and most calls need none; the others get it from `aidsr.render.opengl`.
        "MUJOCO_GL": "disable",
        GL_WANTED: os.environ.get("MUJOCO_GL", ""),
    }
