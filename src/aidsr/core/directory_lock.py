"""A directory that one owner at a time works in; the system gives it back when the process dies."""

from __future__ import annotations

import os
import weakref
from pathlib import Path

from aidsr.core.errors import UserError

_FILE = ".in_use"


class Claim:
    """Keeps a directory for its owner until it is released, or nobody holds it any more.

    Windows, and file systems without locks, have no such guard: there, every claim is granted.

    Raises:
        UserError: Another run, in this or another process, has the directory.
    """

    def __init__(self, directory: Path) -> None:
        file = os.open(directory / _FILE, os.O_RDWR | os.O_CREAT, 0o644)
        if not _locked(file):
            os.close(file)
            raise UserError(
                f"a directory that no other run uses was expected; {directory} belongs to a run that is at work, so "
                "name another one or wait until that run ends"
            )
        self.release = weakref.finalize(self, os.close, file)
        """Gives the directory back; called again, it does nothing."""


def _locked(file: int) -> bool:
    """Whether the lock of a file was free, and is now held."""
    try:
        import fcntl
    except ImportError:  # Windows
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True
