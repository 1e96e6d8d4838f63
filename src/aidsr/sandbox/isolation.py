"""Run a function of AID-SR in a limited child process.

A model written by a language model or a stranger can make a native library crash, hang or swallow all memory.
Everything that compiles or steps such a model therefore goes through `call`, which keeps a few warm workers (see
`aidsr.sandbox.worker`), replaces those that die, and turns every such end into an `IsolationError`.

This module loads nothing heavy: the parent needs no MuJoCo to have a model checked.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from aidsr.core.errors import IsolationError, MjcfError, UserError
from aidsr.sandbox.child import Child
from aidsr.sandbox.worker import INSIDE, resolve

__all__ = ["Guarantee", "Limits", "call", "guarantees", "prepare"]


@dataclass(frozen=True)
class Limits:
    """What one call may use. Our choice: generous for a robot of this size, small for a machine."""

    wall_s: float = 60.0
    cpu_s: float = 120.0
    """Processor time over all threads; a whole battery of tests on two threads takes about 1 s."""
    memory_mib: int = 4096
    """Address space; a worker maps 0.2 GiB when it starts and 0.9 GiB while it draws with OpenGL."""


@dataclass(frozen=True)
class Guarantee:
    """One thing that isolation promises, and whether this platform can keep it."""

    name: str
    holds: bool
    how: str


def call(function: str, argument: dict[str, Any], limits: Limits | None = None) -> dict[str, Any]:
    """Run a function in a worker and return what it returns.

    May be called from several threads; each call has a worker of its own. Called inside a worker it runs the function
    at once, under the limits of the call that is going on: that process is isolated already.

    Args:
        function: "aidsr.module:function", taking one dict and returning one.
        argument: Passed as JSON; bytes travel as base64.
        limits: What the call may use; `Limits()` when not given.

    Returns:
        The function's result, as JSON can express it.

    Raises:
        MjcfError: As the function raised it.
        UserError: As the function raised it.
        IsolationError: The call ran past a limit or its process died.
        RuntimeError: A bug of ours in the function; the child's traceback is a note on the error.
    """
    if INSIDE in os.environ:
        return resolve(function)(argument)
    limits = limits or Limits()
    request = {
        "function": function,
        "argument": argument,
        "limits": {"cpu_s": limits.cpu_s, "memory_mib": limits.memory_mib},
    }
    with _pool().child() as child:
        answer = child.ask(request, limits.wall_s)
    if "result" in answer:
        result: dict[str, Any] = answer["result"]
        return result
    raise _error(function, answer, limits)


def prepare() -> None:
    """Start a worker in the background, so that it is warm by the time it is asked."""
    if INSIDE not in os.environ:
        _pool().prepare()


def guarantees() -> tuple[Guarantee, ...]:
    """Return what isolation covers on this platform, for `aidsr doctor` and the documentation."""
    posix, linux = sys.platform != "win32", sys.platform == "linux"
    return (
        Guarantee("own process", True, "a crash of a native library ends a child, never the caller"),
        Guarantee("wall clock", True, "the caller ends a child that answers too late"),
        Guarantee("processor time", posix, "RLIMIT_CPU for each call"),
        Guarantee("memory", linux, "RLIMIT_AS for each call"),
        Guarantee("no core dumps", posix, "RLIMIT_CORE 0"),
        Guarantee("file size", posix, "RLIMIT_FSIZE 256 MiB"),
        Guarantee("private working directory", True, "a temporary folder, removed when the child ends"),
        Guarantee("no keys", True, "a child's environment holds only variables from a short list"),
        Guarantee("ends with its parent", True, "a child leaves when its request pipe closes"),
    )


def _error(function: str, answer: dict[str, Any], limits: Limits) -> Exception:
    """Return what to raise for an answer that brought no result."""
    if "mjcf" in answer:
        from aidsr.core.artifacts import Fault

        return MjcfError([Fault.model_validate(fault) for fault in answer["mjcf"]])
    if "user" in answer:
        return UserError(answer["user"])
    if "bug" in answer:
        error = RuntimeError(f"{function} failed in its worker: {answer['bug'].strip().splitlines()[-1]}")
        error.add_note("In the worker:\n" + answer["bug"])
        return error
    if "time" in answer:
        spent = f"{limits.wall_s:g} s" if answer["time"] == "wall" else f"{limits.cpu_s:g} s of processor time"
        return IsolationError(
            "time", f"{function} was stopped after {spent}; the model is too large or too slow to run"
        )
    if "memory" in answer:
        return IsolationError("memory", f"{function} needed more than {limits.memory_mib} MiB; the model is too large")
    return IsolationError("crash", f"the process running {function} died: {answer['crash']}")


class _Pool:
    """A few children, each serving one call at a time."""

    def __init__(self, size: int) -> None:
        self._slots = threading.BoundedSemaphore(size)
        self._lock = threading.Lock()
        self._idle: list[Child] = []

    @contextlib.contextmanager
    def child(self) -> Iterator[Child]:
        """Lend a child that is ready or being started; waits while all are busy."""
        with self._slots:
            child = self._take()
            try:
                yield child
            finally:
                if child.usable:
                    with self._lock:
                        self._idle.append(child)
                else:
                    child.close()

    def prepare(self) -> None:
        with self._lock:
            if not self._idle:
                self._idle.append(Child())

    def close(self) -> None:
        with self._lock:
            while self._idle:
                self._idle.pop().close()

    def _take(self) -> Child:
        with self._lock:
            while self._idle:
                child = self._idle.pop()
                if child.usable:
                    return child
                child.close()
        return Child()


_made: list[_Pool] = []
_making = threading.Lock()


def _pool() -> _Pool:
    """Return the pool of this process, made when first needed."""
    with _making:
        if not _made:
            # Our choice: one child per core, at least two so that a long call does not hold up a short one, and at most
            # four because each holds about 150 MB.
            _made.append(_Pool(max(2, min(4, os.cpu_count() or 2))))
            atexit.register(_close)
            if hasattr(os, "register_at_fork"):
                os.register_at_fork(after_in_child=_made.clear)  # a forked copy must not share pipes with the original
        return _made[0]


def _close() -> None:
    while _made:
        _made.pop().close()
