"""Resource limits of a call in a worker, and their enforcement by the operating system."""

from __future__ import annotations

import contextlib
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

_MAX_FILE_BYTES = 256 * 2**20  # our choice: a picture is 100 KB, a video a few MB; a runaway log must not fill the disk


@dataclass(frozen=True)
class Limits:
    """Resource limits of one call. Our choice: generous for a robot of this size, small for a machine."""

    wall_s: float = 60.0
    """Largest wall time until the result, or until the next call of the function's listener, if it has one."""
    cpu_s: float = 120.0
    """Largest CPU time of all threads, inf for no limit; the validator's whole set of tests on two threads takes about
    1 s."""
    memory_mib: int = 4096
    """Largest address space; a worker maps 0.2 GiB when it starts and 0.9 GiB while it renders with OpenGL."""
    grace_s: float = 0.0
    """Time to save its work that the function gets after Ctrl-C, with a KeyboardInterrupt; 0 ends it at once."""


def set_process_limits(memory_mib: int | None = None) -> None:
    """Set the permanent limits of this process: no core dumps, no large files, and memory if given."""
    if sys.platform != "win32":
        import resource

        limits = {resource.RLIMIT_CORE: 0, resource.RLIMIT_FSIZE: _MAX_FILE_BYTES}
        if memory_mib is not None and sys.platform == "linux":  # macOS ignores RLIMIT_AS
            limits[resource.RLIMIT_AS] = memory_mib * 2**20
        for kind, limit in limits.items():
            both = _within(limit, resource.getrlimit(kind)[1])
            resource.setrlimit(kind, (both, both))


def _within(limit: int, hard: int) -> int:
    """Return a limit, reduced to the hard limit that this process was started with, for example by ulimit."""
    import resource

    return limit if hard == resource.RLIM_INFINITY else min(limit, hard)


def renew_cpu_limit(cpu_s: float) -> None:
    """Set the CPU limit so that the system kills this process after this much additional CPU time."""
    if sys.platform != "win32":
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_CPU)
        resource.setrlimit(resource.RLIMIT_CPU, (_within(math.ceil(time.process_time() + cpu_s), hard), hard))


@contextlib.contextmanager
def call_limits(cpu_s: float, memory_mib: int) -> Iterator[None]:
    """Limit CPU time and address space of this process for the duration of one call.

    Beyond the CPU limit the system kills the process (SIGXCPU); beyond the memory limit allocations fail. Only the soft
    limits are changed, so that they can be restored.
    """
    if sys.platform == "win32":
        yield
        return
    import resource

    limits = {}
    if math.isfinite(cpu_s):
        limits[resource.RLIMIT_CPU] = math.ceil(time.process_time() + cpu_s)
    if sys.platform == "linux":  # macOS ignores RLIMIT_AS
        limits[resource.RLIMIT_AS] = memory_mib * 2**20
    before = {kind: resource.getrlimit(kind) for kind in limits}
    for kind, soft in limits.items():
        hard = before[kind][1]
        resource.setrlimit(kind, (_within(soft, hard), hard))
    try:
        yield
    finally:
        for kind, both in before.items():
            resource.setrlimit(kind, both)
