"""Pool of a few warm worker processes, each for one call at a time. This module imports nothing large."""

from __future__ import annotations

import atexit
import contextlib
import os
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from aidsr.sandbox.access import Access
from aidsr.sandbox.child import Child
from aidsr.sandbox.environment import inside_worker


def warm_up(count: int = 1, modules: Sequence[str] = ()) -> None:
    """Start workers in the background, so that they are ready for the first calls.

    Args:
        count: Number of idle workers to have, at most the size of the pool.
        modules: Modules that new workers import, because the first calls will need them.
    """
    if not inside_worker():
        _pool().warm_up(count, modules)


def module_path() -> list[str]:
    """Return the absolute entries of this process's module search path, for use in a child."""
    return [entry for entry in sys.path if Path(entry).is_absolute()]


def call_in_worker(
    request: dict[str, Any],
    wall_s: float,
    access: Access,
    prepare: Sequence[str] = (),
    listen: Callable[[list[Any]], None] = lambda _values: None,
    grace_s: float = 0.0,
) -> dict[str, Any]:
    """Send a request to an idle worker and return its reply, see `Child.call`; waits while all workers are busy.

    A call with `prepare` gets a new worker of its own.
    """
    if prepare:
        child = Child(access, prepare)
        try:
            return child.call(request, wall_s, listen, grace_s)
        finally:
            child.close()
    with _pool().child(access) as child:
        return child.call(request, wall_s, listen, grace_s)


class _Pool:
    def __init__(self, size: int) -> None:
        self._size = size
        self._slots = threading.BoundedSemaphore(size)
        self._lock = threading.Lock()
        self._idle: list[Child] = []

    @contextlib.contextmanager
    def child(self, access: Access) -> Iterator[Child]:
        """Lend a child that is ready or starting; waits while all are busy."""
        with self._slots:
            child = self._take(access)
            try:
                yield child
            finally:
                if child.usable:
                    with self._lock:
                        self._idle.append(child)
                else:
                    child.close()

    def warm_up(self, count: int, modules: Sequence[str]) -> None:
        with self._lock:
            while len(self._idle) < min(count, self._size):
                self._idle.append(Child(Access.needed(module_path(), ()), modules))

    def close(self) -> None:
        with self._lock:
            while self._idle:
                self._idle.pop().close()

    def _take(self, access: Access) -> Child:
        with self._lock:
            for child in reversed(self._idle):
                if child.usable and child.access.suffices_for(access):
                    self._idle.remove(child)
                    return child
            while self._idle and (len(self._idle) >= self._size or not self._idle[0].usable):
                self._idle.pop(0).close()
        return Child(access)


_pools: list[_Pool] = []
_pools_lock = threading.Lock()


def _pool() -> _Pool:
    """Return the pool of this process, which is created on first use."""
    with _pools_lock:
        if not _pools:
            # Our choice: one child per core, at least two so that a long call does not block a short one, and at most
            # four because each uses about 150 MB.
            _pools.append(_Pool(max(2, min(4, os.cpu_count() or 2))))
            atexit.register(_close)
            if hasattr(os, "register_at_fork"):
                os.register_at_fork(after_in_child=_pools.clear)  # a forked copy must not share pipes with the original
        return _pools[0]


def _close() -> None:
    while _pools:
        _pools.pop().close()
