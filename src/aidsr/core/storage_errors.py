"""Messages for file errors that the user can solve: a full disk, a read-only folder, a missing permission."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from aidsr.core.errors import UserError

_PROBLEMS = {
    "ENOSPC": ("the disk is full", "free space there"),
    "EDQUOT": ("the disk quota is used up", "free space there"),
    "EFBIG": ("the file would be larger than is allowed", "raise the limit on the size of files (ulimit -f)"),
    "EROFS": ("the file system is read-only", "name a folder that can be written"),
    "EACCES": ("permission denied", "change the permissions, or name another place"),
    "EPERM": ("the operation is not permitted", "change the permissions, or name another place"),
    "EIO": ("the disk reports an input/output error", "check the disk"),
    "ENAMETOOLONG": ("the name is too long", "use a shorter one"),
    "EMFILE": ("too many files are open in this process", "raise the limit on open files (ulimit -n)"),
    "ENFILE": ("too many files are open on this machine", "close other programs"),
    "EEXIST": ("a file stands where a folder is needed", "name another place"),
    "ENOTDIR": ("a file stands where a folder is needed", "name another place"),
    "EISDIR": ("a folder stands where a file is needed", "name a file"),
}
_BY_NUMBER = {getattr(errno, name): problem for name, problem in _PROBLEMS.items() if hasattr(errno, name)}


class StorageError(UserError):
    """A file could not be written or read for a reason that the user can solve."""


@contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """Raise StorageError for known file errors in the context, in which `path` is written."""
    try:
        yield
    except OSError as error:
        error.filename = str(path)  # a full disk is reported without a name, other errors with that of a temporary file
        problem = storage_problem(error)
        if problem is None:
            raise
        raise StorageError(problem) from error


def storage_problem(error: BaseException) -> str | None:
    """Return a sentence with the problem of a file error and its solution; None for an error of another kind."""
    if not isinstance(error, OSError) or error.errno not in _BY_NUMBER:
        return None
    fault, cure = _BY_NUMBER[error.errno]
    place = f"{error.filename}: {fault}" if error.filename else fault[0].upper() + fault[1:]
    return f"{place}; {cure}, then repeat the command. What was finished before is kept"
