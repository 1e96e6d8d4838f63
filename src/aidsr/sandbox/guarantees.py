"""Guarantees of the isolation on this platform, and a test of them on this machine."""

from __future__ import annotations

import ctypes
import socket
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from aidsr.core.errors import IsolationError
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.landlock import landlock_version, limits_network
from aidsr.sandbox.limits import Limits


@dataclass(frozen=True)
class Guarantee:
    """One guarantee of the isolation: its name, whether it holds, and how it is implemented or was tested."""

    name: str
    holds: bool
    how: str


def guarantees() -> tuple[Guarantee, ...]:
    """Return the guarantees and whether each is available on this platform, without a test."""
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
        Guarantee("no other files", landlock_version() > 0, f"Landlock, {_landlock()}"),
        Guarantee("no TCP connections", limits_network(), f"Landlock from version 4 on, {_landlock()}"),
        Guarantee("system calls filtered", False, "there is no seccomp filter; Landlock covers files and TCP only"),
        Guarantee("ends with its parent", True, "a child leaves when its request pipe closes"),
    )


def try_guarantees() -> tuple[Guarantee, ...]:
    """Test the guarantees by making workers crash, hang and exhaust memory; takes a few seconds."""
    attempts: tuple[tuple[str, Callable[[], None], str], ...] = (
        ("own process", _crash, "crash"),
        ("wall clock", _sleep, "time"),
        ("processor time", _spin, "time"),
        ("memory", _allocate, "memory"),
    )
    return (*(_attempt(*each) for each in attempts), _try_files(), _try_network())


def _landlock() -> str:
    version = landlock_version()
    return f"version {version} of this kernel" if version else "which this system does not offer"


def _try_files() -> Guarantee:
    with tempfile.NamedTemporaryFile() as file:
        refused = not _can_read(file.name)
    return Guarantee("no other files", refused, f"tested: a file of yours can{'not' * refused} be read")


def _try_network() -> Guarantee:
    with socket.create_server(("127.0.0.1", 0)) as server:
        refused = not _can_connect(server.getsockname()[1])
    return Guarantee("no TCP connections", refused, f"tested: a connection can{'not' * refused} be made")


def _attempt(name: str, misbehave: Callable[[], None], expected: str) -> Guarantee:
    try:
        misbehave()
    except IsolationError as error:
        return Guarantee(name, error.kind == expected, f"tested: the call ended in {error.kind}")
    return Guarantee(name, False, "tested: the call was not stopped")


@isolated
def _can_read(path: str) -> bool:
    try:
        Path(path).read_bytes()
    except OSError:
        return False
    return True


@isolated
def _can_connect(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), timeout=10).close()
    except OSError:
        return False
    return True


@isolated
def _crash() -> None:
    """Read from address zero, like a fault in a native library."""
    ctypes.string_at(0)


@isolated(limits=Limits(wall_s=0.5))
def _sleep() -> None:
    time.sleep(60)


@isolated(limits=Limits(wall_s=30, cpu_s=1))
def _spin() -> None:
    while True:
        pass


@isolated(limits=Limits(memory_mib=2048))
def _allocate() -> None:
    bytes(8192 * 2**20)
