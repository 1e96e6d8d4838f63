"""A lock that gives a directory to one owner at a time; the operating system releases it when the process dies."""

from __future__ import annotations

import os
import time
import weakref
from pathlib import Path

from aidsr.core.errors import UserError

LOCK_FILE = ".in_use"
"""Empty file that is locked by the process that owns the directory."""

_GLANCES_S = (0.01, 0.05)
"""Pauses between attempts to lock a directory [s]: a process that only tests the lock holds it for an instant."""


class DirectoryLock:
    """Lock on a directory, held until `release` is called or the object is garbage-collected.

    On Windows, and on file systems without locks, nothing is locked and no error is raised.

    Raises:
        UserError: Another run, in this or another process, holds the lock.
    """

    def __init__(self, directory: Path) -> None:
        file = os.open(directory / LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o644)
        if not _locked(file):
            os.close(file)
            raise UserError(f"{directory} is locked by another run; choose another directory, or wait")
        self.release = weakref.finalize(self, os.close, file)
        """Release the lock; a second call does nothing."""


def _locked(file: int) -> bool:
    """Try to lock an open file, and return whether that succeeded."""
    try:
        import fcntl
    except ImportError:  # Windows
        return True
    for pause_s in (*_GLANCES_S, None):
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if pause_s is None:
                return False
            time.sleep(pause_s)
        except OSError:  # a file system without locks
            return True
        else:
            return True
    raise AssertionError("the last attempt returns")
