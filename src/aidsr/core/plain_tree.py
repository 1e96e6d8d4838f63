"""Folders that may come from strangers: nothing in them may point elsewhere or block a reader."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from pathlib import Path

from aidsr.core.errors import UserError

_checked: dict[Path, tuple[int, int]] = {}
"""Inode and change time of the folders that were checked in this process."""


def require_plain_tree(folder: Path) -> None:
    """Refuse a folder that holds anything but regular files and folders.

    A link could make a file elsewhere be read, shown or overwritten; a named pipe blocks its reader for ever.
    `folder` itself may be a link: its user named it. It is checked once in a process, and again when its own entries
    change.

    Raises:
        UserError: It holds a link, a pipe, a socket or a device; names the first one.
    """
    try:
        found = folder.stat()
    except OSError:
        return  # whoever reads from it reports that
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
    """Refuse a link, a pipe, a socket or a device in the place of a file; a file that is absent is left to its reader.

    Raises:
        UserError: It is one.
    """
    try:
        kind = _kind(path.lstat().st_mode)
    except OSError:
        return
    if kind:
        raise UserError(f"{path} is a {kind}; only regular files are read. Replace it by a copy")


def _irregular(folder: Path) -> Iterator[tuple[Path, str]]:
    """Yield each entry at any depth that is neither a file nor a folder, with what it is; links are not followed."""
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
    """What an entry is, in words; empty for a regular file or a folder."""
    if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
        return ""
    if stat.S_ISLNK(mode):
        return "link"
    return "named pipe" if stat.S_ISFIFO(mode) else "socket or device"
