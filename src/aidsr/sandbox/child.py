"""Parent side of one worker process: start it, send requests, determine how it ended, clean up."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, BinaryIO, cast

from aidsr.sandbox.access import NOTHING, Access
from aidsr.sandbox.environment import child_environment
from aidsr.sandbox.pipes import read_message, write_message

_START_LIMIT_S = 120.0  # our choice: importing MuJoCo takes 1 s, and many times that on a machine under heavy load
_MAX_CALLS = 200  # our choice: afterwards a new process is started, in case a native library leaks memory
_OUTPUT_TAIL = 1500  # characters from the end of a crashed child's output that are kept in the error

_FROM_OUTSIDE = {
    getattr(signal, name) for name in ("SIGKILL", "SIGTERM", "SIGHUP", "SIGINT", "SIGQUIT") if hasattr(signal, name)
}
"""Signals that no model can cause: they come from a person, a job scheduler, or the system's out-of-memory killer."""


def _reason_not_started(start: dict[str, Any]) -> str:
    if "time" in start:
        return f"it was not ready after {_START_LIMIT_S:g} s"
    return f"it could not start: {start.get('lost') or start.get('crash') or 'no memory'}"


class Child:
    """A worker process, its private folder and the pipes to it.

    Args:
        access: Files that it may open.
        prepare: Modules to load before it gives up access to other files; see `connect_to_parent`.
    """

    def __init__(self, access: Access = NOTHING, prepare: Sequence[str] = ()) -> None:
        self.access = access
        self._folder = Path(tempfile.mkdtemp(prefix="aidsr-worker-"))
        self._output = (self._folder / "output.txt").open("wb")
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "aidsr.sandbox.worker", access.to_json(), *prepare],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._output,
            cwd=self._folder,
            env=child_environment(self._folder),
            start_new_session=True,  # Ctrl-C in a terminal reaches only the parent, which then ends its children
        )
        self._requests = cast(BinaryIO, self._process.stdin)
        self._replies = cast(BinaryIO, self._process.stdout)
        self._calls = 0
        self._ready = self._busy = self._late = False

    @property
    def usable(self) -> bool:
        """Whether this child can take another call."""
        return not (self._busy or self._late) and self._calls < _MAX_CALLS and self._process.poll() is None

    def call(
        self,
        request: dict[str, Any],
        wall_s: float,
        listen: Callable[[list[Any]], None] = lambda _values: None,
        grace_s: float = 0.0,
    ) -> dict[str, Any]:
        """Return the child's reply, or one of {"time", "memory", "overflow", "crash", "lost": …} for how it ended.

        "lost" means that the request is not at fault: the child could not start, or was ended from outside.

        Args:
            request: Function to run with its arguments.
            wall_s: Largest wall time until the result or the next progress message.
            listen: Called with the values of each progress message, while the function waits.
            grace_s: Time to save its work that the function gets after a KeyboardInterrupt in this process.

        Raises:
            TypeError: The request cannot be expressed in JSON.
        """
        self._busy = True
        if not self._ready:
            start = self._exchange(None, _START_LIMIT_S)
            if "ready" not in start:
                return {"lost": _reason_not_started(start)}
            self._ready = True
        self._calls += 1
        try:
            reply = self._exchange(request, wall_s)
            while "progress" in reply:
                listen(reply["progress"])
                reply = self._exchange({"heard": True}, wall_s)
        except KeyboardInterrupt:
            self._interrupt(grace_s)
            raise
        # A child that ran out of memory may be in any state; it stays marked as busy and is replaced.
        self._busy = not reply.keys() & {"result", "mjcf", "user", "reply", "bug"}
        return reply

    def close(self) -> None:
        """End the process and remove its folder."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._requests, self._replies, self._output):
            try:
                pipe.close()
            except BrokenPipeError:  # an incomplete request can no longer be flushed
                continue
        shutil.rmtree(self._folder, ignore_errors=True)

    def _exchange(self, request: dict[str, Any] | None, limit_s: float) -> dict[str, Any]:
        timer = threading.Timer(limit_s, self._kill_late)
        timer.daemon = True
        timer.start()
        try:
            if request is not None:
                write_message(self._requests, request)
            reply = read_message(self._replies)
        except OSError:
            reply = None
        finally:
            timer.cancel()
        return self._cause_of_death() if reply is None else reply

    def _interrupt(self, grace_s: float) -> None:
        """Interrupt the function so that it saves its work, and wait for the end of the process."""
        if not grace_s or sys.platform == "win32":  # Windows cannot send SIGINT to a single process
            return
        timer = threading.Timer(grace_s, self._kill_late)
        timer.daemon = True
        timer.start()
        try:
            self._process.send_signal(signal.SIGINT)
            while self._replies.read(1):
                continue
        finally:
            timer.cancel()

    def _kill_late(self) -> None:
        self._late = True
        self._process.kill()

    def _cause_of_death(self) -> dict[str, Any]:
        """Return how the process ended, as a reply of `call`."""
        code = self._process.wait()
        if self._late:
            return {"time": "wall"}
        if sys.platform != "win32" and code == -signal.SIGXCPU:
            return {"time": "cpu"}
        output = (self._folder / "output.txt").read_text("utf-8", "replace")
        if "bad_alloc" in output or "MemoryError" in output:  # C++ prints bad_alloc before it aborts
            return {"memory": True}
        if -code in _FROM_OUTSIDE:
            return {"lost": f"it was ended by {signal.Signals(-code).name}"}
        name = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        return {"crash": f"{name}\n{output[-_OUTPUT_TAIL:]}".strip()}
