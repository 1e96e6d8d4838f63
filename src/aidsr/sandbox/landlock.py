"""Landlock: an unprivileged process permanently gives up access to files and network before it reads untrusted data.

Source: https://docs.kernel.org/userspace-api/landlock.html, from which the constants are named, and <linux/landlock.h>.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterable
from functools import cache
from pathlib import Path

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
"""Numbers of the system calls, the same on every architecture except Alpha."""
_VERSION_FLAG, _PATH_BENEATH, _NO_NEW_PRIVILEGES = 1, 1, 38

_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR, _REMOVE_DIR = (1 << bit for bit in range(5))
_TRUNCATE, _IOCTL_DEVICE = 1 << 14, 1 << 15
_READ = _EXECUTE | _READ_FILE | _READ_DIR
_OF_FILES = _EXECUTE | _WRITE_FILE | _READ_FILE | _TRUNCATE | _IOCTL_DEVICE
"""Rights that apply to files; the others apply only to folders."""
_FILE_RIGHTS = {1: 13, 2: 14, 3: 15, 5: 16}
"""Number of file-system rights by version of Landlock, for versions that added some."""
_TCP_SINCE, _BIND_AND_CONNECT_TCP = 4, 3
_SCOPES_SINCE, _ABSTRACT_SOCKETS_AND_SIGNALS = 6, 3


_CAPABILITY_VERSION = 0x20080522
_OVER_FILES = 0b11111
"""Capabilities to change owners and to bypass file permissions, which are kept: in a container, the superuser may have
to write to folders of other users. Source: <linux/capability.h>."""


class _Ruleset(ctypes.Structure):
    _fields_ = (("files", ctypes.c_uint64), ("network", ctypes.c_uint64), ("scoped", ctypes.c_uint64))


class _PathBeneath(ctypes.Structure):
    _pack_ = 1
    _layout_ = "ms"
    _fields_ = (("allowed", ctypes.c_uint64), ("folder", ctypes.c_int32))


@cache
def landlock_version() -> int:
    """Return the Landlock version of this kernel, or 0 without Landlock."""
    if sys.platform != "linux":
        return 0
    return max(0, int(ctypes.CDLL(None).syscall(_CREATE_RULESET, None, ctypes.c_size_t(0), ctypes.c_uint32(1))))


def limits_network() -> bool:
    """Return whether `give_up_files_and_network` covers the network."""
    return landlock_version() >= _TCP_SINCE


def give_up_files_and_network(
    *, readable: Iterable[str | Path], writable: Iterable[str | Path], devices: Iterable[str | Path], emptied: Path
) -> None:
    """Restrict this thread and those it starts to the given files; does nothing without Landlock.

    From version 4 of Landlock, TCP connections can neither be made nor accepted; from version 6, no signals can be sent
    to processes outside. Paths that do not exist are ignored.

    Args:
        readable: Files, and folders with everything below them, that may be read and executed.
        writable: Folders that may be read and changed, with everything below them.
        devices: Device files that may be read and written.
        emptied: Folder below which empty folders may be removed.

    Raises:
        OSError: The kernel refused a system call.
    """
    version = landlock_version()
    if not version:
        return
    everything = (1 << max(rights for since, rights in _FILE_RIGHTS.items() if since <= version)) - 1
    ruleset = _Ruleset(
        files=everything,
        network=_BIND_AND_CONNECT_TCP if version >= _TCP_SINCE else 0,
        scoped=_ABSTRACT_SOCKETS_AND_SIGNALS if version >= _SCOPES_SINCE else 0,
    )
    size = 24 if version >= _SCOPES_SINCE else 16 if version >= _TCP_SINCE else 8
    rules = _call(_CREATE_RULESET, ctypes.byref(ruleset), ctypes.c_size_t(size), ctypes.c_uint32(0))
    try:
        for rights, paths in (
            (_READ, readable),
            (everything, writable),
            (_OF_FILES & ~_EXECUTE, devices),
            (_REMOVE_DIR, (emptied,)),
        ):
            for path in paths:
                _allow(rules, Path(path), rights & everything)
        _give_up_privileges()
        if ctypes.CDLL(None, use_errno=True).prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0):
            raise OSError(ctypes.get_errno(), "prctl failed")
        _call(_RESTRICT_SELF, rules, ctypes.c_uint32(0))
    finally:
        os.close(rules)


def _give_up_privileges() -> None:
    """Give up all superuser capabilities except those of `_OVER_FILES`; some give access to memory of other processes.

    Raises:
        OSError: The kernel refused a system call.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    header = (ctypes.c_uint32 * 2)(_CAPABILITY_VERSION, 0)
    sets = (ctypes.c_uint32 * 6)()  # effective, permitted, inheritable: first the lower 32 bits of each, then the upper
    if libc.capget(header, sets):
        raise OSError(ctypes.get_errno(), "capget failed")
    sets[:] = [capabilities & (_OVER_FILES if place < 3 else 0) for place, capabilities in enumerate(sets)]
    if libc.capset(header, sets):
        raise OSError(ctypes.get_errno(), "capset failed")


def _allow(rules: int, path: Path, rights: int) -> None:
    try:
        opened = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    try:
        allowed = rights if path.is_dir() else rights & _OF_FILES
        rule = _PathBeneath(allowed=allowed, folder=opened)
        _call(_ADD_RULE, rules, _PATH_BENEATH, ctypes.byref(rule), ctypes.c_uint32(0))
    finally:
        os.close(opened)


def _call(number: int, *arguments: object) -> int:
    result = int(ctypes.CDLL(None, use_errno=True).syscall(number, *arguments))
    if result < 0:
        raise OSError(ctypes.get_errno(), f"Landlock: {os.strerror(ctypes.get_errno())}")
    return result
