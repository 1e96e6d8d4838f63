"""Checks of untrusted folders: nothing in them may point elsewhere or block a reader."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

from aidsr.core.errors import UserError

_checked: dict[Path, tuple[int, int]] = {}
"""Inode and change time of the folders that this process has checked."""


def require_plain_tree(folder: Path) -> None:
    """Check that a folder holds nothing but regular files and folders.

    A link could cause a file elsewhere to be read, shown or overwritten; a named pipe blocks its reader for ever.
    `folder` itself may be a link, because the user named it. A folder is checked once in a process, and again after its
    own entries have changed.

    Raises:
        UserError: The folder holds a link, a pipe, a socket or a device; the message names the first one.
    """
    try:
        found = folder.stat()
    except OSError:
        return  # the code that reads the folder reports this
    state = (found.st_ino, found.st_ctime_ns)
    if _checked.get(folder) == state or not stat.S_ISDIR(found.st_mode):
        return
    for path, kind in _irregular(folder):
        raise UserError(
            f"{folder} holds a {kind}: {path.relative_to(folder)}; only regular files and folders are read. Replace it "
            "by a copy"
        )
    _checked[folder] = state


def require_regular_file(path: Path) -> None:
    """Check that a path is not a link, a pipe, a socket or a device; a missing file is left to the code that reads it.

    Raises:
        UserError: The path is one of these.
    """
    try:
        kind = _kind(path.lstat().st_mode)
    except OSError:
        return
    if kind:
        raise UserError(f"{path} is a {kind}; only regular files are read. Replace it by a copy")


def _irregular(folder: Path) -> Iterator[tuple[Path, str]]:
    """Yield each entry at any depth that is neither a file nor a folder, with its kind; links are not followed."""
    with os.scandir(folder) as entries:
        for entry in sorted(entries, key=lambda each: each.name):
            try:
                mode = entry.stat(follow_symlinks=False).st_mode
            except FileNotFoundError:  # removed since it was listed
                continue
            if kind := _kind(mode):
                yield Path(entry.path), kind
            elif stat.S_ISDIR(mode):
                yield from _irregular(Path(entry.path))


def _kind(mode: int) -> str:
    """Return the kind of an entry in words; empty for a regular file or a folder."""
    if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
        return ""
    if stat.S_ISLNK(mode):
        return "link"
    return "named pipe" if stat.S_ISFIFO(mode) else "socket or device"
