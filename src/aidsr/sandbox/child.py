"""One worker process as its parent sees it: start, ask, notice how it ended, clean up."""

from __future__ import annotations

import os
import shutil
import signal
import site
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any, BinaryIO, cast

import aidsr
from aidsr.sandbox.worker import GL_WANTED, INSIDE, read_message, write_message

__all__ = ["Child", "child_environment"]

_START_LIMIT_S = 120.0  # our choice: importing MuJoCo takes 1 s, and many times that on a machine under heavy load
_MAX_CALLS = 200  # our choice: then a fresh process, in case a native library loses memory on each model
_OUTPUT_TAIL = 1500  # characters of a dead child's output kept in the error

_KEPT = {"PATH", "LANG", "LC_ALL", "LC_CTYPE", "TZ", "PYTHONPATH", "PYTHONHOME", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH"}
_KEPT |= {"SYSTEMROOT", "WINDIR", "COMSPEC", "PATHEXT", "MUJOCO_EGL_DEVICE_ID"}
_KEPT |= {"CUDA_VISIBLE_DEVICES", "NVIDIA_VISIBLE_DEVICES", "NVIDIA_DRIVER_CAPABILITIES", "PYTHONDONTWRITEBYTECODE"}
_KEPT_PREFIXES = ("__EGL_", "EGL_", "LIBGL_", "MESA_", "GALLIUM_")


class Child:
    """A worker process, its private folder and the pipes to it."""

    def __init__(self) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="aidsr-worker-"))
        self._output = (self._folder / "output.txt").open("wb")
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "aidsr.sandbox.worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._output,
            cwd=self._folder,
            env=child_environment(self._folder),
            start_new_session=True,  # Ctrl-C in a terminal is for the parent, which then ends its children
        )
        self._requests = cast(BinaryIO, self._process.stdin)
        self._replies = cast(BinaryIO, self._process.stdout)
        self._calls = 0
        self._ready = self._busy = self._late = False

    @property
    def usable(self) -> bool:
        """Whether another call may be given to this child."""
        return not (self._busy or self._late) and self._calls < _MAX_CALLS and self._process.poll() is None

    def ask(self, request: dict[str, Any], wall_s: float) -> dict[str, Any]:
        """Return the child's answer, or {"time" | "memory" | "crash": …} saying how it ended instead.

        Raises:
            TypeError: The request cannot be expressed in JSON.
        """
        self._busy = True
        if not self._ready:
            start = self._exchange(None, _START_LIMIT_S)
            if "ready" not in start:
                return start if "crash" in start else {"crash": f"it was not ready after {_START_LIMIT_S:g} s"}
            self._ready = True
        self._calls += 1
        answer = self._exchange(request, wall_s)
        # What was short of memory may be in any state; it stays busy for good and is replaced.
        self._busy = not answer.keys() & {"result", "mjcf", "user", "bug"}
        return answer

    def close(self) -> None:
        """End the process and remove its folder."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._requests, self._replies, self._output):
            try:
                pipe.close()
            except BrokenPipeError:  # a request that was cut short cannot be flushed any more
                continue
        shutil.rmtree(self._folder, ignore_errors=True)

    def _exchange(self, request: dict[str, Any] | None, limit_s: float) -> dict[str, Any]:
        clock = threading.Timer(limit_s, self._stop)
        clock.daemon = True
        clock.start()
        try:
            if request is not None:
                write_message(self._requests, request)
            answer = read_message(self._replies)
        except OSError:
            answer = None
        finally:
            clock.cancel()
        return self._ending() if answer is None else answer

    def _stop(self) -> None:
        self._late = True
        self._process.kill()

    def _ending(self) -> dict[str, Any]:
        """Return how the process ended, in the words of `ask`."""
        code = self._process.wait()
        if self._late:
            return {"time": "wall"}
        if sys.platform != "win32" and code == -signal.SIGXCPU:
            return {"time": "cpu"}
        output = (self._folder / "output.txt").read_text("utf-8", "replace")
        # Killed and not by us: the system does that when memory runs out. C++ says bad_alloc before it aborts.
        if (sys.platform != "win32" and code == -signal.SIGKILL) or "bad_alloc" in output or "MemoryError" in output:
            return {"memory": True}
        name = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        return {"crash": f"{name}\n{output[-_OUTPUT_TAIL:]}".strip()}


def child_environment(folder: Path) -> dict[str, str]:
    """Return the variables a child gets: what libraries need to load, and nothing that could be a key."""
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
